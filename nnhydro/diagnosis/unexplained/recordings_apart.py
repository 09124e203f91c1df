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
    """Return the fewest of the recordings `names` that hold most of what remains at a joint, if they are few; none where nothing remains.

    Nor any where parameters differ between recordings: a cause that varies, as oil that warms, would be hidden without them.
    """
    if not rest.detected or rest.parameters_differ:
        return frozenset()
    energy = dict.fromkeys(names, np.zeros(heldout.remains[0].r.shape[1]))
    for part in heldout.remains:
        energy[part.recording] = energy.get(part.recording, 0.0) + (part.r**2).sum(axis=0)
    everything = list(energy)  # tables as well, no part of which stands apart
    most = min(int(MOST_RECORDINGS * len(names)), len(names) - FEWEST_OTHERS)
    for of_joint in np.transpose(list(energy.values())):  # (joints, recordings)
        loudest = np.argsort(-of_joint, kind="stable")
        fewest = int(np.searchsorted(np.cumsum(of_joint[loudest]), MOST_ENERGY * of_joint.sum(), side="right")) + 1
        apart = {everything[k] for k in loudest[:fewest]}
        if of_joint.any() and fewest <= most and apart <= set(names):
            return frozenset(apart)
    return frozenset()


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
