"""Where a residual lies: bins, regions, bands, loud recordings; the size of a hum; how white what remains is."""

import numpy as np
import pytest

from nnhydro.diagnosis.decision.heldout_errors import Residual
from nnhydro.diagnosis.unexplained.residual_location import _band, _explained_share, _region, locate
from nnhydro.diagnosis.unexplained.spectral_lines import Line, _ratios, strongest


def test_bins_of_equal_count_explain_the_variance_between_their_means():
    x = np.arange(100.0)
    y = np.repeat(np.arange(10.0), 10)
    explained, edges, mean = _explained_share(x, y)
    assert explained == pytest.approx(1.0)
    np.testing.assert_allclose(mean, np.arange(10.0))
    assert len(edges) == 11
    assert (edges[0], edges[-1]) == (0.0, 99.0)
    mixed = y + np.tile([1.0, -1.0], 50)
    assert _explained_share(x, mixed)[0] == pytest.approx(8.25 / 9.25)  # variance of 0..9, and of the ones
    np.testing.assert_allclose(_explained_share(x, mixed)[2], np.arange(10.0))


def test_a_state_of_one_value_explains_nothing_and_one_of_two_values_a_step():
    explained, edges, mean = _explained_share(np.zeros(50), np.arange(50.0))
    assert (explained, len(edges), len(mean)) == (0.0, 1, 0)
    explained, _, mean = _explained_share(np.repeat([0.0, 1.0, 2.0], 20), np.repeat([5.0, 7.0, 7.0], 20))
    assert explained == pytest.approx(1.0)
    np.testing.assert_allclose(mean, [5.0, 7.0])
    assert _explained_share(np.arange(30.0), np.full(30, 3.0))[0] == 0.0


@pytest.mark.parametrize(("size", "region"), [
    ([0.9, 0.6, 1.0, 0.4, 0.9], [0.0, 3.0]), ([0.4, 0.9, 1.0, 0.6, 0.51], [1.0, 5.0]), ([1.0, 0.4, 0.9, 0.4, 0.4], [0.0, 1.0]),
    ([0.4, 0.4, 0.4, 0.4, 1.0], [4.0, 5.0]), ([0.6, 0.6, 0.6, 0.6, 1.0], [0.0, 5.0]),
])
def test_a_region_goes_on_to_either_side_of_the_largest_as_long_as_more_than_half_is_left(size, region):
    assert _region(np.arange(6.0), np.array(size)) == region


def residuals(r_of, count=6, rows=400, seed=1, dt=0.02, joints=1):
    rng, made = np.random.default_rng(seed), []
    for k in range(count):
        state = {"q1_rad": rng.uniform(-1, 1, rows), "dq1_rad_s": rng.uniform(-2, 2, rows)}
        r = 0.1 * rng.standard_normal((rows, joints))
        r[:, 0] += r_of(k, state)
        made.append(Residual(f"run{k}", r, state, dt))
    return made


def test_a_residual_that_depends_on_a_state_is_placed_at_its_largest():
    (place,) = locate(residuals(lambda k, s: s["q1_rad"] + 0.1), np.array([0.1]))
    ((name, (low, high)),) = place.conditions.items()
    assert name == "q1_rad"
    assert low == pytest.approx(0.4, abs=0.1)
    assert high == pytest.approx(1.0, abs=0.01)
    assert place.where.startswith("depends on q1_rad, largest from 0.")
    assert place.where.endswith("in every recording")
    assert place.recordings == []
    assert place.share == 1.0
    assert place.sentence == f"depends on q1_rad: it is largest from {low:.3g} to {high:.3g}"
    loud = locate(residuals(lambda k, s: (5.0 if k < 2 else 1.0) * s["q1_rad"]), np.array([0.1]))[0]
    assert loud.sentence.startswith("depends on q1_rad: it is largest from ")
    assert loud.sentence.endswith(", in run0, run1")


def test_a_residual_whose_size_alone_depends_on_a_state_is_largest_there():
    rng = np.random.default_rng(4)
    (place,) = locate(residuals(lambda k, s: np.where(np.abs(s["dq1_rad_s"]) < 0.4, rng.choice([-1.0, 1.0], 400), 0.0)), np.array([0.1]))
    ((name, (low, high)),) = place.conditions.items()
    assert name == "dq1_rad_s"
    assert "size depends on dq1_rad_s, largest" in place.where
    assert (low, high) == pytest.approx((-0.4, 0.4), abs=0.1)
    assert not place.sentence, "its size alone says nothing of a law"


