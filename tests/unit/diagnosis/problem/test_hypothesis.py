"""Hypotheses: every effect at every joint that makes sense, values on a grid, finer ones half-way, instruments about their values."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import planted, recording
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import arm

from nnhydro.diagnosis.problem.activity import ActivityWindow, Sector
from nnhydro.diagnosis.problem.hypothesis import Hypothesis, _half_way, enumerate_hypotheses, grid_neighbours, refine_grid
from nnhydro.diagnosis.problem.motion_range import MotionRange
from nnhydro.effects.catalogue import catalogue, effect_of_id
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor

PEAKS = (5.0, 2.0)


@pytest.mark.parametrize(("values", "value", "span"), [
    ((1.0, 2.0, 4.0), 2.0, (1.0, 4.0)), ((1.0, 2.0, 4.0), 1.0, (0.5, 2.0)), ((1.0, 2.0, 4.0), 4.0, (2.0, 8.0)),
    ((-1.0, 0.0, 2.0), 0.0, (-1.0, 2.0)), ((-1.0, 0.0, 2.0), -1.0, (-2.0, 0.0)), ((-1.0, 0.0, 2.0), 2.0, (0.0, 4.0)),
    ((3.0,), 3.0, (3.0, 3.0)),
])
def test_the_search_reaches_to_the_neighbours_and_as_far_beyond_an_end(values, value, span):
    assert grid_neighbours(values, value) == pytest.approx(span)


@pytest.mark.parametrize(("effect", "activity", "differs"), [
    ("coulomb_friction", None, False), ("wave_orbital", None, True), ("coulomb_friction", ActivityWindow(("run0",)), True),
    ("coulomb_friction", ActivityWindow(sector=Sector(1, 0.0, 1.0)), False)])
def test_recordings_are_told_apart_by_values_of_their_own_or_by_acting_in_some_only(effect, activity, differs):
    found = next(h for h in enumerate_hypotheses(arm(2), PEAKS) if h.key[0] == effect)
    assert replace(found, activity=activity).differs_between_recordings is differs


@pytest.mark.parametrize(("driven", "reverses", "tried"), [
    (True, (True, True), {1, 2}), (True, (True, False), {1}), (False, (True, True), set())])
def test_friction_that_differs_between_the_directions_is_tried_where_a_driven_joint_turns_both_ways(driven, reverses, tried):
    """One way only it is the same as a larger friction, and on a body that swings freely as another zero of its angle."""
    laws = enumerate_hypotheses(arm(2), PEAKS, driven=driven, motion=MotionRange(reverses=reverses))
    assert {h.key[1] for h in laws if h.key[0] == "viscous_friction" and any(h.effect.asymmetry)} == tried
    assert {h.key[1] for h in laws if h.key[0] == "viscous_friction"} == {1, 2}


NUMBERS = st.lists(st.floats(-100, 100, allow_subnormal=False).map(lambda x: round(x, 3)), min_size=1, max_size=8, unique=True)


@given(NUMBERS, st.integers(0, 7))
def test_neighbours_hold_their_value_between_them_whatever_the_grid(values, at):
    value = sorted(values)[at % len(values)]
    low, high = grid_neighbours(values, value)
    assert low <= value <= high
    assert (low < high) == (len(values) > 1)


def test_between_two_values_lies_their_geometric_mean_where_both_are_positive_else_their_mean():
    assert _half_way(1.0, 4.0) == pytest.approx(2.0)
    assert _half_way(-1.0, 4.0) == pytest.approx(1.5)
    assert _half_way(0.0, 4.0) == pytest.approx(2.0)


def test_every_hypothesis_stands_between_its_neighbours_and_counts_the_values_tried():
    made = enumerate_hypotheses(arm(2), PEAKS)
    for hypothesis in made:
        assert hypothesis.width == len(hypothesis.bounds) == len(hypothesis.effect.linear_names()) + hypothesis.effect.random_intercept
        for name, (low, high) in hypothesis.spans.items():
            value = getattr(hypothesis.effect, name)[0]
            assert low <= value <= high
    free = {id_ for id_, effect in catalogue().items() if not effect.driven}
    assert {hypothesis.key[0] for hypothesis in made} == set(catalogue()) - free
    assert {hypothesis.key[0] for hypothesis in enumerate_hypotheses(arm(2), PEAKS, driven=False)} >= free != set()
    assert {hypothesis.key[1] for hypothesis in made} <= {0, 1, 2}


def test_a_ripple_is_tried_where_it_comes_again_within_the_range_of_the_angles():
    """In a quarter of a turn, eight periods a turn come twice, seven do not."""
    turned = MotionRange(angles=(1.001 * np.pi / 2,))
    laws = [h.effect for h in enumerate_hypotheses(arm(1), (5.0,), motion=turned) if h.key[0] == "torque_ripple"]
    assert min(law.periods[0] for law in laws) == 8.0


def test_a_joint_that_moves_little_and_slowly_bends_less_and_loses_its_grip_at_lower_rates():
    def tried(**of):
        """Bendings and speeds of Stribeck's law that are tried."""
        laws = [h.effect for h in enumerate_hypotheses(arm(1), (5.0,), motion=MotionRange(**of)) if h.key[0] == "stribeck_friction"]
        return [np.array(sorted({law.bending[0] for law in laws if law.bending} - {0.0})), np.array(sorted({law.speed[0] for law in laws}))]

    usual, slow, fast = tried(), tried(angles=(0.1,), rates=(0.05,)), tried(angles=(3.0,), rates=(2.0,))
    for a, b, c in zip(usual, slow, fast, strict=True):
        np.testing.assert_allclose(b, 0.1 * a)
        np.testing.assert_array_equal(c, a)


