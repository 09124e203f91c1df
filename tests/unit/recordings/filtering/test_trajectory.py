"""One trajectory from all that was recorded of a motion, and the band in which its acceleration is known."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import multi_sine
from hypothesis import given, settings
from hypothesis import strategies as st

from nnhydro.recordings.filtering.band import band_of
from nnhydro.recordings.filtering.trajectory import HIGHEST_EDGE, LOWEST_EDGE, _grouped_median, step_level, trajectory, white_level
from nnhydro.recordings.recording import Recording

EDGE = 4.0  # Hz


def band_edge(recordings):
    """Return the upper edge of the motion's band, Hz."""
    return band_of(recordings).motion
NOISE = (1e-3, 1e-2, 0.1)  # rad, rad/s, rad/s^2


def moved(rate=100.0, seconds=8.0, links=2, seed=1, channels="qva", noise=(0.0, 0.0, 0.0), given=0):
    """A motion of three sines a joint and what was recorded of it."""
    t = np.arange(round(rate * seconds)) / rate
    rng = np.random.default_rng(given)
    exact = multi_sine(t, links, seed)
    q, qd, qdd = (x + s * rng.standard_normal(x.shape) for x, s in zip(exact, noise, strict=True))
    return Recording("run", t, q, np.zeros_like(q), qd if "v" in channels else None, qdd if "a" in channels else None), exact


def errors(made, exact, inside=slice(50, -50)):
    """Largest errors of angle, rate and acceleration over their largest values."""
    pairs = zip((made.q, made.qd, made.qdd), exact, strict=True)
    return [float(np.abs(got - want)[inside].max() / np.abs(want).max()) for got, want in pairs]


def rms(x):
    return float(np.sqrt((x[50:-50] ** 2).mean()))


@pytest.mark.parametrize("channels", ["q", "qv", "qva"])
def test_a_motion_is_recovered_with_its_derivatives_from_angles_alone_and_from_all_channels(channels):
    r, exact = moved(channels=channels)
    q, qd, qdd = errors(trajectory(r, EDGE, len(r)), exact)
    assert q < 1e-5
    assert qd < 1e-4
    assert qdd < 2e-3


def test_all_channels_together_know_the_motion_better_than_angles_with_either_derivative_or_alone():
    wrong = {}
    for channels in ("q", "qv", "qa", "qva"):
        recorded = [moved(channels=channels, noise=NOISE, given=seed) for seed in range(5)]
        made = [(trajectory(r, EDGE, len(r)), exact) for r, exact in recorded]
        names = enumerate(("q", "qd", "qdd"))
        wrong[channels] = [np.mean([rms(getattr(trajectory, name) - exact[k]) for trajectory, exact in made]) for k, name in names]
    for k in (1, 2):
        assert all(wrong["qva"][k] <= 1.02 * wrong[fewer][k] for fewer in ("q", "qv", "qa"))
    assert wrong["qva"][2] < 0.5 * wrong["q"][2]
    assert wrong["qva"][1] < NOISE[1] / 2, "better than the rate as it was recorded"


@given(locked=st.sampled_from([0, 1]), angle=st.floats(-3, 3))
@settings(max_examples=6)
def test_a_joint_that_never_moves_has_no_rate_and_no_acceleration(locked, angle):
    r, exact = moved(channels="q", seconds=4.0)
    q = np.array(r.q)
    q[:, locked] = angle
    made = trajectory(replace(r, q=q), EDGE, len(r))
    assert np.abs(made.qd[:, locked]).max() < 1e-6
    assert np.abs(made.qdd[:, locked]).max() < 1e-4
    other = 1 - locked
    assert np.abs(made.qd - exact[1])[50:-50, other].max() < 1e-3 * np.abs(exact[1]).max()


def test_without_a_carriage_the_carriage_stands_still_and_with_one_it_is_followed():
    r, _ = moved()
    assert not trajectory(r, EDGE, len(r)).u0.any()
    u0 = 0.5 + 0.2 * np.sin(2.0 * r.t)
    towed = trajectory(replace(r, u0=u0), EDGE, len(r))
    assert np.abs(towed.u0 - u0).max() < 1e-3
    assert np.abs(towed.du0 - 0.4 * np.cos(2.0 * r.t))[50:-50].max() < 0.01


@given(level=st.floats(1e-6, 10.0), seed=st.integers(0, 100))
def test_the_level_of_white_noise_is_told_whatever_slow_motion_it_lies_on(level, seed):
    rng = np.random.default_rng(seed)
    t = np.arange(2000) / 100.0
    x = level * rng.standard_normal((2000, 2)) + 20 * level * np.sin(t)[:, None]
    assert white_level(x) == pytest.approx([level, level], rel=0.15)


