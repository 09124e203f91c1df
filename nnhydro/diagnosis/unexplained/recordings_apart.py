"""Recordings that hold most of what remains: a stop that was hit or a channel that froze hides what is plain in all others.

Bayesian treatments of outliers give each observation a small probability of coming from elsewhere; here the observation is a recording.
Source: Box & Tiao (1968), Biometrika 55: the principle.
"""

from collections.abc import Iterable, Sequence, Set

import numpy as np

from nnhydro.diagnosis.constants import FORM
from nnhydro.diagnosis.decision.heldout_errors import HeldoutErrors, Residual
from nnhydro.diagnosis.unexplained.residual_location import few_names
from nnhydro.diagnosis.unexplained.unexplained import Remainder

MOST_ENERGY = 1 / 2  # least share of the remaining energy in the few recordings set apart: most of it
MOST_RECORDINGS = 1 / 4  # largest share of recordings set apart: three in four then agree
FEWEST_OTHERS = 3  # fewest other recordings: with fewer no effect is named


def recordings_apart(rest: Remainder, heldout: HeldoutErrors, names: Sequence[str]) -> frozenset[str]:
    """Return the few of the recordings `names` that hold most of what remains at a joint; none where nothing remains.

    They are those that exceed the noise. If none does, one may have made the noise of all seem as large: then they are the fewest.
    Nor any where parameters differ between recordings: a cause that varies, as oil that warms, would be hidden without them.
    """
    if not rest.detected or rest.parameters_differ:
        return frozenset()
    energies = [(part.recording, (part.r**2).sum(axis=0)) for part in heldout.remains]
    joint = int(np.argmax(sum(energy for _, energy in energies))) if rest.place is None else rest.place.joint - 1
    of_joint = dict.fromkeys(names, 0.0)
    for name, energy in energies:
        of_joint[name] = of_joint.get(name, 0.0) + float(energy[joint])
    loudest, least = sorted(of_joint, key=lambda name: -of_joint[name]), MOST_ENERGY * sum(of_joint.values())
    fewest = int(np.searchsorted(np.cumsum([of_joint[name] for name in loudest]), least, side="right")) + 1
    apart = frozenset(loudest[:fewest] if rest.place is None else rest.place.recordings) & frozenset(names)  # no part of a table
    few = len(apart) <= MOST_RECORDINGS * len(names) and len(names) - len(apart) >= FEWEST_OTHERS
    return apart if few and sum(of_joint[name] for name in apart) > least else frozenset()


def _mean_remainder(parts: Iterable[Residual], without: Set[str]) -> float:
    """The mean of |residual| on all recordings but these, N m."""
    return float(np.mean(np.concatenate([np.abs(part.r).ravel() for part in parts if part.recording not in without])))


def leaves_less(heldout: HeldoutErrors, others: HeldoutErrors, apart: Set[str]) -> bool:
    """Return whether a diagnosis of all `others` leaves less of them than one with the recordings `apart`, by FORM at least."""
    return _mean_remainder(others.remains, apart) < (1 - FORM) * _mean_remainder(heldout.remains, apart)


def apart_sentence(apart: Set[str]) -> str:
    """Return that the recordings `apart` took no part, and why, as sentences."""
    return (f"{few_names(sorted(apart))} took no part: most of what no effect explains lies there. In the other recordings, the effects "
            "named are plain.")