def test_drag_over_the_reynolds_number_is_written_about_the_mean_of_those_in_the_campaign():
    motion = MotionRange(reynolds=(40.0, 4000.0))
    laws = [h.effect for h in enumerate_hypotheses(arm(1), (5.0,), motion=motion) if h.key[0] == "reynolds_drag"]
    assert {(law.lowest, law.highest) for law in laws} == {(40.0, 4000.0)}
    assert "about 400 it changes" in laws[0].statement()


@pytest.mark.parametrize(("slowest", "speeds"), [(0.0, 5), (0.3, 3), (10.0, 0)])
def test_a_grip_that_is_lost_below_the_slowest_row_is_not_tried(slowest, speeds):
    motion = MotionRange(slowest=(slowest,))
    laws = [h.effect for h in enumerate_hypotheses(arm(1), (5.0,), motion=motion) if h.key[0] == "stribeck_friction"]
    tried = sorted({law.speed[0] for law in laws})
    assert len(tried) == speeds
    assert all(2 * speed >= slowest for speed in tried)


@pytest.mark.parametrize("left_out", ["torque_bias", "coulomb_friction"])
def test_an_effect_that_is_taken_out_of_the_catalogue_is_no_hypothesis(left_out):
    whole, part = (enumerate_hypotheses(arm(2), PEAKS, without) for without in ((), (left_out,)))
    assert {hypothesis.key[0] for hypothesis in whole} - {hypothesis.key[0] for hypothesis in part} == {left_out}


def test_where_nothing_is_driven_no_effect_of_a_drive_or_its_sensor_is_tried():
    free = {hypothesis.key[0] for hypothesis in enumerate_hypotheses(arm(1), (0.0,), driven=False)}
    assert {"viscous_friction", "coulomb_friction", "added_mass"} <= free
    assert not {"torque_bias", "torque_gain", "torque_drift", "sensor_timing", "torque_saturation", "backlash"} & free


def test_finer_values_stay_within_what_physics_allows_and_narrow_around_themselves():
    effect = effect_of_id("stribeck_friction").at_start(arm(2), joint=1)
    low, high = next(f.metadata["bounds"] for f in effect.parameters() if f.name == "speed")
    hypothesis = Hypothesis(replace(effect, speed=(low,)), 5, {"speed": (low / 4, 4 * low)})
    same, above = refine_grid(hypothesis)
    assert same.effect is hypothesis.effect
    assert above.effect.speed[0] == pytest.approx(2 * low)
    assert above.spans["speed"] == pytest.approx((low * np.sqrt(2), low * np.sqrt(8)))
    top = Hypothesis(replace(effect, speed=(high,)), 5, {"speed": (high / 4, 4 * high)})
    assert [x.effect.speed[0] for x in refine_grid(top)] == pytest.approx([high, high / 2])
    still = Hypothesis(replace(effect, speed=(0.2,)), 1, {"speed": (0.2, 0.2)})
    assert len(refine_grid(still)) == 1


