"""Motions that a rig can do: its limits from its recordings, and what is drawn within them."""

from types import SimpleNamespace

import numpy as np
import pytest
from rigs import arm

from nnhydro.diagnosis.experiment.motions import _carriage, _feasible_motion, _fourier, _perturb, _slew, _tow, draw, neighbours
from nnhydro.diagnosis.experiment.rig_limits import Rig
from nnhydro.simulation.motions.motion_kind import State

RIG = Rig(np.array([[-1.0, 2.0], [0.5, 1.0]]), np.array([1.5, 0.8]), np.array([6.0, 4.0]), 0.5, np.array([9.0, 3.0]), 10.0)
STILL = Rig(RIG.q, RIG.rate, RIG.acceleration, 0.0, RIG.tau, 10.0)
MANY = 400


def rngs(count=MANY):
    return (np.random.default_rng(seed) for seed in range(count))


def segment(rows=100, steady=False, keep=None, dt=0.1, scale=1.0, tau=True):
    rng = np.random.default_rng(rows)
    x = scale * rng.standard_normal((3, rows, 2))
    kept = np.ones(rows, dtype=bool) if keep is None else keep
    return SimpleNamespace(q=x[0], qd=x[1], qdd=x[2], u0=scale * rng.standard_normal(rows), tau=5 * x[0] if tau else None,
                           t=3.0 + dt * np.arange(rows), steady=steady, keep=kept)


def test_a_rigs_limits_are_those_that_its_moving_recordings_stayed_in_where_they_are_compared():
    parts = [segment(100), segment(140), segment(90, tau=False), segment(80, steady=True, scale=50.0)]
    parts[1].keep[5] = False
    for x in (parts[1].q, parts[1].qd, parts[1].qdd, parts[1].tau):
        x[5] = 1e3
    rig = Rig.of(parts)
    q, qd, qdd = (np.concatenate([getattr(p, name)[p.keep] for p in parts[:3]]) for name in ("q", "qd", "qdd"))
    np.testing.assert_array_equal(rig.q, np.stack([q.min(axis=0), q.max(axis=0)], axis=1))
    np.testing.assert_array_equal(rig.rate, np.abs(qd).max(axis=0))
    np.testing.assert_array_equal(rig.acceleration, np.abs(qdd).max(axis=0))
    np.testing.assert_allclose(rig.tau, 1.1 * np.abs(np.concatenate([p.tau[p.keep] for p in parts[:2]])).max(axis=0))
    assert rig.u0 == max(np.abs(p.u0).max() for p in parts[:3])
    assert rig.seconds == pytest.approx(9.9)  # the median of 9.9, 13.9 and 8.9 s


def test_no_motion_of_more_than_a_minute_is_proposed_and_parts_without_rows_do_not_count():
    assert Rig.of([segment(100, dt=1.0)]).seconds == 60.0
    empty = segment(300, keep=np.zeros(300, dtype=bool), scale=9.0)
    assert Rig.of([segment(100), empty]).rate == pytest.approx(Rig.of([segment(100)]).rate)


def state(q=(0.0, 0.7), qd=(0.0, 0.0), qdd=(0.0, 0.0), u0=0.0):
    return State(*(np.array([x]) for x in (q, qd, qdd)), np.array([u0]), np.array([0.0]))


@pytest.mark.parametrize(("fields", "within"), [
    ({}, True), ({"q": (2.0, 1.0)}, True), ({"q": (-1.0, 0.5)}, True), ({"q": (2.001, 0.7)}, False), ({"q": (-1.001, 0.7)}, False),
    ({"q": (0.0, 0.499)}, False), ({"qd": (1.5, -0.8)}, True), ({"qd": (1.501, 0.0)}, False), ({"qd": (0.0, -0.801)}, False),
    ({"qdd": (-6.0, 4.0)}, True), ({"qdd": (0.0, 4.01)}, False), ({"u0": -0.5}, True), ({"u0": 0.51}, False),
])
def test_a_rig_allows_what_stays_within_every_limit(fields, within):
    assert RIG.allows(state(**fields)) == within


