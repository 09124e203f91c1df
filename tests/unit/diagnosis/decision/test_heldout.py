"""Recordings that the fit has not seen: folds hold what hangs together."""

from types import SimpleNamespace

import numpy as np
import pytest
from problems import design, law, search

from nnhydro.diagnosis.decision.heldout import (
    FEWEST,
    FOLDS,
    FREQUENCIES,
    RECORDINGS,
    STEADY,
    STRETCHES,
    fold_of_rows,
    unit_held_out,
)

LAWS = (law("a"), law("b", 2), law("c", per_recording=True), law("d", 2, per_recording=True))


def folds(view, chosen=()):
    """The fold of every row of a view, the unit held out for the members `chosen`."""
    return fold_of_rows(view, 0, unit_held_out(view, chosen))


def test_folds_are_whole_recordings_or_blocks_where_these_are_few_and_rows_of_steady_tables():
    of = design(11, groups=7, rows=8)
    fold = folds(search(of, LAWS).view)
    assert all(len(set(fold[of.problem.group_of == g])) == 1 for g in range(7))
    few = design(11, groups=3, rows=8)
    fold = folds(search(few, LAWS).view)
    assert all(len(set(fold[few.problem.block_of == b])) == 1 for b in range(6))
    assert len(set(fold)) == 6
    few = design(11, groups=3, rows=40)
    few.tau = few.y + np.random.default_rng(2).uniform(0, 9, few.y.shape)  # what the stated model explains, in no order
    table = few.problem.group_of == 2
    few.problem.frequency[table] = -1.0
    one = search(few, LAWS).view
    fold, load = folds(one)[table], (np.abs(few.tau - few.y) / few.scale).sum(axis=1)[table]
    parts = fold[np.argsort(load, kind="stable")]
    assert len(set(fold)) > 3
    assert np.count_nonzero(np.diff(parts)) < FOLDS, "rows alike in load are held out together: no curve joins their neighbours"


def test_a_phase_of_a_recording_s_own_is_predicted_from_other_frequencies_where_a_block_is_all_that_it_has():
    of = design(11, groups=7, rows=24)
    one, phased, plain = search(of, LAWS), 2, 0
    blocks = folds(one.view, [phased])
    assert all(len(set(blocks[of.problem.block_of == b])) == 1 for b in range(14))
    of.problem.block_of = of.problem.group_of
    rows = folds(one.view, [phased])
    assert all(len(set(rows[of.problem.group_of == g])) == FOLDS for g in range(7)), "every fold sees every recording"
    assert all(len(set(folds(one.view, [plain])[of.problem.group_of == g])) == 1 for g in range(7))


@pytest.mark.parametrize(("acts_in", "what"), [(range(14), RECORDINGS), ((0, 1), STRETCHES), ((0,), FREQUENCIES), ((0, 2), RECORDINGS)])
def test_what_is_held_out_leaves_something_that_tells_of_the_law(acts_in, what):
    of = design(11, groups=7, rows=24)
    X = np.random.default_rng(3).standard_normal((*of.y.shape, 6)) * np.isin(of.problem.block_of, list(acts_in))[:, None, None]
    assert unit_held_out(search(of, LAWS, X).view, [0]) == what


def test_of_few_recordings_stretches_are_held_out_and_of_tables_rows():
    of = design(11, groups=FEWEST - 1, rows=24)
    view = search(of, LAWS).view
    assert unit_held_out(view, []) == STRETCHES
    of.problem.blocks = [SimpleNamespace(steady=True)]
    assert unit_held_out(view, []) == STEADY
