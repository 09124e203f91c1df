"""Recordings that hold most of what remains: a stop that was hit or a channel that froze hides what is plain in all others.

Bayesian treatments of outliers give each observation a small probability of coming from elsewhere; here the observation is a recording.
Source: Box & Tiao (1968), Biometrika 55: the principle.
"""

from collections.abc import Iterable, Set
from dataclasses import replace

import numpy as np

from nnhydro.diagnosis.constants import FORM
from nnhydro.diagnosis.decision.heldout_errors import Residual
from nnhydro.diagnosis.result import DiagnosisResult
from nnhydro.diagnosis.unexplained.residual_location import few_names

MOST_ENERGY, MOST_RECORDINGS, FEWEST_OTHERS = 1 / 2, 1 / 4, 3  # of what remains; of the recordings; that are then left


def recordings_apart(found: DiagnosisResult, names: tuple[str, ...]) -> frozenset[str]:
    """Return the few of the recordings `names` that hold most of what remains at a joint; none where nothing remains."""
    place = found.remainder.place
    if not found.remainder.detected or place is None:
        return frozenset()
    apart, joint = frozenset(place.recordings) & frozenset(names), place.joint - 1
    energy = dict.fromkeys(names, 0.0)
    for part in found.proof.remains:
        energy[part.recording] = energy.get(part.recording, 0.0) + float((part.r[:, joint] ** 2).sum())
    few = len(apart) <= MOST_RECORDINGS * len(names) and len(names) - len(apart) >= FEWEST_OTHERS
    return apart if few and sum(energy[name] for name in apart) > MOST_ENERGY * sum(energy.values()) else frozenset()


def _mean_remainder(parts: Iterable[Residual], without: Set[str]) -> float:
    """The mean of |residual| on all recordings but these, N m."""
    return float(np.mean(np.concatenate([np.abs(part.r).ravel() for part in parts if part.recording not in without])))


def better_without(found: DiagnosisResult, others: DiagnosisResult, apart: frozenset[str]) -> DiagnosisResult:
    """Return `others`, the diagnosis without the recordings `apart`, if it names effects that leave less of these others; else `found`."""
    before, after = (_mean_remainder(result.proof.remains, apart) for result in (found, others))
    if not others.findings or after > (1 - FORM) * before:
        return found
    said = (f"{few_names(sorted(apart))} took no part: most of what no effect explains lies there. In the other recordings, the effects "
            "named are plain.")
    return replace(others, checks=others.checks | {"left_out": " ".join([others.checks.get("left_out", ""), said]).strip()})