def test_a_residual_of_no_state_is_spread_and_its_loud_recordings_are_named():
    rng = np.random.default_rng(5)
    (place,) = locate(residuals(lambda k, s: (6.0 if k == 2 else 1.0) * rng.choice([-1.0, 1.0], 400)), np.array([0.1]))
    assert place.where == "spread over all states, mostly in run2"
    assert place.recordings == ["run2"]
    assert place.sentence == "lies in run2"
    assert place.conditions == {}
    (even,) = locate(residuals(lambda k, s: (1.9 if k == 2 else 1.0) * rng.choice([-1.0, 1.0], 400)), np.array([0.1]))
    assert even.where == "spread over all states", "less than four times the energy of the median recording is not loud"
    parts = residuals(lambda k, s: (2.1 if k == 2 else 1.0) * rng.choice([-1.0, 1.0], 400))
    assert locate(parts, np.array([0.1]))[0].recordings == ["run2"], "a little more than four times is"
    for count, named in ((3, []), (4, ["run2"])):  # of three nobody knows which is usual
        parts = residuals(lambda k, s: (6.0 if k == 2 else 1.0) * rng.choice([-1.0, 1.0], 400), count=count)
        assert locate(parts, np.array([0.1]))[0].recordings == named


def test_the_loudness_of_a_recording_is_its_mean_square_however_long_it_is():
    rng = np.random.default_rng(6)
    short = [Residual(f"run{k}", rng.standard_normal((100, 1)), {}, 0.02) for k in range(5)]
    halves = [Residual("long", rng.standard_normal((1000, 1)), {}, 0.02) for _ in range(2)]
    assert locate([*short, *halves], np.array([0.5]))[0].recordings == []


def test_a_twentieth_of_the_variance_is_needed_before_a_state_is_named():
    def step(share):
        rng, size = np.random.default_rng(7), np.sqrt(share / (1 - share))
        parts = residuals(lambda k, s: np.sign(s["q1_rad"]) * size + rng.standard_normal(400), count=20)
        return locate(parts, np.array([0.1]))[0]
    assert step(0.02).conditions == {}
    assert list(step(0.12).conditions) == ["q1_rad"]


def test_joints_share_the_energy_beyond_the_noise_and_one_of_a_fiftieth_is_left_out():
    parts = [Residual("run", np.tile([1.0, -1.0], 100)[:, None] * np.array([2.0, 1.0, 0.5]), {}, 0.02)] * 2
    one, two = locate(parts, np.array([1.0, 0.5, 0.5]))
    assert (one.joint, two.joint) == (1, 2)
    assert one.share == pytest.approx(3.0 / 3.75)
    assert two.share == pytest.approx(0.75 / 3.75)
    assert [place.joint for place in locate(parts, np.array([2.0, 0.5, 0.0]))] == [2, 3]
    assert locate(parts, np.array([2.0, 1.0, 0.5])) == []
    assert len(locate(parts, np.array([0.0, 2.0, np.sqrt(0.25 - 4 * 0.019 / 0.981)]))) == 1
    assert len(locate(parts, np.array([0.0, 2.0, np.sqrt(0.25 - 4 * 0.022 / 0.978)]))) == 2


def test_the_band_of_a_sine_is_its_frequency_and_that_of_noise_nearly_everything():
    t = 0.02 * np.arange(1000)
    sine = [Residual("a", np.sin(2 * np.pi * 4.0 * t)[:, None] + 3.0, {}, 0.02)] * 3
    assert _band(sine, 0) == pytest.approx([4.0, 4.0], abs=0.3)
    rng = np.random.default_rng(1)
    white = [Residual("a", rng.standard_normal((2000, 1)), {}, 0.02) for _ in range(10)]
    low, high = _band(white, 0)
    assert low == pytest.approx(1.25, abs=0.5)
    assert high == pytest.approx(23.75, abs=0.5)


def test_the_band_leaves_a_twentieth_of_the_power_on_either_side():
    t = 0.02 * np.arange(1000)
    for power, end in ((0.04, 4.0), (0.12, 10.0)):  # of the second sine, beside 1
        two = np.sin(2 * np.pi * 4.0 * t) + np.sqrt(power) * np.sin(2 * np.pi * 10.0 * t)
        assert _band([Residual("a", two[:, None], {}, 0.02)], 0) == pytest.approx([4.0, end], abs=0.3)


def test_steady_and_short_parts_have_no_band_and_the_slowest_sampling_sets_its_end():
    assert _band([Residual("a", np.ones((100, 1)), {}, 0.0), Residual("b", np.ones((31, 1)), {}, 0.02)], 0) == [0.0, 0.0]
    rng = np.random.default_rng(1)
    mixed = [Residual("a", rng.standard_normal((500, 1)), {}, dt) for dt in (0.02, 0.05)]
    assert 8.0 < _band(mixed, 0)[1] <= 10.0
    assert _band([Residual("b", np.sin(2 * np.arange(32.0))[:, None], {}, 0.02)], 0)[1] > 0


def hums(amplitude, noise=1.0, count=12, rows=600, frequency=7.25, seed=1, dt=0.02, joints=2):
    rng, made = np.random.default_rng(seed), []
    for k in range(count):
        r = noise * rng.standard_normal((rows, joints))
        r[:, -1] += amplitude * np.sin(2 * np.pi * frequency * dt * np.arange(rows) + k)
        made.append(Residual(f"run{k}", r, {}, dt))
    return made


