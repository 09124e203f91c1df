"""What the recorder writes: encoders, torque sensors, sampling."""

from pathlib import Path
from typing import Any

import numpy as np
from tank_recipes import BASE, recipe

from nnhydro.recordings.campaign import open_campaign
from nnhydro.simulation.campaign_writer import record_runs, runs, write_campaign
from nnhydro.simulation.sensors import Sensors, record

BELT = {**BASE["arm"], "drive": {"kind": "remote", "pulley_ratio": 1.5, "angle2": "absolute"}}


def test_the_noise_is_as_strong_as_asked() -> None:
    long = [{"kind": "rotation", "name": "turn", "q_rad": [0, 0], "dq_rad_s": [0.5, 0.2], "hold_s": 100.0}]
    made = recipe(motions=long, unseen=[], sensors={"torque_noise_Nm": [0.03, 0.0], "torque_noise_share": [0.0, 0.05]})
    (seen,) = record_runs(made)
    noise = np.column_stack(list(seen.torque.values())) - seen.clean
    wanted = [0.03, 0.05 * np.sqrt((seen.clean[:, 1] ** 2).mean())]
    np.testing.assert_allclose(noise.std(axis=0), wanted, rtol=0.04)  # three standard errors of 10 000 samples
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.04


def _noiseless(**sensors: Any) -> tuple[Any, Any]:
    """The run of a slew and what the sensors record of it."""
    made = recipe(motions=BASE["motions"][:1], unseen=[], sensors=sensors)
    (run,) = runs(made)
    return run, record(run, made.arm, made.settings.sensors, made.settings.steps, np.random.default_rng(0))


def test_encoders_count_in_steps_and_perfect_sensors_read_the_truth() -> None:
    run, perfect = _noiseless()
    np.testing.assert_allclose(perfect.torque["tau1_Nm"], run.tau[::10, 0], atol=1e-12)
    np.testing.assert_allclose(perfect.motion["q1_rad"], run.state.q[::10, 0], atol=1e-12)
    _, coarse = _noiseless(encoder_counts_per_rev=360)
    counts = np.degrees(coarse.motion["q1_rad"])
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.abs(coarse.motion["q1_rad"] - perfect.motion["q1_rad"]).max() <= np.pi / 360 + 1e-12


def test_torque_arrives_late_biased_and_smoothed_as_asked() -> None:
    run, late = _noiseless(torque_delay_s=0.03, torque_bias_Nm=[0.5, -0.2])
    np.testing.assert_allclose(late.torque["tau1_Nm"][3:], run.tau[::10, 0][:-3] + 0.5, atol=1e-9)
    _, slow = _noiseless(torque_low_pass_hz=5.0, torque_low_pass_order=1)
    lag = 1 / (2 * np.pi * 5.0)  # s, of a first-order low-pass at low frequencies
    t = slow.motion["t_s"]
    smooth = np.interp(t - lag, run.t, run.tau[:, 0])
    assert np.abs(slow.torque["tau1_Nm"] - smooth).max() < 0.1 * np.abs(run.tau[:, 0]).max()
    assert np.abs(slow.torque["tau1_Nm"] - smooth).max() < 0.5 * np.abs(slow.torque["tau1_Nm"] - run.tau[::10, 0]).max()


def test_jitter_and_dropouts_change_which_instants_are_seen_not_the_motion() -> None:
    run, seen = _noiseless(jitter_s=5e-4, dropout_share=0.2, dropout_s=0.05, velocities=True, accelerations=True)
    t = seen.motion["t_s"]
    assert (np.diff(t) > 0).all()
    assert 0.65 < len(t) / len(run.t[::10]) < 0.95
    np.testing.assert_allclose(seen.motion["q2_rad"], np.interp(t, run.t, run.state.q[:, 1]), atol=2e-6)
    np.testing.assert_allclose(seen.motion["dq2_rad_s"], np.interp(t, run.t, run.state.qd[:, 1]), atol=2e-5)


def test_behind_a_belt_the_second_channel_is_the_motors_angle_and_the_sensors_see_motor_torques(tmp_path: Path) -> None:
    made = recipe(arm=BELT, sensors={"velocities": True})
    write_campaign(made, tmp_path / "tank")
    direct = {run.name: run for run in runs(recipe())}["reach"]
    table = np.genfromtxt(tmp_path / "tank/recordings/reach.csv", delimiter=",", names=True)
    np.testing.assert_allclose(table["q2_rad"], direct.state.q[::10, 0] + direct.state.q[::10, 1] / 1.5, atol=1e-8)
    np.testing.assert_allclose(table["tau1_Nm"], (direct.tau[:, 0] - 1.5 * direct.tau[:, 1])[::10], atol=1e-8)
    read = open_campaign(tmp_path / "tank").load("reach")
    np.testing.assert_allclose(read.q, direct.state.q[::10], atol=1e-8)
    assert read.qd is not None
    np.testing.assert_allclose(read.qd, direct.state.qd[::10], atol=1e-7)


def test_sensors_default_to_perfect() -> None:
    assert not Sensors().noise_std(np.ones((5, 2))).any()
