"""The rows that are compared: cosines of blocks of recordings in a band, the same whatever the sampling rate."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from campaigns import angles_only, campaign, planted, recording, steady_table
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import arm

from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import WAVE_PERIODS, design_of, hypotheses_for
from nnhydro.diagnosis.problem.problem import FEWEST_BLOCKS, FEWEST_PERIODS, draw_names, problem_of
from nnhydro.errors import CampaignError, ConfigError
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.computed_slopes import LeftOut
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

ARM = arm(1)
WHOLE = campaign(ARM, planted(ARM), count=4, noise=0.01)
PROBLEM = problem_of(WHOLE, edge=3.0)
BLOCKS = st.sampled_from(range(len(PROBLEM.blocks)))


def span(block, problem=PROBLEM):
    """Time since the start of the block's stretch (rows of the stretch,), and the step."""
    segment = problem.stretches[block.stretch].segment
    return segment.t - segment.t[0], segment.dt


@given(number=BLOCKS, seed=st.integers(0, 100))
def test_what_lies_in_the_band_keeps_its_sum_of_squares_and_comes_back(number, seed):
    block = PROBLEM.blocks[number]
    c = np.random.default_rng(seed).standard_normal((block.modes, 2))
    x = PROBLEM.inverse(block, c)
    whole = np.zeros((len(span(block)[0]), 2))
    whole[block.start:block.stop] = x
    back = PROBLEM.transform(block, whole)
    np.testing.assert_allclose(back, c, atol=1e-9)
    assert (back**2).sum() == pytest.approx((x**2).sum() * span(block)[1])


@given(number=BLOCKS, seed=st.integers(0, 100))
def test_the_band_never_adds_to_a_sum_of_squares_and_the_transform_is_linear(number, seed):
    block = PROBLEM.blocks[number]
    x, y = np.random.default_rng(seed).standard_normal((2, len(span(block)[0])))
    assert (PROBLEM.transform(block, x) ** 2).sum() <= (x[block.start:block.stop] ** 2).sum() * span(block)[1] + 1e-9
    one, other = PROBLEM.transform(block, x), PROBLEM.transform(block, y)
    np.testing.assert_allclose(PROBLEM.transform(block, 2 * x - y), 2 * one - other, atol=1e-9)


def test_all_rows_lie_in_the_band_and_belong_to_their_recording():
    assert PROBLEM.frequency.min() >= 0
    assert PROBLEM.frequency.max() <= PROBLEM.edge
    assert PROBLEM.groups == 4
    assert set(PROBLEM.group_of) == {0, 1, 2, 3}
    assert len(PROBLEM.frequency) == len(PROBLEM.block_of) == len(PROBLEM.group_of) == sum(b.modes for b in PROBLEM.blocks)


