"""Records that were computed from others: rates and accelerations by differences and filters of the angles, angles by integrals of rates.

The first are late or smoothed, and add nothing:

    x(b) - x(a) - int_a^b y dt = lag (y(b) - y(a)),     y(t) = dx/dt (t - lag)         means over blocks of `BLOCK`, by least squares

Differences are half a sample late, filters more, and both lower what is quick, which no record of white noise does. A sensor of its own is
in time. Angles that are the integral of the rates hold the noise of these, summed up. All recordings are taken together: they have one
logger.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.filtering.preprocessing import resample, stretches
from nnhydro.recordings.filtering.smoothed_slopes import is_smoothed
from nnhydro.recordings.filtering.trajectory import white_level
from nnhydro.recordings.recording import Recording

Array = NDArray[np.float64]
BLOCK = 0.1  # s
FEWEST = 16  # blocks
SURE = 5.0  # standard deviations of the lag: a campaign has several channels
LEAST = 0.25  # of a sample: differences lag by half of one
INTEGRATED = 0.05  # of what the noise of the rates makes of one change of an angle: rounding; measured angles miss all of it


def _blocks(t: Array, x: Array, slope: Array) -> tuple[Array, Array]:
    """What the integral of `slope` (n,) misses of the change of `x` (n,) from block to block, and how `slope` changes."""
    rows = max(round(BLOCK / float(np.median(np.diff(t)))), 1)
    area = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (slope[1:] + slope[:-1]))])
    step, moved, change = (np.diff(y[:len(t) // rows * rows].reshape(-1, rows).mean(axis=1)) for y in (x, area, slope))
    return np.asarray(step - moved), np.asarray(change)


def lag_of_slope(records: Iterable[tuple[Array, Array, Array]]) -> float:
    """Return by how much y lags dx/dt, s, in `records` of times t (n,) s, x (n,) and y (n,) without gaps; 0 where no lag is certain."""
    parts, dt = [], 0.0
    for t, x, slope in records:
        if len(t) > 1:
            parts.append(_blocks(t, x, slope))
            dt = max(dt, float(np.median(np.diff(t))))
    missed, change = (np.concatenate([part[k] for part in parts]) if parts else np.zeros(0) for k in range(2))
    power = float(change @ change)
    if len(missed) < FEWEST or power <= 0:
        return 0.0
    lag = float(missed @ change) / power
    deviation = np.sqrt(float(((missed - lag * change) ** 2).sum()) / (len(missed) - 1) / power)
    return lag if abs(lag) > max(SURE * deviation, LEAST * dt) else 0.0


def _lags(recordings: Sequence[Recording], of: str, slope: str) -> Array:
    """By how much the channel `slope` of each joint lags the channel `of`, (joints,) s; nothing where one is missing."""
    pairs = [(r, x, y) for r in recordings if (x := getattr(r, of)) is not None and (y := getattr(r, slope)) is not None]
    parts = [(np.asarray(recording.t[start:stop]), x[start:stop], y[start:stop]) for recording, x, y in pairs
             for start, stop in stretches(recording, with_torque=False)]
    joints = pairs[0][1].shape[1] if pairs else 0
    return np.array([lag_of_slope((t, x[:, joint], y[:, joint]) for t, x, y in parts) for joint in range(joints)])


def _is_smooth(recordings: Sequence[Recording], of: str, slope: str) -> bool:
    """Whether the channel `slope` of some joint was smoothed, seen from the channel `of`; False where one is missing."""
    parts = [resample(recording.without_torque(), start, stop) for recording in recordings
             if getattr(recording, of) is not None and getattr(recording, slope) is not None
             for start, stop in stretches(recording, with_torque=False)]
    pairs = [(float(part.t[1] - part.t[0]), getattr(part, of), getattr(part, slope)) for part in parts]
    joints = parts[0].n_links if parts else 0
    return any(is_smoothed((dt, x[:, joint], y[:, joint]) for dt, x, y in pairs) for joint in range(joints))


@final
@dataclass(frozen=True)
class LeftOut:
    """Why rates or accelerations were left out: largest lags behind the angles, s, whether smoothed; or whether angles are integrals."""

    rates_lag: float = 0.0
    accelerations_lag: float = 0.0
    smoothed: bool = False
    integrated: bool = False

    def sentence(self) -> str:
        """Return what was left out as a sentence; empty where nothing was."""
        late = [f"the recorded {name} lag the angles by {1e3 * lag:.1f} ms"
                for name, lag in (("rates", self.rates_lag), ("accelerations", self.accelerations_lag)) if lag]
        if late:
            said = " and ".join(late)
            return f"{said[0].upper()}{said[1:]}, as differences do: they were left out."
        if self.integrated:
            return "The recorded angles are the integral of the recorded rates: only the rates count as measured."
        return "The recorded rates or accelerations were smoothed: they were left out." if self.smoothed else ""

    def taken_from(self, recordings: Sequence[Recording]) -> list[Recording]:
        """Return `recordings` without what was left out."""
        return [replace(recording, qd=None if self.rates_lag or self.smoothed else recording.qd,
                        qdd=None if self.accelerations_lag or self.smoothed else recording.qdd, integrated=self.integrated)
                for recording in recordings]


def _missed_by_integral(t: Array, q: Array, qd: Array) -> Array:
    """What the integral of qd (n, links) rad/s misses of the changes of q (n, links) rad, (links,), over what the noise of qd makes of one.

    NaN where the rates have no noise, as of a joint at rest.
    """
    dt, level = np.diff(t)[:, None], white_level(qd)
    assert level is not None
    missed = np.sqrt(np.mean((np.diff(q, axis=0) - dt * (qd[1:] + qd[:-1]) / 2) ** 2, axis=0))
    made: Array = np.full(len(level), np.nan)
    return np.divide(missed, float(np.median(dt)) * level, out=made, where=level > 0)


def are_integrals(recordings: Sequence[Recording]) -> bool:
    """Return whether the angles of `recordings` are the integral of their rates by the trapezoidal rule.

    An encoder's angles miss at least the noise of the rates. No difference of angles makes such rates, so that these are the measurement.
    """
    missed = [_missed_by_integral(recording.t[start:stop], recording.q[start:stop], recording.qd[start:stop]) for recording in recordings
              if recording.qd is not None for start, stop in stretches(recording, with_torque=False) if stop - start >= FEWEST]
    by_joint = [values[np.isfinite(values)] for values in np.transpose(missed)] if missed else []
    moving = [values for values in by_joint if len(values)]
    return bool(moving) and all(float(np.median(values)) < INTEGRATED for values in moving)


def without_computed_slopes(recordings: Sequence[Recording]) -> tuple[list[Recording], LeftOut]:
    """Return the recordings without rates and accelerations that lag the angles or were smoothed, integrated angles marked, and why.

    What is early stays: no logger computes ahead.
    """
    if are_integrals(recordings):
        why = LeftOut(integrated=True)
        return why.taken_from(recordings), why
    rates, more = _lags(recordings, "q", "qd"), _lags(recordings, "qd", "qdd")
    step = max((float(np.median(np.diff(recording.t))) for recording in recordings if len(recording) > 1), default=0.0)
    rates_lag, later = float(rates.max(initial=0.0)), float((rates[:len(more)] + more).max(initial=0.0))
    smooth = _is_smooth(recordings, "q", "qd") or _is_smooth(recordings, "qd", "qdd")  # who smooths one smooths both
    why = LeftOut(rates_lag, later if later > LEAST * step else 0.0, smooth)
    return why.taken_from(recordings), why
