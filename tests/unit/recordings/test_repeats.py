"""Repeats are found by their motion, and the noise floor they give is that of the noise which was planted."""

from pathlib import Path

import numpy as np
import pytest
from planted import Columns, healthy, recording, the_arm

from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.recording import Recording, SteadyTable
from nnhydro.recordings.repeats import expected_noise, group_names, noise_floor, repeated_recordings, repeated_rows

ROOT = Path(__file__).resolve().parents[3]
NOISE = 0.05
PLAIN = Preparation(None)


def again(seed: int, wander: float = 4e-4) -> Columns:
    """The motion of run 1 with new noise on torques and a little wander on the angles."""
    rng = np.random.default_rng(seed)
    columns = healthy(1, noise=0.0)
    wander_now = wander * np.sin(2 * np.pi * columns["t_s"] / 3 + seed)
    return {**columns, "q1_rad": columns["q1_rad"] + wander_now, "tau1_Nm": columns["tau1_Nm"] + NOISE * rng.standard_normal(1000),
            "tau2_Nm": columns["tau2_Nm"] + 0.5 * NOISE * rng.standard_normal(1000)}


def rig() -> Campaign:
    runs = [recording(again(seed), f"same{seed}") for seed in range(3)]
    return Campaign.of(the_arm(), [*runs, recording(healthy(2), "other"), recording(healthy(3), "another")])


def test_recordings_of_one_motion_are_grouped_and_others_left_alone():
    assert repeated_recordings(rig()) == (("same0", "same1", "same2"),)
    assert group_names(rig()) == {"same0": "same0", "same1": "same0", "same2": "same0"}


def test_the_noise_floor_is_the_planted_noise():
    floor = noise_floor(rig(), PLAIN)
    assert floor is not None
    np.testing.assert_allclose(floor.std, [NOISE, 0.5 * NOISE], rtol=0.05)  # 3000 samples: 1.3 % of a standard deviation
    perfect = [recording(healthy(1, noise=0.0))]
    total = np.abs(perfect[0].tau).sum()
    assert floor.error == pytest.approx(np.sqrt(2 / np.pi) * 1.5 * NOISE * 1000 / total, rel=0.05)


def test_the_low_pass_lowers_the_floor_as_its_gain_says():
    how = Preparation(LowPass(8.0))
    floor = noise_floor(rig(), how)
    assert floor is not None
    f = np.linspace(0, 50, 2001)
    np.testing.assert_allclose(floor.std[0], NOISE * np.sqrt((how.low_pass.gain(f) ** 2).mean()), rtol=0.15)  # 16 % of the samples count
    np.testing.assert_allclose(floor.std, expected_noise(rig().load("same0"), how), rtol=0.2)


def test_without_repeats_there_is_no_floor():
    assert noise_floor(Campaign.of(the_arm(), [recording(healthy(n), f"r{n}") for n in (1, 2)]), PLAIN) is None


def test_the_same_angles_under_another_tow_are_another_motion():
    a, b = again(1), again(2)
    tow = 0.5 * np.ones(1000)
    assert repeated_recordings(Campaign.of(the_arm(), [recording({**a, "u0_m_s": tow}, "a"), recording(b, "b")])) == ()
    both = [recording({**a, "u0_m_s": tow}, "a"), recording({**b, "u0_m_s": tow}, "b")]
    assert repeated_recordings(Campaign.of(the_arm(), both)) == (("a", "b"),)


def test_recordings_at_rest_or_too_short_are_no_repeats():
    still = {name: 0 * x if name != "t_s" else x for name, x in healthy(1).items()}
    short = {name: x[:8] for name, x in healthy(1).items()}
    assert repeated_recordings(Campaign.of(the_arm(), [recording(c, n) for n, c in (("a", still), ("b", still), ("c", short))])) == ()


def test_steady_rows_at_one_state_are_repeats():
    q = np.array([[0.1, 0.2], [0.3, 0.2], [0.1, 0.2], [0.1, 0.2]])
    tau = np.array([[1.0, 2.0], [5.0, 5.0], [1.2, 2.0], [1.1, 2.0]])
    table = SteadyTable("t", tuple("abcd"), q, 0 * q, np.full(4, 0.5), tau)
    assert repeated_rows(table) == ((0, 2, 3),)
    floor = noise_floor(Campaign.of(the_arm(), [], (table,)), PLAIN)
    assert floor is not None
    np.testing.assert_allclose(floor.std, [0.1, 0.0], atol=1e-12)


def test_the_repeats_of_the_synthetic_tank_are_those_it_was_made_with():
    path = ROOT / "datasets" / "rivera_tank"
    if not path.is_dir():
        pytest.skip(f"{path} is not here: the data sets travel with the source tree, not with the wheel")
    names = {frozenset(group) for group in repeated_recordings(open_campaign(path))}
    assert names == {frozenset(f"{stem}_repeat{k}" for k in (1, 2, 3)) for stem in ("fourier1", "fourier_tow1")}


def test_rows_that_one_of_the_repeats_has_lost_are_not_compared():
    there = np.r_[0:300, 330:1000]  # a torque interpolated over 0.3 s would miss what it did

    def run(seed: int, rows: object) -> Recording:
        columns = again(seed, wander=0.0)
        columns["tau1_Nm"] = columns["tau1_Nm"] + 2 * np.sin(2 * np.pi * columns["t_s"] / 0.6)
        return recording({name: x[rows] for name, x in columns.items()}, f"same{seed}")

    both, torn = (noise_floor(Campaign.of(the_arm(), [run(0, slice(None)), run(1, rows)]), PLAIN) for rows in (slice(None), there))
    assert both is not None
    assert torn is not None
    np.testing.assert_allclose(torn.std, both.std, rtol=0.1)
