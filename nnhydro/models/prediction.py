"""Torques for new motions: one finite row for every row of the input, ends included."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import RecordingError
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.recordings.preprocessing import Preparation, even_grid, plan, prepare, time_steps
from nnhydro.recordings.recording import Recording
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Prediction:
    """Sensor torques `tau` (n, joints) N m at the times `t` (n,) s, and their standard deviation where the model knows it."""

    name: str
    t: Array
    tau: Array
    std: Array | None


def _finite_motion(recording: Recording) -> Recording:
    """The motion alone, refused where a row has no finite time, angle or given derivative."""
    motion = recording.without_torque()
    time_steps(motion)
    for label, channel in (("t_s", motion.t), ("an angle", motion.q), ("a rate", motion.qd), ("an acceleration", motion.qdd),
                           ("u0_m_s", motion.u0), ("du0_m_s2", motion.du0)):
        if channel is not None:
            bad = np.flatnonzero(~np.isfinite(channel.reshape(len(motion), -1)).all(axis=1))
            if len(bad):
                raise RecordingError(f"{recording.origin.path or recording.name}: row {bad[0] + 2}: {label} is empty or infinite: "
                                     "a torque can only be predicted where the motion is known; repair or cut the file")
    return motion


def _bridged(motion: Recording) -> Recording:
    """The motion on an even grid across any gap: a prediction must have a row everywhere."""
    grid = even_grid(np.asarray(motion.t))
    if len(grid) > 4 * len(motion):  # a long gap: as many rows as there are, evenly spaced, would lose the motion; refuse instead
        longest = int(np.argmax(np.diff(motion.t)))
        raise RecordingError(f"{motion.origin.path or motion.name}: a gap of {motion.t[longest + 1] - motion.t[longest]:g} s after row "
                             f"{longest + 2} is longer than the motion around it: split the file there")

    def onto(x: Array | None) -> Array | None:
        if x is None:
            return None
        flat = x.reshape(len(x), -1)
        return np.column_stack([np.interp(grid, motion.t, column) for column in flat.T]).reshape(len(grid), *x.shape[1:])

    q = onto(motion.q)
    assert q is not None
    return replace(motion, t=grid, q=q, qd=onto(motion.qd), qdd=onto(motion.qdd), u0=onto(motion.u0), du0=onto(motion.du0), clock=None)


def _how(model: TorqueModel, motion: Recording) -> Preparation:
    """The model's own preparation; a cut-off chosen from this motion where the model needed none but this motion does."""
    if motion.qd is not None and motion.qdd is not None:
        return Preparation(None)
    return model.preparation if model.preparation.low_pass is not None else plan(iter([motion]))


def _on_segment(model: TorqueModel, segment: Segment) -> tuple[Array, Array | None]:
    motion = Motion.of(segment)
    std = model.std(motion)
    return segment.seen(model.torque(motion).numpy()), None if std is None else std.numpy()


def predict(model: TorqueModel, recording: Recording) -> Prediction:
    """Return the sensor torques of `model` for the motion of `recording` (its torque is ignored), row for row.

    Raises RecordingError where the arm has another number of joints, or where the motion is not finite or not in order of time.
    """
    if recording.n_links != model.arm.n_links:
        raise RecordingError(f"{recording.name}: has {recording.n_links} joint(s), the model's arm has {model.arm.n_links}")
    motion = _finite_motion(recording)
    how = _how(model, motion)
    segments = list(prepare(motion, how, with_torque=False))
    if sum(segment.stop_row - segment.start_row for segment in segments) != len(motion):
        segments = list(prepare(_bridged(motion), how, with_torque=False))
    t = np.concatenate([segment.t for segment in segments])
    parts = [_on_segment(model, segment) for segment in segments]

    def at_rows(values: Array) -> Array:
        return np.column_stack([np.interp(motion.t, t, column) for column in values.T])

    tau = at_rows(np.concatenate([part[0] for part in parts]))
    stds = [part[1] for part in parts if part[1] is not None]
    return Prediction(recording.name, np.asarray(motion.t), tau, at_rows(np.concatenate(stds)) if stds else None)
