"""How a campaign is recorded: what sensors make of the torques, and the files of a campaign."""

from pathlib import Path
from typing import Any

import numpy as np
from answers import answer_of, sizes_of_torques
from campaign import Campaign, Run, Sensors, simulate
from machines import Array, yaml_of
from scipy.interpolate import CubicSpline
from scipy.signal import butter, lfilter, sosfiltfilt

SEED = 140000  # of what is drawn in a campaign, with its place in the order added
CARRIAGE_NOISE = 0.001  # m/s
Columns = dict[str, Array]


def noise_like(rng: np.random.Generator, sensors: Sensors, shape: tuple[int, ...]) -> Array:
    """Noise of unit size: coloured or heavy-tailed as the sensors say."""
    if sensors.tails:
        return rng.standard_t(sensors.tails, size=shape) / np.sqrt(sensors.tails / (sensors.tails - 2))
    if not sensors.ar:
        return rng.normal(size=shape)
    raw = rng.normal(size=(shape[0] + 200, shape[1])) * np.sqrt(1 - sensors.ar * sensors.ar)
    return lfilter([1], [1, -sensors.ar], raw, axis=0)[200:]


def times_of_rows(campaign: Campaign, seconds: float, rng: np.random.Generator) -> Array:
    """The times of the recorded rows."""
    rows, rate, uneven = int(seconds * campaign.rate_hz), campaign.rate_hz, campaign.sensors.uneven
    t = np.arange(rows) / rate
    if uneven:
        t = np.sort(t + np.clip(rng.normal(0, uneven / rate, rows), -0.4 / rate, 0.4 / rate))
        t -= t[0]
    return t


def read_torques(campaign: Campaign, run: Run, tau: Array, noise: Array, size: Array) -> Array:
    """The torques as recorded, with their noise."""
    read = tau + noise
    if campaign.sensors.smooth_hz:
        read = sosfiltfilt(butter(2, campaign.sensors.smooth_hz / (campaign.rate_hz / 2), output="sos"), read, axis=0)
    if campaign.sensors.torque_quantum:
        read = np.round(read / (campaign.sensors.torque_quantum * size)) * (campaign.sensors.torque_quantum * size)
    return 0 * read if run.state.free else read


def at_times(t: Array, run: Run, values: Array) -> Array:
    """Values of all joints at times t, linearly between those of the fine grid."""
    return np.stack([np.interp(t, run.state.t, column) for column in values.T], 1)


def columns_of(pattern: str, values: Array) -> Columns:
    """The columns of all joints by name."""
    return {pattern.format(j + 1): column for j, column in enumerate(values.T)}


def recorded_columns(campaign: Campaign, run: Run, size: Array, loudness: float,
                     rng: np.random.Generator) -> tuple[Columns, Columns, Columns]:
    """The columns of one recording: all but the torques, the torques as recorded, and the true ones."""
    sensors, state = campaign.sensors, run.state
    t = times_of_rows(campaign, run.motion.seconds, rng)
    q, tau, dq, ddq = CubicSpline(state.t, run.q)(t), *(at_times(t, run, values) for values in (run.tau, state.dq, state.ddq))
    if campaign.machine.remote:
        q, dq, ddq = (np.cumsum(values, 1) for values in (q, dq, ddq))
    noise = noise_like(rng, sensors, tau.shape) * (sensors.noise * size) * loudness
    read = read_torques(campaign, run, tau, noise, size)
    phase = rng.uniform(0, 1)
    q = (np.round(q / sensors.quantum + phase) - phase) * sensors.quantum
    columns = {"t_s": t}
    if sensors.clock:
        columns["clock_s"] = state.clock[0] + t
    columns |= columns_of("q{}_rad", q)
    if sensors.rates:
        columns |= columns_of("dq{}_rad_s", dq + np.stack([rng.normal(0, sensors.rates, t.size) for _ in dq.T], 1))
    if sensors.accelerations:
        columns |= columns_of("ddq{}_rad_s2", ddq + np.stack([rng.normal(0, sensors.accelerations, t.size) for _ in ddq.T], 1))
    if any(motion.carriage for motion in (*campaign.motions, *campaign.unseen)):
        columns["u0_m_s"] = np.interp(t, state.t, state.u0) + (rng.normal(0, CARRIAGE_NOISE, t.size) if run.motion.carriage else 0)
    return columns, columns_of("tau{}_Nm", read), columns_of("tau{}_Nm", tau)


def write_table(path: Path, columns: Columns) -> None:
    """Write columns as CSV, nine digits a number."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, np.stack(list(columns.values()), 1), "%.9g", ",", header=",".join(columns), comments="")


def write_campaign(campaign: Campaign, target: Path, place: int) -> dict[str, Any]:
    """Compute the torques, record them, write the campaign as number `place` and return its answer."""
    rng, folder = np.random.default_rng(SEED + place), target / f"case_{place:03d}"
    folder.mkdir()
    (folder / "arm.yaml").write_text(yaml_of(campaign.machine, folder.name, rng))
    runs = simulate(campaign, rng)
    seen = len(campaign.motions)
    _, size = sizes_of_torques(campaign, runs[:seen])
    for k, run in enumerate(runs):
        loudness = campaign.sensors.loudness[k % len(campaign.sensors.loudness)]
        columns, read, true = recorded_columns(campaign, run, size, loudness, rng)
        if k < seen:
            write_table(folder / "recordings" / f"run{k:02d}_{run.motion.name}.csv", {**columns, **read})
        else:
            name = f"new{k - seen}_{run.motion.name}.csv"
            write_table(folder / "unseen" / name, columns)
            write_table(target / "truth_of_unseen" / folder.name / name, {"t_s": columns["t_s"], **true})
    return answer_of(campaign, runs[:seen])
