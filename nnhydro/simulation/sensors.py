"""What the recorder writes of a run: encoders, torque sensors, sampling. Angles are the arm's own channels (a belt's motor angle).

    psi_2 = q_1 + q_2 / r           second angle channel where arm.yaml says angle2: absolute          [rad]
    T(t)  = [H * (T_true + bias)](t - delay) + noise          H  causal Butterworth low-pass           [N m]

Source: McLain & Rock (1998), section 2; Rivera (1995), sections 3.3 and 4.1 (channels); the rest is ours.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from nnhydro.conventions import CLOCK, TIME, column
from nnhydro.errors import require
from nnhydro.physics.motion import tensor
from nnhydro.physics.transmission import sensor_torque
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.readers.validation import Settings
from nnhydro.simulation.recipe.per_joint import PerJoint, PerJointMagnitude, spread
from nnhydro.simulation.run import Run

Array = NDArray[np.float64]
JITTER_SIGMAS = 3.0  # jitter is clipped there, so that time cannot run backward
MAX_JITTER = 0.1  # of a sample


class Sensors(Settings):
    """The sensors of the rig; a number given once serves all joints. Everything defaults to perfect."""

    encoder_counts_per_rev: PerJointMagnitude | None = None
    velocities: bool = False  # dq columns are written, as they are
    accelerations: bool = False  # ddq and du0 columns are written, as they are
    torque_noise_Nm: PerJointMagnitude = (0.0,)  # standard deviation
    torque_noise_share: PerJointMagnitude = (0.0,)  # standard deviation over the channel's rms in the recording; adds in quadrature
    torque_bias_Nm: PerJoint = (0.0,)
    torque_low_pass_hz: float | None = Field(default=None, gt=0, le=1e5)
    torque_low_pass_order: int = Field(default=2, ge=1, le=8)
    torque_delay_s: float = Field(default=0.0, ge=0, le=10)
    jitter_s: float = Field(default=0.0, ge=0, le=10)  # standard deviation of the instants of sampling; the times written are true
    dropout_share: float = Field(default=0.0, ge=0, le=0.5)  # of the rows, missing in the file
    dropout_s: float = Field(default=0.1, gt=0, le=10)  # length of one dropout

    def require_fit(self, arm: Arm, sample_rate_hz: float, fine_rate_hz: float) -> None:
        """Raise ConfigError naming the key that fits neither the arm's joints nor the rates."""
        for key in ("torque_noise_Nm", "torque_noise_share", "torque_bias_Nm", "encoder_counts_per_rev"):
            if getattr(self, key) is not None:
                spread(getattr(self, key), arm.n_links, f"sensors.{key}")
        counts = self.encoder_counts_per_rev
        require(counts is None or all(n >= 4 for n in counts), "sensors.encoder_counts_per_rev: give at least 4, or leave the key out")
        require(self.torque_low_pass_hz is None or self.torque_low_pass_hz < 0.45 * fine_rate_hz, f"sensors.torque_low_pass_hz: must be "
                f"below 0.45 of the simulation's {fine_rate_hz:.6g} Hz: raise substeps or leave the key out")
        require(self.jitter_s * sample_rate_hz <= MAX_JITTER, f"sensors.jitter_s: {self.jitter_s:g} s is more than a tenth of a sample: "
                f"give at most {MAX_JITTER / sample_rate_hz:g}")

    def noise_std(self, torque: Array) -> Array:
        """Return the standard deviation (joints,) N m of the noise on the clean channels `torque` (n, joints) N m."""
        joints = torque.shape[1]
        share = spread(self.torque_noise_share, joints, "sensors.torque_noise_share") * np.sqrt((torque**2).mean(axis=0))
        return np.asarray(np.hypot(spread(self.torque_noise_Nm, joints, "sensors.torque_noise_Nm"), share))

    def with_bias(self, torque: Array) -> Array:
        """Return the sensors' torque (n, joints) N m with their bias."""
        return torque + spread(self.torque_bias_Nm, torque.shape[1], "sensors.torque_bias_Nm")


@final
@dataclass(frozen=True, eq=False)
class RecordedRun:
    """What was recorded of one run, column by column, and the torque channels without their noise."""

    name: str
    motion: dict[str, Array]  # t_s, q.., u0..: (n,)
    torque: dict[str, Array]  # tau.._Nm: (n,)
    clean: Array  # (n, joints) N m