@given(count=st.integers(1, 6), seconds=st.floats(3.0, 12.0), edge=st.floats(0.5, 6.0))
@settings(max_examples=8)
def test_blocks_are_long_enough_do_not_overlap_and_are_many_where_recordings_are_long(count, seconds, edge):
    problem = problem_of(campaign(ARM, planted(ARM), count=count, seconds=seconds), edge=edge)
    for one, other in zip(problem.blocks, problem.blocks[1:], strict=False):
        assert one.stretch != other.stretch or one.stop <= other.start
    lasts = [(b.stop - b.start) * problem.stretches[b.stretch].segment.dt for b in problem.blocks]
    assert len(lasts) >= min(FEWEST_BLOCKS, sum(lasts) // (2 * FEWEST_PERIODS / problem.edge))
    shared = [block.stretch for block in problem.blocks]
    assert all(seconds >= 0.9 * FEWEST_PERIODS / problem.edge or shared.count(s) == 1 for s, seconds in zip(shared, lasts, strict=True))


def logged(rate, noise=0.0):
    """The same motions and torques logged at `rate`."""
    return Campaign.of(ARM, [recording(ARM, planted(ARM), f"run{k}", seed=k + 1, rate=rate, seconds=8.0, noise=noise) for k in range(3)])


@pytest.mark.parametrize("rate", [50.0, 1000.0])
def test_rows_do_not_depend_on_the_sampling_rate(rate):
    def excess(at):
        problem = problem_of(logged(at), edge=2.0)
        design = design_of(problem, baseline_of("rigid", ARM, problem.units(), Preparation(LowPass(2.0))))
        return design.scale, (design.tau**2).sum() / design.duration, (design.excess**2).sum() / design.duration, len(problem.blocks)

    for got, want in zip(excess(rate), excess(100.0), strict=True):
        assert got == pytest.approx(want, rel=0.03)


@pytest.mark.parametrize("edge", [1.0, 2.0, 3.0])
def test_what_has_a_frequency_is_tried_within_the_band_alone(edge):
    problem = problem_of(WHOLE, edge=edge)
    design = design_of(problem, baseline_of("constant", ARM, problem.units(), Preparation(LowPass(edge))))
    tried = [h.effect.frequency[0] for h in hypotheses_for(design) if "frequency" in h.spans]
    assert tried
    assert max(tried) < edge
    longest = max(np.ptp(stretch.segment.t) for stretch in problem.stretches if not stretch.segment.steady)
    waves = [h.effect.frequency[0] for h in hypotheses_for(design) if "frequency" in h.spans and h.per_recording]
    assert min(waves, default=edge) >= WAVE_PERIODS / longest, "with a phase of its own, less than two periods fit any drift"


def test_steady_tables_are_rows_as_they_are_and_may_be_all_there_is():
    table = steady_table(ARM, planted(ARM))
    problem = problem_of(Campaign.of(ARM, [], (table,)))
    (block,) = problem.blocks
    assert block.steady
    assert (problem.frequency == -1).all()
    np.testing.assert_array_equal(problem.transform(block, np.asarray(table.tau)), table.tau)
    np.testing.assert_array_equal(problem.inverse(block, np.asarray(table.tau)), table.tau)


def test_places_follow_the_clock_and_are_unknown_without_one():
    def clocked(starts):
        return Campaign.of(ARM, [replace(r, clock=start + np.asarray(r.t)) for r, start in zip(WHOLE.recordings(), starts, strict=True)])

    first, second, third, last = problem_of(clocked([100.0, 400.0, 300.0, 700.0]), edge=3.0).stretches
    assert first.place[0] == pytest.approx(-1, abs=0.01)
    assert last.place[-1] == pytest.approx(1, abs=0.01)
    assert third.place[0] < second.place[0], "the clock counts, not the name"
    assert all(s.place is None for s in PROBLEM.stretches), "the order of files is not time"


def test_recordings_too_short_to_tell_anything_are_refused_with_what_to_do():
    short = Campaign.of(ARM, [recording(ARM, planted(ARM), f"run{k}", seconds=0.05) for k in range(3)])
    with pytest.raises(CampaignError, match=r"record longer runs|nnhydro check"):
        _ = problem_of(short, edge=30.0).blocks
    with pytest.raises(ConfigError, match="less than one period"):
        problem_of(short, edge=3.0)


def test_of_a_large_campaign_recordings_are_drawn_from_every_stretch_of_it():
    names = tuple(f"{k:04d}" for k in range(1000))
    assert [int(name) // 20 for name in draw_names(names, 50, 0)] == list(range(50))
    assert draw_names(names, 50, 0) == draw_names(names, 50, 0) != draw_names(names, 50, 1)
    assert draw_names(names, 2000, 0) == names


def test_angles_alone_give_rows_close_to_those_of_recorded_derivatives():
    whole = campaign(ARM, planted(ARM), count=3, seconds=6.0)
    alone = Campaign.of(ARM, [angles_only(r) for r in whole.recordings()])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = [problem_of(recorded, edge=3.0) for recorded in (whole, alone)]
    for one, other in zip(*(p.stretches for p in made), strict=True):
        keep = one.segment.keep
        np.testing.assert_allclose(other.segment.qdd[keep], one.segment.qdd[keep], atol=0.01 * np.abs(one.segment.qdd).max())


def test_rates_that_a_logger_computed_from_the_angles_are_as_good_as_none():
    """Backward differences are half a sample late; the angles say the same in time."""
    bare = [angles_only(WHOLE.load(name)) for name in WHOLE.names]
    step = float(bare[0].t[1] - bare[0].t[0])
    logged = [replace(r, qd=np.diff(r.q, axis=0, prepend=r.q[:1]) / step) for r in bare]
    without, late = (problem_of(Campaign.of(ARM, recordings)) for recordings in (bare, logged))
    assert late.left_out.rates_lag == pytest.approx(0.5 * step, rel=0.05)
    assert without.left_out == PROBLEM.left_out == LeftOut()
    assert late.band == without.band
    for stretch, bare_one in zip(late.stretches, without.stretches, strict=True):
        np.testing.assert_array_equal(stretch.segment.qdd, bare_one.segment.qdd)


def test_what_was_found_to_be_computed_is_left_out_in_another_band_without_a_second_look():
    given_ones = [recording(arm(2), planted(arm(2)), f"run{k}", seed=k + 1) for k in range(2)]
    whole = Campaign.of(arm(2), given_ones)
    bare = Campaign.of(arm(2), [replace(r, qd=None, qdd=None) for r in given_ones])
    left_out = LeftOut(smoothed=True)
    told, want, plain = problem_of(whole, edge=4.0, left_out=left_out), problem_of(bare, edge=4.0), problem_of(whole, edge=4.0)
    assert told.left_out == left_out
    for a, b, c in zip(told.stretches, want.stretches, plain.stretches, strict=True):
        np.testing.assert_array_equal(a.segment.qd, b.segment.qd)
        assert not np.array_equal(a.segment.qd, c.segment.qd)
