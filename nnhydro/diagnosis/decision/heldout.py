"""What is held out of a fit together: recordings, or blocks where these are fewer than `FEWEST`, and rows of tables alike in load."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import FORM
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary

Index = NDArray[np.int64]
FEWEST = 6  # fewest recordings that are held out as a whole; of fewer, blocks are
FOLDS = 8  # most folds of the cross-validation
RECORDINGS, STRETCHES, FREQUENCIES = "recordings", "stretches of recordings", "frequencies of recordings"
STEADY = "rows of the steady tables"


def unit_held_out(view: WeightedLibrary, chosen: Sequence[int]) -> str:
    """Return what is held out: recordings; stretches or frequencies if recordings are few, or if a member of `chosen` acts in one only."""
    problem = view.library.design.problem
    if all(block.steady for block in problem.blocks):
        return STEADY
    if problem.groups >= FEWEST and all(_is_known_from_others(view, k, problem.group_of) for k in chosen):
        return RECORDINGS
    return STRETCHES if all(_is_known_from_others(view, k, problem.block_of) for k in chosen) else FREQUENCIES


def _is_known_from_others(view: WeightedLibrary, k: int, unit: Index) -> bool:
    """Return whether the other units (n,) tell of hypothesis `k`, if one is held out: of its phase, or by FORM of what it does."""
    if view.library.hypotheses[k].per_recording:
        return len(np.unique(unit)) > view.library.design.problem.groups
    energy = np.bincount(unit, weights=np.square(view.columns(k).Xw).sum(axis=(1, 2)))
    return bool(energy.max() <= (1 - FORM) * energy.sum())


def fold_of_rows(view: WeightedLibrary, seed: int, unit: str) -> Index:
    """Return the fold (n,) of every row: a `unit` lies in one fold, every FOLDS-th frequency too, and steady rows alike in load.

    Any smooth curve predicts a row of a dense table from the rows beside it; a law predicts loads that its fit has not seen.
    """
    problem = view.library.design.problem
    if unit == FREQUENCIES:
        return (np.arange(len(problem.block_of)) % FOLDS).astype(np.int64)
    part = problem.group_of if unit == RECORDINGS else problem.block_of
    steady = problem.frequency < 0
    made = np.where(steady, _alike_in_load(view, steady) + int(part.max()) + 1, part)
    _, index = np.unique(made, return_inverse=True)
    count = int(index.max()) + 1
    fold = np.random.default_rng(seed).permutation(count) % min(FOLDS, count)
    return fold[index].astype(np.int64)


def _alike_in_load(view: WeightedLibrary, steady: NDArray[np.bool_]) -> Index:
    """The part (n,) of all steady rows, of FOLDS in all, that each is in by the torque of the stated model; 0 elsewhere.

    Source: blocked cross-validation, Roberts et al. (2017), Ecography 40.
    """
    design, made = view.library.design, np.zeros(len(steady), dtype=np.int64)
    load = (np.abs(design.tau - design.y) / design.scale).sum(axis=1)
    order = np.argsort(load[steady], kind="stable")  # where all are alike, in the order of the table
    made[np.flatnonzero(steady)[order]] = np.arange(len(order)) * FOLDS // max(len(order), 1)
    return made
