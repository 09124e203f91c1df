"""Faults of sensors and of time: closed forms, limits, and what their cards hold possible."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from hypotheses import made, of_time, view
from rigs import LINKS, arm, assert_close, run
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from nnhydro.diagnosis.corrected_model import _for_prediction
from nnhydro.effects.catalogue import candidates
from nnhydro.effects.effect import REGISTER, with_effects
from nnhydro.effects.hypotheses.backlash import Backlash
from nnhydro.effects.hypotheses.sensor_timing import first_order_lag, time_delay
from nnhydro.effects.sensor_view import SensorView
from nnhydro.models.baselines import baseline
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Base, Motion, tensor


def test_a_delay_of_a_sine_is_exact():
    t = np.linspace(0, 2, 401)
    seen = of_time(t, np.sin(12 * t))
    read = made("sensor_timing", arm(1), lag=(0.013,), low_pass=(0.0,)).apply(seen)[:, 0]
    inner = slice(10, -10)
    assert_close(read[inner], tensor(np.sin(12 * (t - 0.013)))[inner], rtol=1e-6, atol=2e-7)


def test_a_low_pass_of_a_sine_has_its_gain_and_phase():
    t = np.linspace(0, 6, 1201)
    out = first_order_lag(tensor(t), tensor(np.sin(9 * t))[:, None], 0.05)[:, 0]
    late = t > 1
    gain, phase = 1 / np.hypot(1, 0.45), np.arctan(0.45)
    assert_close(out[late], tensor(gain * np.sin(9 * t - phase))[late], rtol=1e-5, atol=1e-5)
    assert torch.equal(time_delay(tensor(t), out[:, None], 0.0)[:, 0], out)


def test_a_low_pass_begins_as_the_motion_does_and_not_as_the_noise_of_its_first_row():
    """Derivatives at one noisy row would begin it with 400 times the noise where the lag is 7 rows long."""
    t = np.linspace(0, 4, 401)
    x = 2.0 + 3.0 * t - 0.5 * t**2
    late = first_order_lag(tensor(t), tensor(x)[:, None], 0.075)[:, 0]
    assert_close(late, tensor(x - 0.075 * (3.0 - t) - 0.075**2), atol=1e-10)
    noisy = tensor(0.01 * np.random.default_rng(1).standard_normal((401, 1)))
    assert float(first_order_lag(tensor(t), noisy, 0.075).abs().max()) < 0.02


def test_a_long_lag_is_tried_from_where_it_is_and_not_of_tables():
    still = of_time(np.zeros(3), np.zeros(3))
    effect = made("sensor_timing", arm(1), low_pass=(1.0,))
    assert [start.lag[0] for start in effect.extra_starts(of_time(np.linspace(0, 1, 50), np.zeros(50)))] == [0.05]
    assert made("sensor_timing", arm(1), low_pass=(0.0,)).extra_starts(of_time(np.linspace(0, 1, 50), np.zeros(50))) == ()
    assert effect.extra_starts(replace(still, flow=replace(still.flow, motion=replace(still.motion, steady=True)))) == ()


def test_delay_and_low_pass_are_told_apart():
    q = made("sensor_timing", arm(1), lag=(0.03,), low_pass=(2 / 3,)).quantities()
    assert (q["delay"].value, q["low_pass"].value) == pytest.approx((0.01, 0.02))


def test_clipping_ends_at_its_level():
    t = np.linspace(0, 6, 301)
    read = made("torque_saturation", arm(1), 1, share=(1.0,), level=(0.7,)).apply(of_time(t, np.sin(3 * t)))[:, 0]
    assert_close(read, tensor(np.clip(np.sin(3 * t), -0.7, 0.7)))


def test_a_lag_is_that_of_its_taylor_series_and_angles_that_are_late_are_a_delay():
    t, lag = np.linspace(0, 6, 1201), 0.01
    seen, inner = of_time(t, np.sin(3 * t)), slice(300, -100)
    for share in (0.0, 0.5, 1.0):
        effect = made("sensor_timing", arm(1), lag=(lag,), low_pass=(share,))
        series = np.sin(3 * t) - lag * 3 * np.cos(3 * t) - (lag**2 + (share * lag) ** 2) / 2 * 9 * np.sin(3 * t)
        assert_close(effect.apply(seen)[inner, 0], tensor(series)[inner], rtol=0, atol=6 * (3 * lag) ** 3)
    late = made("sensor_timing", arm(1), lag=(-lag,), low_pass=(1.0,))
    assert late.split() == (-lag, 0.0)
    assert_close(late.apply(seen)[inner, 0], tensor(np.sin(3 * (t + lag)))[inner], rtol=1e-6, atol=1e-6)


def side(t, tau, impulse=0.1, settling=()):
    """The place of the link in a gap of 1 rad, rad."""
    return made("backlash", arm(1), 1, gap=(1.0,), impulse=(impulse,), settling=settling)._side(of_time(t, tau), tensor(tau)).numpy()


def test_a_link_crosses_the_gap_in_the_time_that_its_torque_takes_to_spend_the_impulse():
    t = np.arange(4001) * 0.001
    x = side(t, np.where(t < 2, 0.5, -0.5), impulse=0.2)
    assert x[1900] == pytest.approx(-0.5)
    assert x[-1] == pytest.approx(0.5)
    crossing = t[(np.abs(x) < 0.49) & (t > 1.5)]
    assert np.ptp(crossing) == pytest.approx(0.98 * 0.2 / 0.5, abs=0.04)


def test_the_link_follows_the_torque_that_was_measured_and_the_model_where_none_was():
    t = np.arange(2001) * 0.002
    gap, assumed, measured = made("backlash", arm(1), 1, gap=(0.02,), impulse=(0.05,)), np.sin(3 * t), np.sin(3 * t - 0.8)
    seen = of_time(t, assumed)
    known = replace(seen, measured=tensor(np.where(t < 3, measured, np.nan))[:, None])
    np.testing.assert_array_equal(gap._carried_torque(seen).numpy(), assumed)
    np.testing.assert_array_equal(gap._carried_torque(known).numpy(), np.where(t < 3, measured, assumed))
    a, motion = arm(2), run(2, 400)
    joints = made("backlash", a, 1, gap=(0.02,), impulse=(0.05,))
    view_of = view(a, motion)
    late = replace(view_of, measured=torch.roll(view_of.tau, 20, dims=0))
    same = replace(view_of, measured=view_of.tau)
    assert_close(joints.columns(same), joints.columns(view_of))
    assert float((joints.columns(late) - joints.columns(view_of)).abs().max()) > 0.1 * float(joints.columns(view_of).abs().max())
    small = replace(joints, gap=(1e-6,))
    assert_close(small.apply(late) - late.tau, joints.columns(late)[..., 0] * 1e-6, rtol=1e-2, atol=1e-9)


def test_the_tangent_of_a_wave_is_what_a_little_more_of_it_changes_and_grows_with_its_drag():
    a = arm(1)
    t = np.linspace(0, 4, 200)
    still = torch.zeros(len(t), 1, dtype=torch.float64)
    seen = view(a, Motion(tensor(t), still, still, still, still[:, 0], still[:, 0]))
    def of(cosine, sine):
        return made("wave_orbital", a, cosine=(cosine,), sine=(sine,), frequency=(0.5,), direction=(np.pi / 2,))
    wave, step = of(0.4, -0.2), 1e-3
    tangent = wave.tangent(seen)
    for k, more in enumerate((of(0.4 + step, -0.2), of(0.4, -0.2 + step))):
        assert_close((more.apply(seen) - wave.apply(seen)) / step, tangent[..., k], rtol=0, atol=0.01 * float(tangent.abs().max()))
    weak = of(1e-6, 0.0)
    assert_close(weak.tangent(seen), weak.columns(seen), rtol=0, atol=1e-2 * float(weak.columns(seen).abs().max()))
    assert float(tangent.abs().max()) > 1.1 * float(weak.tangent(seen).abs().max()), "its drag grows with its size"


def test_flanks_are_wound_by_half_the_gap_at_the_torque_I_over_2_T_and_quick_ones_are_rigid():
    t = np.arange(4001) * 0.001
    tau = np.where(t < 2, 0.8, -0.4)
    soft, stiff, rigid = (side(t, tau, 0.05, settling) for settling in ((0.05 / (2 * 0.4),), (1e-6,), (0.0,)))
    assert soft[1900] == pytest.approx(-0.5 * (1 + 0.8 / 0.4), rel=1e-3)
    assert soft[-1] == pytest.approx(0.5 * (1 + 0.4 / 0.4), rel=1e-3)
    np.testing.assert_allclose(stiff, rigid, atol=1e-3)
    np.testing.assert_array_equal(rigid, side(t, tau, 0.05))


@pytest.mark.parametrize(("impulse", "settling", "tried"), [(0.4, 0.25, 0.95), (0.12, 0.09, 0.8), (0.05, 0.02, 0.75), (1.0, 1.0, 0.9)])
def test_of_a_gap_whose_flanks_give_the_values_that_are_tried_hold_one_that_is_much_alike(impulse, settling, tried):
    t = np.arange(3001) * 0.002
    tau = np.sin(2 * np.pi * 0.7 * t) + 0.5 * np.sin(2 * np.pi * 1.9 * t + 1.0)
    true = side(t, tau, impulse, (settling,))
    grid = [effect for effect in candidates(REGISTER["backlash"], arm(1), (float(np.abs(tau).max()),)) if effect.settling]
    alike = [abs(np.corrcoef(np.diff(side(t, tau, effect.impulse[0], effect.settling), 2), np.diff(true, 2))[0, 1]) for effect in grid]
    rigid = [a for a, effect in zip(alike, grid, strict=True) if effect.settling[0] == 0]
    assert max(alike) > tried
    assert max(rigid) < max(alike) - 0.05, "rigid flanks are not"


def test_a_knock_does_not_carry_the_link_back_across_the_gap_that_it_comes_from():
    t = np.arange(4001) * 0.001
    swing = np.sin(np.pi * t)
    ring = 6.0 * np.exp(-((t - 1.1) / 0.02) ** 2) * np.sin(2 * np.pi * (t - 1.1) / 0.02)  # up and down: it carries nothing in all
    assert np.abs(side(t, swing + ring, 0.01) - side(t, swing, 0.01)).max() < 0.1
    assert np.abs(side(t, swing, 0.01)).max() == pytest.approx(0.5)


def test_a_gap_is_told_with_its_flanks_where_they_give_and_old_models_are_rigid():
    give = made("backlash", arm(2), 1, gap=(0.01,), impulse=(0.1,), settling=(0.2,))
    assert "flanks yield within 0.2 s" in give.statement()
    old = made("backlash", arm(2), 1, gap=(0.01,), impulse=(0.1,), settling=())
    assert "flanks" not in old.statement()


def test_a_clipping_that_seems_deeper_than_all_beyond_its_level_predicts_a_reading_that_stays_at_the_level():
    (low, high), = made("torque_saturation", arm(1), 1).linear_bounds()
    assert (low, high) == (0.0, pytest.approx(1.5)), "a clipped torque fits the model too low, and what exceeds the level with it"
    tau = np.linspace(-8.0, 8.0, 33)
    for share in (0.6, 1.0, 1.4):
        last = made("torque_saturation", arm(1), 1, share=(share,), level=(2.0,)).for_prediction(0.0)
        read = last.apply(of_time(np.arange(33) * 0.01, tau))[:, 0].numpy()
        assert (np.diff(read) >= -1e-12).all()
        assert read[-1] == pytest.approx(2.0 + (1 - min(share, 1.0)) * 6.0)


def test_a_corrected_model_holds_of_a_clipping_no_more_than_the_level():
    assert _for_prediction(SimpleNamespace(law=made("torque_saturation", arm(1), 1, share=(1.4,)), offset=0.0)).share == (1.0,)


def test_the_levels_of_clipping_are_shares_of_the_largest_torque():
    found = candidates(REGISTER["torque_saturation"], arm(2), (5.0, 2.0))
    assert {effect.level[0] for effect in found if effect.joint == 2} >= {2.0, 1.8}
    assert candidates(REGISTER["torque_saturation"], arm(2)) == ()


def test_an_encoder_offset_is_the_torque_at_another_angle():
    a, motion = arm(2), run(2)
    seen = view(a, motion)
    q = motion.q.clone()
    q[:, 1] -= 0.1
    assert_close(made("encoder_offset", a, 2, offset=(0.1,)).apply(seen), seen.torque_of(Flow(a, replace(motion, q=q))))


def test_crosstalk_gain_and_drift_in_closed_form():
    a = arm(2)
    seen = replace(view(a, run(2)), place=tensor(np.linspace(-1, 1, 60)))
    tau = seen.tau
    assert_close(made("torque_crosstalk", a, 1, leak=(0.1,)).apply(seen)[:, 0], tau[:, 0] + 0.1 * tau[:, 1])
    assert_close(made("torque_gain", a, 2, error=(0.1,)).apply(seen)[:, 1], 1.1 * tau[:, 1])
    drift = made("torque_drift", a, 2, trend=(0.05,))
    assert_close(drift.apply(seen)[:, 1] - tau[:, 1], 0.05 * seen.place)
    assert drift.quantities()["change"].value == pytest.approx(0.1)
    assert_close(drift.apply(replace(seen, place=None)), tau)


def test_the_force_along_a_link_that_turns_is_its_mass_times_the_centripetal_acceleration():
    a, q, qd = arm(1, density=0.0), np.array([[0.3], [1.0], [-0.4]]), np.array([[1.5], [-1.5], [0.0]])
    seen = view(a, Motion.at(q, qd, np.full((3, 1), 0.7)))
    pull = LINKS[0]["mass_kg"] * LINKS[0]["com_m"] * qd[:, 0] ** 2
    reading = made("force_crosstalk", a, 0, lever=(0.05,)).apply(seen)
    assert_close(reading[:, 0] - seen.tau[:, 0], tensor(-0.05 * pull))
    towed = view(a, Motion.at(q, 0 * qd, 0 * qd, du0=np.full(3, 0.2)))
    reading = made("force_crosstalk", a, 0, lever=(0.05,)).apply(towed)
    assert_close(reading[:, 0] - towed.tau[:, 0], tensor(0.05 * LINKS[0]["mass_kg"] * 0.2 * np.sin(q[:, 0])))


def test_a_lag_may_be_all_delay_or_all_low_pass():
    assert {effect.low_pass[0] for effect in candidates(REGISTER["sensor_timing"], arm(2), (5.0, 2.0))} == {0.0, 1.0}


def test_what_clips_softly_is_clipped_in_part_from_levels_below_the_one_that_is_named():
    """An amplifier that compresses bends far below its top: the card's other levels take most of what the named one leaves."""
    tau = np.sin(np.linspace(0, 6, 601))
    read, seen, card = tau / np.sqrt(1 + tau**2), of_time(np.arange(601.0), tau), REGISTER["torque_saturation"]

    def left(levels):
        X = torch.cat([made("torque_saturation", arm(1), 1, level=(x,)).columns(seen)[:, 0] for x in levels], dim=1).numpy()
        return np.linalg.norm(read - tau - X @ np.linalg.lstsq(X, read - tau, rcond=None)[0])

    named = min(card.grids()["level"]) * np.abs(read).max()
    assert left([named, *(times * named for times in card.spread["level"])]) < left([named]) / 3


