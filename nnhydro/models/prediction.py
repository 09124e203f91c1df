"""Torques for new motions: one finite row for every row of the input, ends included."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import TIME, column
from nnhydro.errors import RecordingError, count_text
from nnhydro.models.domain import DOMAIN, Domain
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.recordings.filtering.cutoff import LOWEST
from nnhydro.recordings.filtering.preprocessing import (
    MIN_ROWS,
    Preparation,
    even_rows,
    gaps,
    plan,
    prepare,
    slope_missing,
    stretches,
    time_steps,
)
from nnhydro.recordings.recording import MOTION, SURROUNDINGS, Recording
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.surroundings import with_heading
from nnhydro.runtime.files import write_output

Array = NDArray[np.float64]
SCHEMA = "nnhydro/prediction/1"
Answers = Callable[[Segment], list[Array]]
MOST_ROWS = 1_000_000  # of an even grid across a gap


@final
@dataclass(frozen=True, eq=False)
class PredictedTorque:
    """Sensor torques `tau` (n, joints) N m at the times `t` (n,) s, and their standard deviation where the model knows it."""

    name: str
    t: Array
    tau: Array
    std: Array | None
    sliding: bool = False  # of a linear axis: N
    outside: Array | None = None  # (n,) how far each row lies outside what the model was trained on, 0 to 1; None: the model does not say
    cutoff_hz: float | None = None  # of the motion; None: every derivative was given, nothing was smoothed
    notes: tuple[str, ...] = ()  # where the torques are less certain, and why

    @property
    def outside_share(self) -> float | None:
        """Share of the rows that lie outside what the model was trained on; None where the model does not say."""
        return None if self.outside is None else float((self.outside > 0).mean())

    def document(self) -> dict[str, Any]:
        """Return how the torques were computed, as the JSON file next to them holds it."""
        return {"schema": SCHEMA, "name": self.name, "rows": len(self.t), "cutoff_hz": self.cutoff_hz, "outside_share": self.outside_share,
                "notes": list(self.notes)}


def _finite_motion(recording: Recording) -> Recording:
    """The motion alone, refused where a row has no finite time, angle or given derivative."""
    motion = with_heading(recording.without_torque())
    time_steps(motion)
    named = {"q": "an angle", "qd": "a rate", "qdd": "an acceleration", "u0": "u0_m_s", "du0": "du0_m_s2", "base": "the base's motion",
             "dbase": "the base's acceleration", "heading": "base_yaw_rad", "current": "the current", "dcurrent": "the current's slope"}
    for label, channel in (("t_s", motion.t), *((named[name], getattr(motion, name)) for name in MOTION)):
        if channel is not None:
            bad = np.flatnonzero(~np.isfinite(channel.reshape(len(motion), -1)).all(axis=1))
            if len(bad):
                raise RecordingError(f"{recording.origin.path or recording.name}: row {bad[0] + 2}: {label} is empty or infinite: "
                                     "a torque can only be predicted where the motion is known; repair or cut the file")
    return motion


def _bridge(motion: Recording) -> Recording:
    """The motion on an even grid across gaps and jitter, monotone between its rows: for rows that no stretch of `prepare` holds."""
    from scipy.interpolate import PchipInterpolator

    t = np.asarray(motion.t)
    count = max(even_rows(t), MIN_ROWS)
    if count > max(MOST_ROWS, 4 * len(t)):
        longest = int(np.argmax(np.diff(t)))
        raise RecordingError(f"{motion.origin.path or motion.name}: a gap of {t[longest + 1] - t[longest]:g} s after row "
                             f"{longest + 2} is too long beside the few rows around it: split the file there")
    grid = np.linspace(t[0], t[-1], count)

    def onto(x: Array | None) -> Array | None:
        return None if x is None else np.asarray(PchipInterpolator(t, x)(grid))

    q = onto(motion.q)
    assert q is not None
    others: dict[str, Any] = {name: onto(getattr(motion, name)) for name in MOTION[1:]}
    return replace(motion, t=grid, q=q, clock=None, **others)


def _complete(motion: Recording) -> bool:
    """True where no derivative is missing."""
    return motion.qd is not None and motion.qdd is not None and not slope_missing(motion)


def motion_filter(recording: Recording, cutoff_hz: float | None = None) -> Preparation:
    """Return the cut-off that suits this motion, whose noise and pace need not be those of the campaign that the model was made with.

    A motion with all derivatives is not smoothed unless `cutoff_hz` is given. Raises ConfigError where the motion does not hold it, and
    RecordingError where the motion is not finite or not in order of time.
    """
    motion = _finite_motion(recording)
    return Preparation(None) if cutoff_hz is None and _complete(motion) else plan(iter([motion]), cutoff_hz, predicted=True)


def _notes(motion: Recording, chosen: bool) -> tuple[str, ...]:
    """Where the torques of this motion are less certain; `chosen`: the cut-off was chosen from it."""
    found, spans = [], stretches(motion, with_torque=False)
    jumps = gaps(np.diff(motion.t))
    if len(jumps):
        row = int(jumps[np.argmax(np.diff(motion.t)[jumps - 1])])
        more = f" (and at {count_text(len(jumps) - 1, 'other row')})" if len(jumps) > 1 else ""
        found.append(f"time jumps by {motion.t[row] - motion.t[row - 1]:.3g} s at row {row + 2}{more}: the parts before and after are "
                     "predicted by themselves, as if the motion began anew")
    lost = len(motion) - sum(stop - start for start, stop in spans)
    if lost:
        found.append(f"{count_text(lost, 'row')} in parts of fewer than {MIN_ROWS} rows: their accelerations, and torques, are guesses")
    longest = max((float(motion.t[stop - 1] - motion.t[start]) for start, stop in spans), default=0.0)
    if chosen and longest * LOWEST < 1.0:
        found.append(f"{longest:.2g} s without a gap are too short to tell motion from noise (that takes {1 / LOWEST:g} s): give --cutoff, "
                     "or a longer motion")
    return tuple(f"{motion.name}: {text}" for text in found)


def _whole(motion: Recording, how: Preparation) -> Segment:
    """All of the motion as one segment: as it is given where nothing is smoothed, else bridged."""
    if how.low_pass is not None:
        (segment,) = prepare(_bridge(motion), how, with_torque=False)
        return segment
    n, zero = len(motion), np.zeros(len(motion))
    assert motion.qd is not None
    assert motion.qdd is not None
    around = {name: getattr(motion, name) for name in SURROUNDINGS}
    around |= {name: zero for name in ("u0", "du0") if around[name] is None}
    return Segment(motion.name, motion.t, motion.q, motion.qd, motion.qdd, tau=None, keep=np.ones(n, dtype=bool), stop_row=n, **around)


def _at(times: Array, grid: Array, values: Array) -> Array:
    return np.column_stack([np.interp(times, grid, column) for column in values.T])


def on_rows(answers: Answers, links: int, recording: Recording, how: Preparation) -> list[Array] | None:
    """Return `answers` for the motion of `recording` of an arm with `links` joints, (n, k) each, row for row; None where there are none.

    `how` is its `motion_filter`. Raises RecordingError where the arm has another number of joints, or where the motion is not finite or
    not in order of time.
    """
    if recording.n_links != links:
        raise RecordingError(f"{recording.name}: has {recording.n_links} joint(s), the model's arm has {links}")
    motion = _finite_motion(recording)
    segments = list(prepare(motion, how, with_torque=False))
    if sum(segment.stop_row - segment.start_row for segment in segments) != len(motion):
        segments.insert(0, replace(_whole(motion, how), start_row=0, stop_row=len(motion)))
    found: list[Array] | None = None
    for segment in segments:  # what `_whole` says stands only where no stretch of its own holds the row
        rows = slice(segment.start_row, segment.stop_row)
        on_grid = answers(segment)
        if found is None:
            found = [np.empty((len(motion), x.shape[1])) for x in on_grid]
        for whole, part in zip(found, on_grid, strict=True):
            whole[rows] = _at(motion.t[rows], segment.t, part)
    return found


def predict(model: TorqueModel, recording: Recording, cutoff_hz: float | None = None) -> PredictedTorque:
    """Return the sensor torques of `model` for the motion of `recording` (its torque is ignored), row for row.

    The motion is smoothed at `cutoff_hz`, by default the cut-off that suits its own noise and pace; the torque is not filtered. Raises
    RecordingError where the arm has another number of joints, or where the motion is not finite or not in order of time, and ConfigError
    where it does not hold `cutoff_hz`.
    """
    how = motion_filter(recording, cutoff_hz)
    domain = Domain.parse(model.fit.get(DOMAIN))

    def answers(segment: Segment) -> list[Array]:
        """Return torques N m, the share outside of the training where it is known, and their standard deviation, (n, ...) each."""
        motion = Motion.of(segment)
        far = [] if domain is None else [domain.outside(motion, model.arm)[:, None]]
        tau, std = model.torque_and_std(motion)
        return [tau.numpy(), *far, *([] if std is None else [std.numpy()])]

    found = on_rows(answers, model.arm.n_links, recording, how) or [np.empty((len(recording), model.arm.n_links))]
    tau, *others = found
    outside = None if domain is None or not others else others.pop(0)[:, 0]
    times = np.asarray(recording.t if recording.stamps is None else recording.stamps)
    cutoff = None if how.low_pass is None else how.low_pass.cutoff_hz
    notes = _notes(recording, chosen=cutoff is not None and cutoff_hz is None)
    return PredictedTorque(recording.name, times, tau, others[0] if others else None, model.arm.sliding, outside, cutoff, notes)


def write_prediction(prediction: PredictedTorque, path: Path, inputs: Iterable[Path] = (),
                     more: dict[str, NDArray[np.float64]] | None = None) -> Path:
    """Write t_s, tau1_Nm, ... (tau1_std_Nm, ... and outside where known) and `more` to `path`, whole or not at all; times keep every digit.

    Raises ConfigError where `path` is one of the `inputs` or another file that nnhydro did not write.
    """
    joints = range(1, prediction.tau.shape[1] + 1)
    names = [TIME, *(column("tau", j, prediction.sliding) for j in joints)]
    values = [prediction.t, *prediction.tau.T]
    if prediction.std is not None:
        names += [column("tau_std", j, prediction.sliding) for j in joints]
        values += [*prediction.std.T]
    if prediction.outside is not None:
        names.append("outside")
        values.append(prediction.outside)
    names += [*(more or {})]
    values += [*(more or {}).values()]
    rows = (",".join([repr(float(row[0])), *(f"{x:.9g}" for x in row[1:])]) for row in np.column_stack(values))
    return write_output(path, "\n".join([",".join(names), *rows]) + "\n", inputs)