def test_slews_go_between_postures_of_the_range_in_two_to_five_legs():
    made = [_slew(RIG, rng) for rng in rngs()]
    stops = [np.array(motion["q_rad"]) for motion in made]
    assert {len(q) - 1 for q in stops} == {2, 3, 4, 5}
    every = np.concatenate(stops)
    assert (every >= RIG.q[:, 0]).all()
    assert (every <= RIG.q[:, 1]).all()
    np.testing.assert_allclose(every.min(axis=0), RIG.q[:, 0], atol=0.05)
    np.testing.assert_allclose(every.max(axis=0), RIG.q[:, 1], atol=0.05)
    assert {motion["pause_s"] for motion in made} == {0.0, 0.5}
    assert {len(motion["duration_s"]) for motion in made} == {2, 3, 4, 5}


def test_one_slew_in_two_moves_one_joint_alone_either_of_them():
    moved = [np.ptp(np.array(_slew(RIG, rng)["q_rad"]), axis=0) > 0 for rng in rngs()]
    both = np.mean([m.all() for m in moved])
    assert 0.4 < both < 0.6
    assert all(m.any() for m in moved)
    assert 0.18 < np.mean([m.tolist() == [True, False] for m in moved]) < 0.32


def test_a_slew_takes_from_a_twentieth_to_four_times_longer_than_the_quickest_that_the_limits_allow():
    shares = []
    for rng in rngs():
        made = _slew(RIG, rng)
        way = np.abs(np.diff(np.array(made["q_rad"]), axis=0))
        quick = np.maximum(15 / 8 * way / RIG.rate, np.sqrt(10 / np.sqrt(3) * way / RIG.acceleration)).max(axis=1)
        share = (np.array(made["duration_s"]) - 0.05) / quick
        assert np.ptp(share) < 1e-3 * share[0], "all legs alike"
        shares.append(share[0])
    assert 1.049 < min(shares) < 1.1
    assert 3.9 < max(shares) < 4.001


def test_every_slew_drawn_can_be_done_and_is_proposed_up_to_twice_the_usual_time():
    done = []
    for rng in rngs(60):
        document = _slew(STILL, rng)
        seconds = sum(document["duration_s"]) + document["pause_s"] * (len(document["duration_s"]) + 1)
        made = _feasible_motion(document, STILL, arm(2), 50.0)
        done.append(made is not None)
        assert made is None or made.t[-1] <= 20.0
        assert made is not None or seconds > 19.0
    assert any(done)
    assert not all(done)


def sines(rig, rng):
    made = _fourier(rig, rng)
    return made, np.array(made["amplitude_rad"]), 2 * np.pi * np.array(made["frequency_hz"])


def test_sums_of_sines_last_as_long_as_the_recordings_and_fade_in_within_a_second_or_a_quarter():
    for seconds, fade in ((2.0, 0.5), (4.0, 1.0), (10.0, 1.0)):
        rig = Rig(RIG.q, RIG.rate, RIG.acceleration, 0.0, RIG.tau, seconds)
        made = _fourier(rig, np.random.default_rng(1))
        assert (made["duration_s"], made["fade_s"]) == (seconds, fade)
        assert np.array(made["amplitude_rad"]).shape == (2, 3)


def test_frequencies_run_from_one_and_a_half_periods_a_recording_to_one_and_a_half_hertz():
    f = np.array([_fourier(RIG, rng)["frequency_hz"] for rng in rngs()]).ravel()
    assert 0.15 <= f.min() < 0.16
    assert 1.45 < f.max() <= 1.5
    assert np.median(f) == pytest.approx(np.sqrt(0.15 * 1.5), rel=0.1), "as many in every octave"


def test_sums_of_sines_stay_in_the_range_and_come_near_to_one_of_the_limits():
    used, alone = [], 0
    for rng in rngs():
        made, a, w = sines(RIG, rng)
        centre = np.array(made["q_rad"])
        assert (np.abs(centre - RIG.q.mean(axis=1)) <= 0.3 * np.ptp(RIG.q, axis=1) + 1e-12).all()
        most = np.minimum(RIG.q[:, 1] - centre, centre - RIG.q[:, 0])
        rate, acc = (a * (w + 2)).sum(axis=1), (a * (w**2 + 4 * w + 6)).sum(axis=1)  # with the second's fade: worst of a sum of products
        share = np.maximum.reduce([a.sum(axis=1) / most, rate / RIG.rate, acc / RIG.acceleration])
        assert share.min() / share.max() == pytest.approx(1.0, rel=1e-9) or share.min() / share.max() == pytest.approx(0.02, rel=1e-9)
        alone += share.min() < 0.5 * share.max()
        used.append(share.max())
    assert 0.33 < alone / MANY < 0.47, "in two of five, one joint moves nearly alone"
    assert 0.3 <= min(used) < 0.32
    assert 0.97 < max(used) <= 1.0 + 1e-9


