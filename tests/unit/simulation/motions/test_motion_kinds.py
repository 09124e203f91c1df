"""Motions of a recipe: at rest at both ends, derivatives that are derivatives, and clear refusals."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nnhydro.errors import ConfigError
from nnhydro.recordings.arm import parse_arm
from nnhydro.simulation.motions.motion_kind import Reference, Setting, TimedMotion, motion_kinds, motion_of
from nnhydro.simulation.motions.profiles import peak_acceleration, slew_shape

LINK = {"length_m": 0.5, "diameter_m": 0.06, "mass_kg": 1.2, "com_m": 0.25, "inertia_kg_m2": 0.025}
ARM = parse_arm({"fluid": {"density_kg_m3": 1000.0}, "links": [LINK, LINK]}, "arm")
ANGLE = st.floats(-3, 3)
PAIR = st.lists(ANGLE, min_size=2, max_size=2)
CARRIAGE = st.builds(lambda u0, ramp, profile: {"u0_m_s": u0, "ramp_s": ramp, "start_s": 0.1, "profile": profile},
                     st.floats(-1.2, 1.2), st.floats(0.05, 0.4), st.sampled_from(["trapezoid", "minimum_jerk"]))
SMOOTH = st.one_of(
    st.builds(lambda c, q, hold: {"kind": "tow", "q_rad": q, "hold_s": hold, "carriage": c}, CARRIAGE, PAIR, st.floats(0.5, 3)),
    st.builds(lambda c, stops, T, p, share, pause: {"kind": "slew", "q_rad": stops, "duration_s": T, "profile": p, "ramp_share": share,
                                                    "pause_s": pause, "carriage": c},
              CARRIAGE, st.lists(PAIR, min_size=2, max_size=4), st.floats(0.3, 2),
              st.sampled_from(["bang_bang", "trapezoid", "minimum_jerk"]), st.floats(0.1, 0.5), st.floats(0, 0.5)),
    st.builds(lambda c, q, w, hold, ramp, p: {"kind": "rotation", "q_rad": q, "dq_rad_s": w, "hold_s": hold, "ramp_s": ramp, "profile": p,
                                              "carriage": c},
              CARRIAGE, PAIR, PAIR, st.floats(0, 2), st.floats(0.1, 1), st.sampled_from(["trapezoid", "minimum_jerk"])),
    st.builds(lambda c, q, T, reach: {"kind": "fourier", "q_rad": q, "duration_s": T, "fade_s": T / 3, "reach_rad": reach,
                                      "rate_rad_s": 2.0, "carriage": c},
              CARRIAGE, PAIR, st.floats(1, 6), st.floats(0.1, 1.5)),
)


def reference(document: dict[str, Any], seed: int = 0, folder: Path = Path()) -> Reference:
    motion = motion_of({"name": "m", **document}, "recipe")
    assert isinstance(motion, TimedMotion)
    return motion.reference(Setting(ARM, np.random.default_rng(seed), folder))


@given(SMOOTH)
@settings(max_examples=60, deadline=None)
def test_every_motion_starts_and_ends_at_rest(document: dict[str, Any]) -> None:
    r = reference(document)
    ends = r.at(np.array([0.0, r.duration]))
    for channel in (ends.qd, ends.qdd, ends.u0):
        np.testing.assert_allclose(channel, 0.0, atol=1e-9)


@given(SMOOTH)
@settings(max_examples=60, deadline=None)
def test_rates_and_accelerations_are_the_derivatives_of_what_stands_before_them(document: dict[str, Any]) -> None:
    r = reference(document)
    t, h = np.linspace(0.0, r.duration, 4001), 1e-5
    before, now, after = (r.at(t + shift) for shift in (-h, 0.0, h))
    for low, high, slope in ((before.q, after.q, now.qd), (before.qd, after.qd, now.qdd), (before.u0[:, None], after.u0[:, None],
                                                                                            now.du0[:, None])):
        wrong = np.abs((high - low) / (2 * h) - slope).max(axis=1) > 1e-3 * (1 + np.abs(slope).max())
        assert wrong.mean() < 0.01  # differences straddle the corners of bang-bang and trapezoid


def test_a_slew_visits_its_stops_and_pauses_there() -> None:
    stops = [[0.0, 0.1], [1.0, -0.5], [0.3, 0.2]]
    r = reference({"kind": "slew", "q_rad": stops, "duration_s": [1.0, 2.0], "pause_s": 0.5, "rest_s": 0.25})
    assert r.duration == pytest.approx(0.25 + 1.0 + 0.5 + 2.0 + 0.25)
    paused = r.at(np.array([0.1, 1.26, 1.7, 3.9]))
    np.testing.assert_allclose(paused.q, [stops[0], stops[1], stops[1], stops[2]], atol=1e-12)
    np.testing.assert_allclose(paused.qd, 0.0, atol=1e-12)


@pytest.mark.parametrize("profile", ["bang_bang", "trapezoid", "minimum_jerk"])
def test_the_acceleration_asked_for_is_the_peak_of_the_slew(profile: str) -> None:
    r = reference({"kind": "slew", "q_rad": [[0, 0], [1.2, 0.3]], "acceleration_rad_s2": 4.0, "profile": profile})
    assert np.abs(r.at(np.linspace(0, r.duration, 20001)).qdd).max() == pytest.approx(4.0, rel=1e-4)


def test_a_bang_bang_slew_of_mclain_and_rock_has_the_published_acceleration() -> None:
    assert peak_acceleration("bang_bang", 0.5) * np.radians(30) / 0.4**2 == pytest.approx(13.09, abs=0.005)
    assert slew_shape("bang_bang", np.array([0.5]), 0.5)[1][0] * np.radians(30) / 0.4 == pytest.approx(2.62, abs=0.005)


def test_a_rotation_holds_its_rate_and_covers_the_way() -> None:
    r = reference({"kind": "rotation", "q_rad": [0.0, 1.0], "dq_rad_s": [0.8, -0.4], "hold_s": 2.0, "ramp_s": 0.5, "rest_s": 0.0})
    state = r.at(np.array([1.5, r.duration]))
    np.testing.assert_allclose(state.qd[0], [0.8, -0.4], atol=1e-12)
    np.testing.assert_allclose(state.q[1], [0.8 * 2.5, 1.0 - 0.4 * 2.5], atol=1e-12)


@given(st.integers(0, 2**32), st.floats(0.2, 2.0), st.floats(0.3, 3.0), st.floats(0.05, 1.0), st.floats(0.2, 3.0))
@settings(max_examples=40, deadline=None)
def test_drawn_sines_stay_within_reach_and_rate_and_touch_one(seed: int, reach: float, rate: float, low: float, width: float) -> None:
    r = reference({"kind": "fourier", "q_rad": [0.4, -0.2], "duration_s": 6.0, "band_hz": [low, low + width], "reach_rad": reach,
                   "rate_rad_s": rate}, seed)
    state = r.at(np.linspace(0, r.duration, 20001))
    share = np.stack([np.abs(state.q - [0.4, -0.2]).max(axis=0) / reach, np.abs(state.qd).max(axis=0) / rate])
    assert (share <= 1.0).all()
    np.testing.assert_allclose(share.max(axis=0), 1.0, atol=0.01)


def test_given_sines_are_the_sum_asked_for_between_the_fades() -> None:
    r = reference({"kind": "fourier", "q_rad": [0.1, 0.0], "duration_s": 6.0, "rest_s": 0.0, "frequency_hz": [0.5, 1.0],
                   "amplitude_rad": [[0.3, 0.1], [0.0, 0.2]], "phase_rad": [[0.0, 0.5], [0.0, 0.0]]})
    t = np.array([2.0, 3.3])
    first = 0.1 + 0.3 * np.sin(np.pi * t) + 0.1 * np.sin(2 * np.pi * t + 0.5)
    np.testing.assert_allclose(r.at(t).q, np.column_stack([first, 0.2 * np.sin(2 * np.pi * t)]), atol=1e-12)


def test_a_file_is_followed_with_its_own_carriage(tmp_path: Path) -> None:
    t = np.linspace(0, 4, 401)
    data = np.column_stack([t + 100.0, np.sin(t), 0.3 * np.cos(t), 0.2 * t])
    np.savetxt(tmp_path / "swing.csv", data, delimiter=",", header="t_s,q1_rad,q2_rad,u0_m_s", comments="")
    r = reference({"kind": "file", "file": "swing.csv"}, folder=tmp_path)
    at = np.linspace(0.5, 3.5, 50)
    state = r.at(at)
    np.testing.assert_allclose(state.q, np.column_stack([np.sin(at), 0.3 * np.cos(at)]), atol=1e-9)
    np.testing.assert_allclose(state.qdd, -state.q, atol=1e-5)
    np.testing.assert_allclose(state.du0, 0.2, atol=1e-9)
    with pytest.raises(ConfigError, match="u0_m_s of its own"):
        reference({"kind": "file", "file": "swing.csv", "carriage": {"u0_m_s": 0.3}, "rest_s": 2.0}, folder=tmp_path)
    data[200, 1] = np.nan
    np.savetxt(tmp_path / "gap.csv", data, delimiter=",", header="t_s,q1_rad,q2_rad,u0_m_s", comments="")
    with pytest.raises(ConfigError, match="gaps or empty values"):
        reference({"kind": "file", "file": "gap.csv"}, folder=tmp_path)


def test_a_steady_carriage_had_its_speed_before_the_recording() -> None:
    r = reference({"kind": "tow", "q_rad": [0, 0], "hold_s": 1.0, "carriage": {"u0_m_s": 0.7, "ramp_s": 0.0}})
    state = r.at(np.linspace(0, 1, 11))
    assert (state.u0 == 0.7).all()
    assert (state.du0 == 0.0).all()


@pytest.mark.parametrize(("document", "message"), [
    ({"kind": "sleuw"}, "'sleuw' is not a kind of motion: did you mean 'slew'\\? Known are file, fourier, rotation, slew, steady, tow"),
    ({"kind": "slew", "q_rad": [[0, 0], [1, 1]], "duration_s": 1, "pauze_s": 1}, "unknown key 'pauze_s': did you mean 'pause_s'"),
    ({"kind": "slew", "q_rad": [[0, 0], [1, 1]]}, "either duration_s or acceleration_rad_s2"),
    ({"kind": "slew", "q_rad": [[0, 0], [1]], "duration_s": 1}, "1 numbers for an arm of 2 joint"),
    ({"kind": "slew", "q_rad": [[0, 0], [0, 0]], "acceleration_rad_s2": 1}, "two stops in a row are the same"),
    ({"kind": "slew", "q_rad": [[0, 0], [1, 1]], "duration_s": [1, 2]}, r"2 numbers for 1 leg\(s\)"),
    ({"kind": "slew", "q_rad": [[0, 0], [1, float("nan")]], "duration_s": 1}, r"q_rad\[1\]\[1\]"),
    ({"kind": "slew", "q_rad": [[0, 0], [1, 1]], "duration_s": 1, "carriage": {"u0_m_s": 1, "ramp_s": 5}}, "carriage needs 2 x"),
    ({"kind": "fourier", "q_rad": [0, 0], "duration_s": 9, "reach_rad": 1}, "reach_rad and rate_rad_s for drawn"),
    ({"kind": "fourier", "q_rad": [0, 0], "duration_s": 9, "amplitude_rad": [[1]], "frequency_hz": [1]}, "needs 2 list"),
])
def test_a_motion_that_cannot_be_is_refused_in_one_line(document: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        reference(document)
    assert "\n" not in str(caught.value)


def test_every_kind_declares_its_name_once() -> None:
    for kind, cls in motion_kinds().items():
        assert cls.model_fields["kind"].default == kind
        assert cls.__doc__