@pytest.mark.parametrize("amplitude", [0.5, 1.0, 4.0])
def test_the_share_of_a_hum_is_half_its_amplitude_squared_of_the_energy(amplitude):
    line = strongest(hums(amplitude), 1)
    assert line.amplitude == pytest.approx(amplitude, rel=0.12)
    assert line.share == pytest.approx(line.amplitude**2 / 2 / (1 + amplitude**2 / 2), rel=0.05)


def test_a_hum_alone_is_all_there_is():
    line = strongest(hums(2.0, noise=1e-3, frequency=6.0), 1)
    assert line.share == pytest.approx(1.0, rel=0.1)
    assert line.frequency_hz == pytest.approx(6.0, abs=0.05)
    assert line.p_value < 1e-100


def test_amplitudes_are_those_of_sines_at_the_ordinates():
    t = 0.02 * np.arange(500)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(500)
    f, ratios, _, amplitude = _ratios(3.0 * np.sin(2 * np.pi * 5.0 * t + 1.0) + 10.0 + noise, 0.02, 25.0)
    k = int(np.argmin(np.abs(f - 5.0)))
    assert amplitude[k] == pytest.approx(3.0, rel=0.01)
    assert int(np.argmax(ratios)) == k
    assert f[-1] == pytest.approx(25.0)


def test_ordinates_of_noise_over_their_background_are_about_one_at_any_level():
    for level in (1e-3, 1.0, 1e3):
        ratios = np.concatenate([_ratios(level * np.random.default_rng(seed).standard_normal(600), 0.02, 25.0)[1] for seed in range(40)])
        assert np.median(ratios) == pytest.approx(np.log(2), rel=0.06)
        assert 0.9 < ratios.mean() < 1.15


def test_a_line_next_to_another_keeps_it_out_of_its_background():
    t = 0.02 * np.arange(600)
    x = np.random.default_rng(1).standard_normal(600)
    alone, beside = (_ratios(x + 20 * np.sin(2 * np.pi * 7.5 * t + 0.3) + a * np.sin(2 * np.pi * (7.5 + 1.3 / 12) * t), 0.02, 25.0)[1].max()
                     for a in (0.0, 15.0))
    assert beside > 0.2 * alone


def test_p_falls_with_the_line_and_pays_for_every_frequency():
    p = [strongest(hums(a, seed=3), 1).p_value for a in (0.0, 0.2, 0.3, 0.5)]
    assert p[0] > 0.01 > p[2] > p[3]
    assert p[1] >= p[2]
    line = strongest(hums(0.0, seed=9), 0)
    assert line.p_value <= 1.0
    assert line.joint == 1


@pytest.mark.parametrize("frequency", [3.0, 7.31, 11.37])
def test_frequencies_are_tried_as_finely_as_the_longest_recording_can_tell_them(frequency):
    line = strongest([*hums(3.0, count=8, frequency=frequency), *hums(3.0, count=4, rows=400, frequency=frequency, seed=2)], 1)
    steps = (line.frequency_hz - 1.0) * 600 * 0.02  # from 1 Hz on, one over 12 s apart
    assert steps == pytest.approx(round(steps), abs=1e-6)
    assert line.frequency_hz == pytest.approx(frequency, abs=1.5 / 12)


def test_slow_lines_are_motions_and_lines_near_the_end_of_the_spectrum_are_not_looked_at():
    assert abs(strongest(hums(5.0, frequency=0.6), 1).frequency_hz - 0.6) > 0.3
    assert abs(strongest(hums(5.0, frequency=24.6), 1).frequency_hz - 24.6) > 0.3
    assert strongest(hums(5.0, frequency=1.3), 1).frequency_hz == pytest.approx(1.3, abs=0.1)
    assert strongest(hums(5.0, frequency=23.0), 1).frequency_hz == pytest.approx(23.0, abs=0.1)
    assert strongest(hums(1.0, dt=0.5), 1) is None, "all that is sampled lies below the lowest frequency"


@pytest.mark.parametrize(("count", "rows", "told"), [(4, 64, True), (3, 64, False), (4, 63, False)])
def test_four_recordings_of_sixty_four_rows_are_enough_to_look_for_a_hum(count, rows, told):
    assert (strongest(hums(0.0, count=count, rows=rows), 0) is not None) == told


def test_a_line_that_one_recording_holds_alone_is_no_hum():
    parts = hums(0.0)
    parts[3].r[:, 1] += 30 * np.sin(2 * np.pi * 9.0 * 0.02 * np.arange(600))
    assert abs(strongest(parts, 1).frequency_hz - 9.0) > 0.2


@pytest.mark.parametrize(("p", "share", "worth"), [(0.00024, 0.11, True), (0.00026, 0.11, False), (0.00024, 0.09, False)])
def test_a_hum_is_told_at_one_in_a_thousand_over_four_tests_and_from_a_tenth_of_the_energy(p, share, worth):
    assert Line(1, p, 5.0, 0.1, share).material == worth
