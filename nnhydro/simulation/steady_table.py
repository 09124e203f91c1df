"""The table of a grid of steady runs: mean torque over each run, and the scatter within it.

    mean  = T + std z / sqrt(N),   scatter = std sqrt(chi2_{N-1} / (N - 1)),   N = duration x sample rate        [N m]

The scatter is what a recording of that run would show: noise of the sensor, not the error of the mean.
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import column
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.transmission import sensor_torque
from nnhydro.recordings.arm import Arm
from nnhydro.simulation.motions.motion_kind import State
from nnhydro.simulation.motions.steady import SteadyRuns
from nnhydro.simulation.sensors import RecordedRun, Sensors, channels

Array = NDArray[np.float64]


def steady_torque(state: State, arm: Arm, loads: Loads) -> Array:
    """Return what perfect torque sensors read in the steady runs `state`, (n, joints) N m."""
    motion = Motion.at(*state)
    return np.asarray(sensor_torque(loads.torque(Flow(arm, motion)), tensor(state.qd), arm).numpy())


def steady_table(runs: SteadyRuns, arm: Arm, loads: Loads, sensors: Sensors, sample_rate_hz: float,
                 rng: np.random.Generator) -> RecordedRun:
    """Return the table of `runs` as recorded; the column tau.._std_Nm is there where the sensors are noisy."""
    state = runs.states(arm.n_links)
    clean = sensors.with_bias(steady_torque(state, arm, loads))
    std, samples = sensors.noise_std(clean), max(int(runs.duration_s * sample_rate_hz), 2)
    mean = clean + std / np.sqrt(samples) * rng.standard_normal(clean.shape)
    scatter = std * np.sqrt(rng.chisquare(samples - 1, clean.shape) / (samples - 1))
    given = {"q": channels(state.q, arm), "qd": channels(state.qd, arm)}
    motion = {arm.column(key, j + 1): x[:, j] for key, x in given.items() for j in range(arm.n_links)}
    torque = {arm.column("tau", j + 1): mean[:, j] for j in range(arm.n_links)}
    if std.any():
        torque |= {arm.column("tau_std", j + 1): scatter[:, j] for j in range(arm.n_links)}
    return RecordedRun(runs.name, {**motion, column("u0"): state.u0}, torque, clean)