def channels(q: Array, arm: Arm) -> Array:
    """Return the angle (or rate) channels (n, joints) of the joint-relative `q` (n, joints): the inverse of what readers do."""
    if arm.drive.angle2 == "relative":
        return q
    return np.column_stack([q[:, 0], q[:, 0] + q[:, 1] / arm.drive.pulley_ratio])


def _instants(run: Run, sensors: Sensors, substeps: int, rng: np.random.Generator) -> Array:
    """Times of sampling (m,) s; the first and the last are exact."""
    t = run.t[::substeps].copy()
    draws = rng.standard_normal(len(t)).clip(-JITTER_SIGMAS, JITTER_SIGMAS)
    t[1:-1] += sensors.jitter_s * draws[1:-1]
    return t


def _surviving_rows(t: Array, sensors: Sensors, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Rows that reach the file; dropouts spare both ends."""
    keep = np.ones(len(t), dtype=bool)
    span = float(t[-1] - t[0])
    length = min(sensors.dropout_s, sensors.dropout_share * span)
    for start in rng.uniform(t[0], t[-1] - length, round(sensors.dropout_share * span / length)) if length > 0 else ():
        keep &= ~((t >= start) & (t < start + length))
    keep[[0, 1, -2, -1]] = True
    return keep


def _lag(run: Run, torque: Array, sensors: Sensors, t: Array) -> Array:
    """The torque channels (m, joints) at the times `t`, low-passed and late; before t = 0 they had their first value."""
    if sensors.torque_low_pass_hz is not None:
        from scipy.signal import butter, sosfilt, sosfilt_zi

        sos = butter(sensors.torque_low_pass_order, sensors.torque_low_pass_hz, fs=run.rate_hz, output="sos")
        torque = np.asarray(sosfilt(sos, torque, axis=0, zi=sosfilt_zi(sos)[:, :, None] * torque[0])[0])
    return np.column_stack([np.interp(t - sensors.torque_delay_s, run.t, tau) for tau in torque.T])


def _motion_columns(run: Run, arm: Arm, sensors: Sensors, t: Array) -> dict[str, Array]:
    """Angles as the encoders step, and whichever derivatives the recorder gives, at the times `t` (m,) s."""
    from scipy.interpolate import CubicHermiteSpline

    s = run.state
    angle = channels(np.asarray(CubicHermiteSpline(run.t, s.q, s.qd)(t)), arm)
    if sensors.encoder_counts_per_rev is not None:
        count = 2 * np.pi / np.floor(spread(sensors.encoder_counts_per_rev, arm.n_links, "sensors.encoder_counts_per_rev"))
        angle = np.round(angle / count) * count
    given = {"q": angle}
    if sensors.velocities:
        given["qd"] = channels(np.asarray(CubicHermiteSpline(run.t, s.qd, s.qdd)(t)), arm)
    if sensors.accelerations:
        given["qdd"] = channels(np.column_stack([np.interp(t, run.t, x) for x in s.qdd.T]), arm)
    out = {TIME: t, **{arm.column(key, j + 1): x[:, j] for key, x in given.items() for j in range(arm.n_links)}}
    if s.u0.any():
        out[column("u0")] = np.interp(t, run.t, s.u0)
        if sensors.accelerations:
            out[column("du0")] = np.interp(t, run.t, s.du0)
    return out if run.start is None else out | {CLOCK: run.start + t}


def record(run: Run, arm: Arm, sensors: Sensors, substeps: int, rng: np.random.Generator) -> RecordedRun:
    """Return what `sensors` record of `run` at every `substeps`-th of its rows."""
    t = _instants(run, sensors, substeps, rng)
    true = sensor_torque(tensor(run.tau), tensor(run.state.qd), arm).numpy()
    clean = _lag(run, sensors.with_bias(true), sensors, t)
    noisy = clean + sensors.noise_std(clean) * rng.standard_normal(clean.shape)
    keep = _surviving_rows(t, sensors, rng)
    motion = {name: x[keep] for name, x in _motion_columns(run, arm, sensors, t).items()}
    return RecordedRun(run.name, motion, {arm.column("tau", j + 1): noisy[keep, j] for j in range(arm.n_links)}, clean[keep])