def test_a_channel_that_clips_reads_no_more_than_its_level_whatever_its_gain_and_zero():
    a = arm(2)
    gain, bias = made("torque_gain", a, 1, error=(0.5,)), made("torque_bias", a, 1, offset=(0.3,))
    clipped = made("torque_saturation", a, 1, share=(1.0,), level=(0.7,))
    read = with_effects(view(a, run(2)), (clipped, bias, gain)).tau
    assert float(read[:, 0].max()) == pytest.approx(0.7)
    assert float(read[:, 0].abs().max()) <= 0.7 + 1e-12


def test_less_is_predicted_of_what_jumps_rings_clips_or_swirls_but_half_of_it_at_least():
    predictable_share = {id_: cls.predictable_share for id_, cls in REGISTER.items() if cls.predictable_share < 1}
    assert set(predictable_share) == {"backlash", "joint_elasticity", "torque_saturation", "wake_reentry"}
    assert all(value >= 0.5 for value in predictable_share.values())


@pytest.mark.parametrize(("id_", "name", "value", "may_be"), [
    ("sensor_timing", "lag", 0.1, True), ("sensor_timing", "lag", -0.1, True),  # angles may be the late ones
    ("torque_saturation", "share", 1.0, True), ("torque_saturation", "share", 0.3, True),
    ("torque_saturation", "share", -0.2, False),  # no amplifier reads more than there is, the larger the more
    ("torque_crosstalk", "leak", 0.3, True), ("torque_crosstalk", "leak", -0.3, True),  # either way round
    ("torque_crosstalk", "leak", 1.0, False), ("torque_crosstalk", "leak", -1.0, False),  # that channel reads the other joint
    ("torque_gain", "error", 0.5, True), ("torque_gain", "error", -0.5, True),  # another range of the amplifier
    ("torque_gain", "error", 1.0, False), ("torque_gain", "error", -1.0, False),  # such a channel reads nothing
    ("drag_form", "ends", -0.4, True), ("drag_form", "ends", 0.4, True),  # relief, or plates at the ends
])
def test_what_cannot_be_is_not_looked_for_and_what_can_be_is(id_, name, value, may_be):
    a = arm(2)
    effect = REGISTER[id_].at_start(a, joint=1 if REGISTER[id_].acts == "joint" else 0)
    for named, (low, high) in zip(effect.linear_names(), effect.linear_bounds(), strict=True):
        if named.startswith(name):
            assert (low <= value <= high) == may_be
    assert any(named.startswith(name) for named in effect.linear_names())