def test_jumps_are_no_white_noise_but_count_as_steps():
    x = 0.1 * np.random.default_rng(1).standard_normal((2000, 1))
    jumped = x + 5.0 * (np.arange(2000) // 100 % 2)[:, None]
    assert white_level(jumped) == pytest.approx(white_level(x), rel=0.1)
    assert step_level(x) == pytest.approx([0.1], rel=0.1)
    assert step_level(jumped)[0] > 2 * step_level(x)[0]


@pytest.mark.parametrize(("channels", "noise"), [("q", (1e-4, 0, 0)), ("q", (1e-3, 0, 0)), ("q", (1e-2, 0, 0)), ("qva", (1e-3, 1e-2, 0.1))])
def test_the_edge_of_the_band_is_the_same_logged_at_100_hz_and_at_1_khz(channels, noise):
    edges = []
    for rate in (100.0, 1000.0):  # noise of the same power in every hertz
        scaled = tuple(s * np.sqrt(rate / 100.0) for s in noise)
        edges.append(band_edge([moved(rate, 16.0, channels=channels, noise=scaled)[0]]))
    assert edges[1] == pytest.approx(edges[0], rel=0.2)  # one band in four an octave


@pytest.mark.parametrize("channels", ["q", "qva"])
def test_a_motion_sixteen_times_as_slow_has_a_band_sixteen_times_as_low(channels):
    r = moved(seconds=16.0, channels=channels, noise=(1e-3, 1e-2, 0.1))[0]
    slow = replace(r, t=16 * r.t, qd=None if r.qd is None else r.qd / 16, qdd=None if r.qdd is None else r.qdd / 256)
    assert band_edge([slow]) == pytest.approx(band_edge([r]) / 16)
    assert band_edge([slow]) < LOWEST_EDGE


def test_the_noise_of_one_channel_is_no_motion_because_another_is_quieter():
    """Noisy angles, twice differentiated, exceed any motion: beside good accelerations they once ended the band at its highest."""
    quiet, noisy = (band_edge([moved(seconds=16.0, noise=(s, 1e-2, 0.1))[0]]) for s in (1e-6, 1e-3))
    assert noisy == pytest.approx(quiet, rel=0.5)
    assert noisy < 3.0


def test_the_noisier_the_angles_the_lower_the_edge():
    edges = [band_edge([moved(channels="q", noise=(s, 0.0, 0.0), seconds=16.0)[0]]) for s in (0.0, 1e-4, 1e-2, 0.3)]
    assert edges == sorted(edges, reverse=True)
    assert edges[-1] < edges[0]


def test_accelerations_that_were_measured_raise_the_edge_that_noisy_angles_leave():
    noisy = (3e-2, 0.0, 1e-3)
    alone, with_them = (band_edge([moved(channels=c, noise=noisy, seconds=16.0)[0]]) for c in ("q", "qa"))
    assert with_them >= alone


@given(rate=st.sampled_from([25.0, 50.0, 100.0]), noise=st.floats(0, 1.0), seed=st.integers(0, 20))
@settings(max_examples=15)
def test_the_edge_always_lies_where_it_may(rate, noise, seed):
    edge = band_edge([moved(rate, 5.0, 1, seed, "q", (noise, 0.0, 0.0))[0]])
    assert LOWEST_EDGE <= edge <= min(HIGHEST_EDGE, 0.45 * rate)


@given(seed=st.integers(0, 10**6), channels=st.sampled_from(["q", "qv", "qva"]))
@settings(max_examples=20)
def test_a_joint_that_rests_beside_one_that_moves_is_at_rest_whatever_its_noise(seed, channels):
    r, _ = moved(channels=channels, noise=NOISE, given=seed)
    noise = [s * np.random.default_rng([seed, k]).standard_normal(len(r)) for k, s in enumerate(NOISE)]
    still = [None if x is None else np.column_stack([x[:, 0], (0.7, 0.0, 0.0)[k] + noise[k]]) for k, x in enumerate((r.q, r.qd, r.qdd))]
    made = trajectory(replace(r, q=still[0], qd=still[1], qdd=still[2]), EDGE, len(r))
    assert not made.qd[:, 1].any()
    assert not made.qdd[:, 1].any()
    assert made.q[:, 1] == pytest.approx(0.7, abs=4 * NOISE[0] / np.sqrt(len(r)))
    assert rms(made.qd[:, 0]) > 0.1


@pytest.mark.parametrize("size", [3.0, 10.0])
def test_a_motion_as_small_as_a_few_times_the_noise_is_a_motion(size):
    r, exact = moved(channels="q", links=1)
    scale = size * NOISE[0] / exact[0].std()
    noisy = replace(r, q=scale * exact[0] + NOISE[0] * np.random.default_rng(1).standard_normal(r.q.shape))
    made = trajectory(noisy, EDGE, len(r))
    assert rms(made.q - scale * exact[0]) < NOISE[0]
    assert rms(made.qd) > 0.8 * scale * rms(exact[1])


def test_a_carriage_of_constant_speed_does_not_accelerate():
    r, _ = moved()
    speed = 0.4 + 1e-3 * np.random.default_rng(2).standard_normal(len(r))
    made = trajectory(replace(r, u0=speed), EDGE, len(r))
    assert not made.du0.any()
    assert made.u0 == pytest.approx(speed.mean())


def test_the_noise_of_a_current_meter_does_not_accelerate_the_water():
    r, _ = moved(seconds=20.0)
    noise = 0.004 * np.random.default_rng(2).standard_normal((len(r), 2))
    steady = trajectory(replace(r, current=np.array([0.11, -0.05]) + noise), EDGE, len(r)).around
    assert not steady["dcurrent"].any()
    assert steady["current"][0] == pytest.approx(np.array([0.11, -0.05]) + noise.mean(axis=0))
    tide = 0.3 * np.sin(np.pi * r.t)[:, None] * np.array([1.0, -0.5])
    follows = trajectory(replace(r, current=tide + noise), EDGE, len(r)).around
    inside = slice(100, -100)
    assert rms((follows["current"] - tide)[inside]) < 0.002
    exact = 0.3 * np.pi * np.cos(np.pi * r.t)[:, None] * np.array([1.0, -0.5])
    assert rms((follows["dcurrent"] - exact)[inside]) < 0.03 * rms(exact)


@pytest.mark.parametrize("channels", ["q", "qv", "qva"])
def test_what_is_left_of_the_noise_is_as_large_as_what_noise_of_the_records_makes_of_the_trajectory(channels):
    recorded = [moved(channels=channels, noise=NOISE, given=seed)[0] for seed in range(6)]
    made = [trajectory(r, EDGE, len(r)) for r in recorded]
    exact = trajectory(moved(channels=channels, noise=(1e-9, 1e-8, 1e-7))[0], EDGE, len(recorded[0]))
    for order, name in enumerate(("q", "qd", "qdd")):
        found = rms(np.concatenate([getattr(m, name) - getattr(exact, name) for m in made]))
        told = rms(np.concatenate([draw[order] for m in made for draw in m.noise]))
        assert told == pytest.approx(found, rel=0.15), f"{name} from {channels}"


def tachometer(given, noise=0.02):
    """A motion of which a tachometer with white noise is recorded, and the integral of its reading as the angle."""
    r, exact = moved(channels="qv", noise=(0.0, noise, 0.0), given=given)
    steps = np.diff(r.t)[:, None] * (r.qd[1:] + r.qd[:-1]) / 2
    return replace(r, q=r.q[0] + np.concatenate([np.zeros((1, r.n_links)), np.cumsum(steps, axis=0)]), integrated=True), exact


def test_of_a_tachometer_the_noise_is_that_of_the_rates_though_its_integral_is_smooth():
    """The noise of the acceleration is as large as it is told; were the smooth angles a measurement, a tenth of it would be told."""
    made, exact = [trajectory(tachometer(seed)[0], EDGE, len(tachometer(seed)[0])) for seed in range(6)], tachometer(0)[1]
    without = trajectory(tachometer(0, noise=1e-9)[0], EDGE, len(exact[0]))
    for order, name in ((1, "qd"), (2, "qdd")):
        found = rms(np.concatenate([getattr(m, name) - getattr(without, name) for m in made]))
        told = rms(np.concatenate([draw[order] for m in made for draw in m.noise]))
        assert told == pytest.approx(found, rel=0.15), name
    as_measured = trajectory(replace(tachometer(0)[0], integrated=False), EDGE, len(exact[0]))
    assert rms(as_measured.noise[:, 2].reshape(-1, 2)) < 0.5 * rms(made[0].noise[:, 2].reshape(-1, 2))


def test_the_band_of_a_tachometer_ends_where_its_rates_are_noise():
    assert band_edge([tachometer(0, 0.3)[0]]) < 0.7 * band_edge([tachometer(0, 1e-4)[0]])
    t, rng = np.arange(0, 5, 0.02), np.random.default_rng(1)
    rate = (277 * (1 - np.exp(-t / 1.33)) + 2.5 * rng.standard_normal(len(t)))[:, None]
    angle = np.concatenate([[[0.0]], np.cumsum(0.02 * (rate[1:] + rate[:-1]) / 2, axis=0)])
    spun_up = [Recording("up", t[rows], angle[rows], np.ones((len(rows), 1)), rate[rows], integrated=True) for rows in
               np.array_split(np.arange(len(t)), 5)]
    assert band_edge(spun_up) < 0.3 * band_edge([replace(r, integrated=False) for r in spun_up]), "the sum of its noise is no motion"


@pytest.mark.parametrize("place", [0.0, 0.15, 0.35, 0.5])
@pytest.mark.parametrize("noise", [0.3, 0.5, 1.0])
def test_the_noise_of_an_encoder_that_flickers_between_steps_is_found(place, noise):
    """The median of whole steps alone is a whole number of them: the noise would come out a third too small or too large."""
    step = 2e-4
    x = step * np.round(place + noise * np.random.default_rng(3).standard_normal((20000, 1)))
    flickers = x.std()
    found = white_level(x)
    assert found == pytest.approx([flickers], rel=0.15)


@pytest.mark.parametrize("spread", [1.2, 2.0, 5.0])
def test_the_median_of_whole_steps_lies_within_its_step_where_that_of_the_true_values_does(spread):
    true = np.abs(spread * np.random.default_rng(4).standard_normal(40000))
    grouped = _grouped_median(np.round(true), 1.0)
    assert grouped == pytest.approx(np.median(true), abs=0.08)
    assert _grouped_median(true, 0.0) == np.median(true)