def test_centres_lie_about_the_middle_of_the_range_and_phases_all_around():
    made = [_fourier(RIG, rng) for rng in rngs()]
    off = (np.array([motion["q_rad"] for motion in made]) - RIG.q.mean(axis=1)) / np.ptp(RIG.q, axis=1)
    assert off.min() < -0.28
    assert off.max() > 0.28
    phase = np.array([motion["phase_rad"] for motion in made]).ravel()
    assert (phase.min(), phase.max()) == pytest.approx((0.0, 2 * np.pi), abs=0.02)


def test_amplitudes_of_one_speed_differ_by_up_to_five():
    ratios = []
    for rng in rngs():
        _, a, w = sines(RIG, rng)
        speed = a * w
        ratios += (speed.max(axis=1) / speed.min(axis=1)).tolist()
    assert max(ratios) <= 5.0 + 1e-9
    assert max(ratios) > 4.0


def test_a_carriage_that_has_moved_tows_every_other_motion_either_way_within_its_speed():
    made = [_carriage(RIG, rng) for rng in rngs()]
    towed = [motion["carriage"] for motion in made if motion]
    assert 0.4 < len(towed) / MANY < 0.6
    speed = np.array([motion["u0_m_s"] for motion in towed])
    assert 0.15 <= np.abs(speed).min() < 0.17
    assert 0.48 < np.abs(speed).max() <= 0.5
    assert 0.35 < (speed > 0).mean() < 0.65
    assert all(motion["start_s"] == 0.1 for motion in towed)
    assert all(_carriage(STILL, rng) == {} for rng in rngs(20))


def test_tows_hold_a_posture_of_the_range_at_a_speed_that_the_carriage_has_shown():
    made = [_tow(RIG, rng) for rng in rngs()]
    q, u0 = np.array([motion["q_rad"] for motion in made]), np.array([motion["carriage"]["u0_m_s"] for motion in made])
    ramp, hold = np.array([motion["carriage"]["ramp_s"] for motion in made]), np.array([motion["hold_s"] for motion in made])
    np.testing.assert_allclose([q.min(axis=0), q.max(axis=0)], RIG.q.T, atol=0.02)
    assert 0.15 <= np.abs(u0).min() < 0.16
    assert 0.49 < np.abs(u0).max() <= 0.5
    assert 0.4 < (u0 > 0).mean() < 0.6
    assert (ramp.min(), ramp.max()) == pytest.approx((0.3, 1.5), abs=0.02)
    np.testing.assert_allclose(hold + 2 * ramp + 0.2, 10.0)
    short = Rig(RIG.q, RIG.rate, RIG.acceleration, 0.5, RIG.tau, 1.5)
    assert _tow(short, np.random.default_rng(1))["hold_s"] == 1.0


def test_a_motion_in_the_neighbourhood_differs_by_about_the_share_and_keeps_what_is_no_number():
    document = {"kind": "fourier", "name": "n", "fade_s": 1.0, "legs": 3, "a": [1.0, [2.0, -4.0]], "carriage": {"u0_m_s": 0.5}}
    moved = [_perturb(document, 0.2, rng) for rng in rngs()]
    assert all((motion["kind"], motion["name"], motion["fade_s"], motion["legs"]) == ("fourier", "n", 1.0, 3) for motion in moved)
    for pick, base in ((lambda d: d["a"][0], 1.0), (lambda d: d["a"][1][1], -4.0), (lambda d: d["carriage"]["u0_m_s"], 0.5)):
        log = np.log([pick(motion) / base for motion in moved])
        assert log.mean() == pytest.approx(0.0, abs=0.04)
        assert log.std() == pytest.approx(0.2, rel=0.12)
    assert _perturb(document, 0.0, np.random.default_rng(1)) == document