def test_the_search_for_a_backlash_begins_with_gaps_that_are_crossed_within_30_ms():
    """A torque P sin(2 pi f t) that changes its sign carries the link across with the impulse pi f P t^2."""
    assert min(Backlash.grids()["impulse"]) <= np.pi * 0.5 * 0.03**2


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, 0.7])
def test_a_mount_that_sways_obeys_its_equation_of_motion_and_the_arm_reads_its_hubs_motion(angle):
    a, motion = arm(2), run(2, 600)
    loads = baseline("constant").start(a)
    seen, d = SensorView.of(loads, Flow(a, motion)), np.array([np.cos(angle), np.sin(angle)])
    omega, zeta, mobility = 2 * np.pi * 1.7, 0.08, 0.02
    law = made("flexible_mount", a, mobility=(mobility,), carried=(0.0,), frequency=(1.7,), damping=(zeta,), direction=(angle,))
    push = -mobility * loads.hub_force(seen.flow).numpy() @ d
    spline = CubicSpline(motion.t.numpy(), push)
    start = [float(push[0]) / omega**2 - 2 * zeta * float(spline(0, 1)) / omega**3, float(spline(0, 1)) / omega**2]
    states = solve_ivp(lambda t, y: [y[1], spline(t) - omega**2 * y[0] - 2 * zeta * omega * y[1]], (0, float(motion.t[-1])), start,
                       t_eval=motion.t.numpy(), rtol=1e-9, atol=1e-12).y
    v, acceleration = states[1], push - omega**2 * states[0] - 2 * zeta * omega * states[1]
    none = torch.zeros_like(motion.u0)
    moved = replace(motion, u0=motion.u0 + d[1] * tensor(v), du0=motion.du0 + d[1] * tensor(acceleration),
                    base=Base(d[0] * tensor(v), d[0] * tensor(acceleration), none, none, none))
    expected = loads.torque(Flow(a, moved)) - seen.tau
    late = slice(100, None)  # the start rings by how the first row is taken
    assert_close(law.apply(seen)[late] - seen.tau[late], expected[late], rtol=0.0, atol=0.02 * float(expected.abs().max()))
    assert float(expected.abs().max()) > 0.01 * float(seen.tau.abs().max())


def test_a_hub_on_a_very_soft_mount_stands_still_while_the_carriage_shakes():
    """Far above the mount's frequency y'' = -a: the arm reads a hub that is towed evenly. Where no force is known, nothing sways."""
    a, t = arm(2), np.arange(1200) / 200.0
    still = np.zeros((len(t), 2))
    shaken = 0.5 * (1 - np.cos(12 * 2 * np.pi * t)) / (12 * 2 * np.pi)
    even, towed = (Motion(*map(tensor, (t, np.array([0.3, 0.5]) + still, still, still, u0, np.gradient(u0, t, edge_order=2))))
                   for u0 in (0 * t + shaken.mean(), shaken))
    loads = baseline("constant").start(a)
    seen = SensorView.of(loads, Flow(a, towed))
    law = made("flexible_mount", a, mobility=(0.0,), carried=(1.0,), frequency=(0.3,), damping=(0.05,), direction=(np.pi / 2,))
    late = slice(40, None)
    before, after = (float((reading - loads.torque(Flow(a, even)))[late].abs().max()) for reading in (seen.tau, law.apply(seen)))
    assert after < 0.1 * before
    assert_close(law.columns(replace(seen, hub_force_of=None)), torch.zeros(len(t), 2, 2, dtype=torch.float64))