def test_refined_values_lie_half_way_and_close_in_on_the_best():
    effect = effect_of_id("stribeck_friction").at_start(arm(2), joint=1)
    hypothesis = Hypothesis(replace(effect, speed=(0.2,)), 5, {"speed": (0.1, 0.4)})
    best, *others = refine_grid(hypothesis)
    assert best.spans["speed"] == pytest.approx((0.1 * 2**0.5, 0.2 * 2**0.5))
    assert sorted(other.effect.speed[0] for other in others) == pytest.approx([0.1 * 2**0.5, 0.2 * 2**0.5])
    assert {refine_grid(other)[1].key for other in others} == {hypothesis.key}


@pytest.mark.parametrize("id_", catalogue())
def test_refined_values_of_every_effect_stay_within_its_bounds_and_can_be_made(id_):
    made = [hypothesis for hypothesis in enumerate_hypotheses(arm(2), PEAKS) if hypothesis.key[0] == id_]
    for hypothesis in made[:3] + made[-3:]:
        limits = {f.name: f.metadata["bounds"] for f in hypothesis.effect.parameters()}
        for finer in refine_grid(hypothesis):
            for name in finer.spans:
                low, high = limits[name]
                assert low <= getattr(finer.effect, name)[0] <= high


def test_loads_are_linear_as_they_are_and_instruments_have_their_columns_about_their_values():
    made = {hypothesis.key[0]: hypothesis for hypothesis in enumerate_hypotheses(arm(2), PEAKS)}
    load, bias = made["viscous_friction"], made["torque_bias"]
    values = {0: torch.full((bias.width,), 0.1)}
    assert load.linearised_at(values, "model") is load
    told = bias.linearised_at(values, "model")
    assert isinstance(told.effect, InstrumentEffect)
    assert told.working_model == "model"
    assert told.effect.linear_values()[0] == pytest.approx(0.1)


def test_an_instrument_with_values_of_each_recording_s_own_has_its_columns_about_them_there_alone():
    wave = next(h for h in enumerate_hypotheses(arm(2), PEAKS) if h.key[0] == "wave_orbital")
    told = wave.linearised_at({1: torch.tensor([0.1, -0.2])}, "model")
    assert told.effect_in(1).linear_values().tolist() == pytest.approx([0.1, -0.2])
    assert told.effect_in(0) is wave.effect


def _resemblance(one, other, flow):
    """The part of a law's torque that another one makes, 0 to 1."""
    X, Y = (h.effect.columns(flow).numpy().reshape(-1, h.width) for h in (one, other))
    u = X.sum(axis=1)
    left = u - Y @ np.linalg.lstsq(Y, u)[0]
    return 1 - float((left**2).sum() / (u**2).sum())


@pytest.mark.slow
@given(direction=st.floats(-np.pi, np.pi), depth=st.floats(0.15, 0.8))
@settings(max_examples=25)
def test_a_wall_in_any_direction_resembles_one_that_is_tried_at_first(direction, depth):
    two = arm(2)
    r = recording(two, planted(two), seed=3, seconds=12.0, rate=25.0)
    q = r.q + np.linspace(-2.5, 2.5, len(r))[:, None] * np.array([1.0, 0.0])
    flow = Flow(two, Motion(*(tensor(x) for x in (r.t, q, r.qd, r.qdd, 0 * r.t, 0 * r.t))))
    tried = [h for h in enumerate_hypotheses(two, (10.0, 4.0)) if h.key[0] == "wall_proximity"]
    true = replace(tried[0], effect=replace(tried[0].effect, direction=(direction,), depth=(depth,)))
    assert max(_resemblance(true, h, flow) for h in tried) > 0.75