def test_a_document_becomes_a_motion_where_the_rig_can_do_it_and_it_is_long_enough():
    slow = {"kind": "slew", "q_rad": [[0.0, 0.6], [0.5, 0.9]], "duration_s": [2.0], "pause_s": 0.0}
    made = _feasible_motion(slow, RIG, arm(2), 50.0)
    assert made is not None
    assert made.document == slow
    assert len(made.t) == len(made.state.q)
    assert np.diff(made.t) == pytest.approx(0.02)
    assert _feasible_motion({**slow, "duration_s": [0.3]}, RIG, arm(2), 50.0) is None
    assert _feasible_motion({**slow, "duration_s": [-1.0]}, RIG, arm(2), 50.0) is None
    steps = int(np.ceil(made.t[-1] * 9))
    assert (_feasible_motion(slow, RIG, arm(2), 9.0) is None) == (steps + 1 < 20)


def test_as_many_motions_are_drawn_as_asked_for_of_every_kind_in_turn():
    found = draw(RIG, arm(2), 50.0, 12, np.random.default_rng(1))
    assert len(found) == 12
    assert {motion.document["kind"] for motion in found} == {"slew", "fourier", "tow"}
    assert any("carriage" in motion.document for motion in found if motion.document["kind"] != "tow")
    assert {motion.document["kind"] for motion in draw(STILL, arm(2), 50.0, 12, np.random.default_rng(1))} == {"slew", "fourier"}
    assert not any("carriage" in motion.document for motion in draw(STILL, arm(2), 50.0, 12, np.random.default_rng(1)))
    frozen = Rig(RIG.q, 0 * RIG.rate + 1e-9, 0 * RIG.acceleration + 1e-9, 0.0, RIG.tau, 10.0)
    assert len(draw(frozen, arm(2), 50.0, 3, np.random.default_rng(1))) <= 3


def test_variations_come_from_the_best_in_turn_and_are_no_more_than_asked_for():
    best = draw(STILL, arm(2), 50.0, 2, np.random.default_rng(1))
    found = neighbours(best, STILL, arm(2), 50.0, 6, np.random.default_rng(2))
    assert 0 < len(found) <= 6
    assert {motion.document["kind"] for motion in found} == {"slew", "fourier"}
    assert all(motion.document != two.document for motion in found for two in best)


def test_a_proposed_motion_is_a_stretch_without_torque_and_a_file_of_its_columns():
    made = next(motion for motion in draw(RIG, arm(2), 50.0, 12, np.random.default_rng(1)) if "carriage" in motion.document)
    whole, coarse = made.segment("next", 50.0), made.segment("next", 20.0)
    np.testing.assert_array_equal(whole.q, made.state.q)
    np.testing.assert_array_equal(coarse.u0, made.state.u0[::2])
    assert coarse.dt == pytest.approx(0.04), "at 25 Hz: not below what was asked for"
    assert made.segment("next", 1000.0).dt == pytest.approx(0.02)
    assert (whole.tau == 0).all()
    columns = made.columns(arm(2))
    assert list(columns) == ["t_s", "q1_rad", "q2_rad", "dq1_rad_s", "dq2_rad_s", "ddq1_rad_s2", "ddq2_rad_s2", "u0_m_s", "du0_m_s2"]
    np.testing.assert_array_equal(columns["dq2_rad_s"], made.state.qd[:, 1])
    still = draw(STILL, arm(2), 50.0, 1, np.random.default_rng(1))[0]
    assert "u0_m_s" not in still.columns(arm(2))
    assert still.segment("next", 50.0).stop_row == len(still.t)


def test_a_proposed_motion_stays_within_the_rig_and_uses_it():
    found = draw(RIG, arm(2), 50.0, 24, np.random.default_rng(3))
    assert len(found) == 24
    assert all(RIG.allows(motion.state) for motion in found)
    states = [motion.state for motion in found]
    used = [max((np.abs(s.qd) / RIG.rate).max(), (np.abs(s.qdd) / RIG.acceleration).max(), np.abs(s.u0).max() / RIG.u0) for s in states]
    assert np.mean(np.array(used) > 0.25) > 0.4, "motions far below what the rig can do show nothing"


def test_sums_of_sines_of_a_rig_that_moves_for_less_than_a_second_have_a_period_in_that_time():
    """At 1.5 Hz, the usual highest frequency, 0.4 s hold less than one."""
    short = Rig(RIG.q, RIG.rate, RIG.acceleration, 0.0, RIG.tau, 0.4)
    frequencies = np.array([_fourier(short, np.random.default_rng(seed))["frequency_hz"] for seed in range(20)])
    assert frequencies.min() * 0.4 >= 1.5 * (1 - 1e-9)
    assert frequencies.max() * 0.4 <= 3.0 * (1 + 1e-9)
