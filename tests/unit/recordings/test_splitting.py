"""Recordings are held out whole, and motions that repeat each other are held out together."""

from functools import partial

import numpy as np
import pytest
from campaigns import GIVEN, campaign, planted, recording, steady_table
from hypothesis import given
from hypothesis import strategies as st
from rigs import arm

from nnhydro.errors import CampaignError
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.splitting import STEADY_UNITS, Unit, folds, units, validation_split


def unit(name, group="", steady=False):
    return Unit(name, group or name, steady, partial(tuple, []))


@st.composite
def collections(draw):
    """Between 2 and 30 units in at least two groups, some of them steady."""
    groups = draw(st.lists(st.integers(0, 9), min_size=2, max_size=20).filter(lambda x: len(set(x)) > 1))
    steady = draw(st.integers(0, 10))
    return [unit(f"r{i}", f"g{g}") for i, g in enumerate(groups)] + [unit(f"s{i}", steady=True) for i in range(steady)]


@given(collections(), st.integers(2, 8), st.integers(0, 5))
def test_every_unit_is_held_out_exactly_once(some, count, seed):
    split = folds(some, count, seed)
    assert sorted(i for fold in split for i in fold) == list(range(len(some)))
    assert all(split)


@given(collections(), st.integers(2, 8), st.integers(0, 5))
def test_repeats_of_a_motion_are_never_torn_apart(some, count, seed):
    where = {}
    for number, fold in enumerate(folds(some, count, seed)):
        for i in fold:
            assert where.setdefault(some[i].group, number) == number


@given(collections(), st.integers(2, 8), st.integers(0, 5))
def test_the_same_seed_gives_the_same_folds(some, count, seed):
    assert folds(some, count, seed) == folds(some, count, seed)


def test_another_seed_gives_other_folds():
    some = [unit(f"r{i}") for i in range(12)]
    assert len({folds(some, 4, seed) for seed in range(5)}) > 1


def test_folds_are_of_about_the_same_size():
    sizes = [len(fold) for fold in folds([unit(f"r{i}") for i in range(13)], 5)]
    assert max(sizes) - min(sizes) <= 1


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("recordings", [0, 7, 8])
def test_every_fold_holds_some_recordings_and_some_steady_runs(count, recordings):
    some = [unit(f"r{i}") for i in range(recordings)] + [unit(f"s{i}", steady=True) for i in range(20)]
    split = folds(some, count)
    assert len(split) == count
    for fold in split:
        assert any(some[i].steady for i in fold)
        assert any(not some[i].steady for i in fold) or not recordings


def test_no_more_folds_than_motions():
    assert len(folds([unit("a"), unit("b"), unit("c")], 10)) == 3


@pytest.mark.parametrize("some", [[], [unit("a")], [unit("a", "g"), unit("b", "g")]])
def test_a_single_motion_cannot_be_held_out_and_the_message_says_what_to_do(some):
    with pytest.raises(CampaignError, match="holding some out needs at least two; record more"):
        folds(some, 5)


@given(collections(), st.floats(0.05, 0.9), st.integers(0, 5))
def test_what_is_watched_is_not_trained_on_and_no_group_is_torn(some, share, seed):
    chosen = range(0, len(some), 2)
    trained, watched = validation_split(chosen, some, share, seed)
    assert sorted(trained + watched) == list(chosen)
    assert not {some[i].group for i in trained} & {some[i].group for i in watched}
    assert (trained, watched) == validation_split(chosen, some, share, seed)


def test_a_share_of_the_groups_is_watched_but_never_all_of_one():
    some = [unit(f"r{i}") for i in range(20)]
    assert len(validation_split(range(20), some, 0.15, 0)[1]) == 3
    assert validation_split([3], some, 0.5, 0) == ((3,), ())


def test_steady_runs_at_the_same_state_stay_together():
    a = arm(2)
    table = steady_table(a, planted(a), rows=30)
    again = np.tile(np.arange(30), 3)
    found = units(Campaign.of(a, [], (table.rows(again),)), GIVEN, seed=3)
    assert len(found) == STEADY_UNITS
    states = [{tuple(np.round(row, 6)) for row in np.column_stack([s.q, s.u0])} for u in found for s in u.segments()]
    assert sum(map(len, states)) == len(set().union(*states)) == 30
    assert sum(len(s) for u in found for s in u.segments()) == 90


def test_recordings_that_repeat_each_other_share_a_group():
    a = arm(1)
    whole = Campaign.of(a, [recording(a, planted(a), f"r{i}", seconds=1.0) for i in range(4)])
    found = units(whole, GIVEN, groups={"r1": "r0"})
    assert [u.group for u in found] == ["r0", "r0", "r2", "r3"]
    assert all((0 in fold and 1 in fold) or not {0, 1} & set(fold) for fold in folds(found, 2))


def test_units_are_prepared_when_asked_and_give_the_recordings_segments():
    a = arm(1)
    whole = campaign(a, planted(a), 2, seconds=1.0)
    for u in units(whole, GIVEN):
        (segment,) = u.segments()
        assert segment.recording == u.name
        assert np.array_equal(segment.tau, whole.load(u.name).tau)
