"""Make segments of a recording: even grid, derivatives, and the one low-pass through which torque and model are compared.

Angles are low-passed at twice the cut-off and differentiated by the derivative of a quintic spline, which is exact to 0.1 % up to
a quarter of the sampling rate (a first difference loses 10 % of an acceleration at 9 Hz and 100 Hz sampling). Torque and model
then pass through the low-pass at the cut-off itself, where the first filter has a gain of 0.996: what remains of the first
filter does not bias the comparison. Without a torque nothing is compared: a smoothing spline then takes the motion at the cut-off
itself, and the torque of the model is not filtered.

Source: McLain & Rock (1998), section 2 (zero-phase low-pass, half-sample shift); the two cut-offs and the spline are ours.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import RecordingError, count_text
from nnhydro.recordings.filtering.cutoff import choose_cutoff, require_cutoff
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.spline import SmoothingSpline
from nnhydro.recordings.recording import MOTION, Recording, SteadyTable
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.surroundings import with_heading

Array = NDArray[np.float64]
Smoother = LowPass | SmoothingSpline
GAP = 10.0  # a step of time longer than so many median steps is a gap: recordings are split there
SHUFFLED, REVERSED = 0.1, 0.9  # of the steps that run backward: two logs in one file give one, rows at random half of them
CLOSE = 0.25  # of the median step: nearer rows count as one
EVEN = 1e-3  # steps that differ by less than this share of the median count as even
MOST_FILLED, SMALL = 100, 1_000_000  # even rows for one that was recorded, at the most; rows that are never too many
MIN_ROWS = 12  # a shorter stretch holds no acceleration worth the name
STATE_OVER_CUTOFF = 2.0  # angles are low-passed at so many times the cut-off of the comparison
TRIM_PERIODS = 3.0  # so many periods of the cut-off are not compared at either end


@final
@dataclass(frozen=True)
class Preparation:
    """How recordings become segments: the low-pass (None: everything was given, nothing is filtered) and the source of the rates."""

    low_pass: LowPass | None
    rates_from: str = "q"  # "q": differentiate the angles even where rates are given; "qd": take the given rates

    def document(self) -> dict[str, object]:
        """Return the preparation as model files store it."""
        return {"low_pass": None if self.low_pass is None else self.low_pass.document(), "rates_from": self.rates_from}

    @staticmethod
    def parse(document: dict[str, object]) -> "Preparation":
        """Return the preparation that `document()` stored."""
        stored = document.get("low_pass")
        low_pass = LowPass(float(stored["cutoff_hz"]), int(stored["order"])) if isinstance(stored, dict) else None
        return Preparation(low_pass, str(document.get("rates_from", "q")))


def time_steps(r: Recording) -> Array:
    """Return the steps of time (n-1,) in s; raise RecordingError where time repeats or runs backward."""
    steps = np.diff(r.t)
    wrong = np.flatnonzero(~(steps > 0) & np.isfinite(steps))
    if len(wrong):
        row = int(wrong[0])
        kind = "repeats" if steps[row] == 0 else "runs backward"
        raise RecordingError(f"{r.name}: time {kind} at row {row + 2} (t_s = {r.t[row]:g}, then {r.t[row + 1]:g}; "
                             f"{count_text(len(wrong), 'such row')}): {order_remedy(steps)}")
    return steps


def order_remedy(steps: Array) -> str:
    """Return what to do about steps of time (n-1,) that are not all positive: a few are another log, many another order."""
    backward = float((steps < 0).mean())
    if backward > REVERSED:
        return "the file is in reverse order: sort its rows by t_s"
    if backward > SHUFFLED:
        return "the rows are not in the order of time: sort them by t_s"
    return "two logs in one file, or a clock that was set? Split the file there or drop the rows"


def gaps(steps: Array) -> NDArray[np.int64]:
    """Return the numbers, from 0, of the rows before which time jumps; `steps` (n-1,) s are the differences of the times."""
    median = float(np.median(steps[np.isfinite(steps)])) if np.isfinite(steps).any() else 1.0
    return np.flatnonzero(~(steps < GAP * median)) + 1


def stretches(r: Recording, with_torque: bool = True) -> tuple[tuple[int, int], ...]:
    """Return (first row, one past the last row) of each stretch of `r` that holds neither gaps nor NaN."""
    steps = time_steps(r)
    good = np.isfinite(r.t) & np.isfinite(r.q).all(axis=1)
    for channel in (getattr(r, name) for name in MOTION + (("tau", "tau_sim") if with_torque else ())):
        if channel is not None:
            good &= np.isfinite(channel.reshape(len(r), -1)).all(axis=1)
    edges = sorted({0, len(r), *gaps(steps).tolist(), *(np.flatnonzero(np.diff(good.astype(int))) + 1).tolist()})
    return tuple((a, b) for a, b in pairwise(edges) if good[a] and b - a >= MIN_ROWS)


def even_rows(t: Array) -> int:
    """Return how many even rows with about the median step reach from the first to the last time (at most 10^15)."""
    with np.errstate(over="ignore"):
        ratio = (t[-1] - t[0]) / np.median(np.diff(t))
    return max(round(float(min(ratio, 1e15))), 1) + 1


def even_grid(t: Array, name: str) -> Array:
    """Return an even grid from the first to the last time with about the median step, (m,) s.

    Raises RecordingError naming the recording `name` where a few tiny steps would make far more even rows than were recorded.
    """
    count = even_rows(t)
    if count > max(MOST_FILLED * len(t), SMALL):
        raise RecordingError(f"{name}: its {len(t)} rows from t_s = {t[0]:g} to {t[-1]:g} are mostly {np.median(np.diff(t)):.3g} s apart, "
                             f"which would make {count:.3g} even ones: the clock jumps; split the file where it does, or correct t_s")
    grid: Array = np.linspace(t[0], t[-1], count)
    return grid


def _is_even(t: Array) -> bool:
    """Whether the time steps are equal but for rounding."""
    steps = np.diff(t)
    median, mean = float(np.median(steps)), float(t[-1] - t[0]) / (len(t) - 1)
    if not median > 0:  # time out of order, which `time_steps` explains
        return False
    return float(np.ptp(steps)) <= 2 * EVEN * median and abs(mean / median - 1) < EVEN


def derivatives(x: Array, dt: float, order: int) -> Array:
    """Return the derivative of the given order of `x` (n, ...) on a grid of `dt` s, from an interpolating quintic spline."""
    from scipy.interpolate import make_interp_spline

    t = np.arange(len(x)) * dt
    result: Array = np.asarray(make_interp_spline(t, x, k=5).derivative(order)(t))
    return result


def _merge_close_rows(t: Array, channels: Mapping[str, Array | None]) -> tuple[Array, dict[str, Array | None]]:
    """Return times and channels with the mean of rows nearer than `CLOSE` of the median step in place of these.

    Noise on two such rows would make a slope between them that no curve through both can follow.
    """
    steps = np.diff(t)
    starts = np.flatnonzero(np.concatenate([[True], steps >= CLOSE * np.median(steps)]))
    count = np.diff(np.append(starts, len(t)))

    def mean(x: Array) -> Array:
        """Return the mean of the rows of x (n, ...) that lie together."""
        made: Array = np.add.reduceat(x, starts, axis=0) / count.reshape(-1, *[1] * (x.ndim - 1))
        return made

    return mean(t), {name: None if x is None else mean(x) for name, x in channels.items()}


def resample(r: Recording, start: int, stop: int) -> Recording:
    """Return rows start..stop-1 of `r` on an even grid, by cubic splines.

    Between rows at random times a straight line would lose (pi f dt)^2 / 3 of a sine: 1 % at 18 rows per period.
    """
    from scipy.interpolate import make_interp_spline

    part = r.rows(slice(start, stop), f"rows {start} to {stop}")
    t = np.asarray(part.t)
    if _is_even(t):
        return replace(part, t=np.linspace(t[0], t[-1], len(t)))
    grid = even_grid(t, r.name)
    merged, channels = _merge_close_rows(t, {name: getattr(part, name) for name in (*MOTION, "tau", "tau_sim")})
    even: dict[str, Any] = {name: None if x is None else np.asarray(make_interp_spline(merged, x, k=min(3, len(merged) - 1))(grid))
                            for name, x in channels.items()}
    return replace(part, t=grid, **even, clock=None, steps=(*part.steps, f"resampled to {1 / (grid[1] - grid[0]):.6g} Hz"))


def _rates(r: Recording, how: Preparation, state: Smoother | None) -> tuple[Array, Array, Array]:
    """Angles, rates and accelerations of an evenly sampled recording, passed through `state`."""
    dt = float(r.t[1] - r.t[0])
    if state is None:
        if r.qd is not None and r.qdd is not None:
            return r.q, r.qd, r.qdd
        qd = r.qd if r.qd is not None else derivatives(r.q, dt, 1)
        return r.q, qd, derivatives(r.q, dt, 2) if r.qdd is None else r.qdd
    q = state.apply(r.q, dt)
    measured = r.qd is not None and (how.rates_from == "qd" or r.qdd is not None)
    qd = state.apply(r.qd, dt) if measured and r.qd is not None else derivatives(q, dt, 1)
    if r.qdd is not None:
        return q, qd, state.apply(r.qdd, dt)
    return q, qd, derivatives(qd, dt, 1) if measured else derivatives(q, dt, 2)


def _rate_and_slope(rate: Array | None, slope: Array | None, dt: float, state: Smoother | None) -> tuple[Array | None, Array | None]:
    """A speed (n, ...) of what carries the arm, low-passed as angles are, and its time derivative, given or derived."""
    if rate is None:
        return None, None
    smooth = rate if state is None else state.apply(rate, dt)
    if slope is None:
        return smooth, derivatives(smooth, dt, 1)
    return smooth, slope if state is None else state.apply(slope, dt)


def surroundings(r: Recording, state: Smoother | None) -> dict[str, Any]:
    """Return what a segment holds of base and water of the evenly sampled recording `r`, passed through `state`, with accelerations."""
    dt, zero = float(r.t[1] - r.t[0]), np.zeros(len(r))
    u0, du0 = _rate_and_slope(r.u0, r.du0, dt, state)
    base, dbase = _rate_and_slope(r.base, r.dbase, dt, state)
    current, dcurrent = _rate_and_slope(r.current, r.dcurrent, dt, state)
    return {"u0": zero if u0 is None else u0, "du0": zero if du0 is None else du0, "base": base, "dbase": dbase, "heading": r.heading,
            "current": current, "dcurrent": dcurrent}


def _compared_rows(n: int, dt: float, how: Preparation) -> NDArray[np.bool_]:
    """Rows that are compared: all but those at both ends where the filter is still settling."""
    keep = np.ones(n, dtype=bool)
    if how.low_pass is not None:
        trim = min(int(np.ceil(TRIM_PERIODS / (how.low_pass.cutoff_hz * dt))), n // 4)
        keep[:trim] = False
        keep[n - trim:] = False
    return keep


def _state_filter(how: Preparation, with_torque: bool) -> Smoother | None:
    """What the motion passes before it is differentiated; None where nothing is filtered."""
    if how.low_pass is None:
        return None
    if not with_torque:
        return SmoothingSpline(how.low_pass.cutoff_hz)
    return LowPass(STATE_OVER_CUTOFF * how.low_pass.cutoff_hz, how.low_pass.order)


def prepare(r: Recording, how: Preparation, with_torque: bool = True) -> Iterator[Segment]:
    """Yield the segments of `r`: even, gap-free, with derivatives, torque filtered; raise RecordingError where time is out of order.

    Without the torque nothing is compared: the motion passes the cut-off itself, and the segments have no low-pass.
    """
    r = with_heading(r if with_torque else r.without_torque())
    state = _state_filter(how, with_torque)
    compared = how if with_torque else Preparation(None)
    for start, stop in stretches(r, with_torque):
        part = resample(r, start, stop)
        dt = float(part.t[1] - part.t[0])
        q, qd, qdd = _rates(part, how, state)
        around = surroundings(part, state)

        def smooth(x: Array | None, dt: float = dt) -> Array | None:
            return x if x is None or how.low_pass is None else how.low_pass.apply(x, dt)

        yield Segment(r.name, np.asarray(part.t), q, qd, qdd, tau=smooth(part.tau) if with_torque else None,
                      keep=_compared_rows(len(part), dt, compared), low_pass=compared.low_pass,
                      tau_sim=smooth(part.tau_sim) if with_torque else None,
                      tau_raw=part.tau if with_torque else None, start_row=start, stop_row=stop, **around)


def steady_segment(table: SteadyTable) -> Segment:
    """Return the rows of a steady table as one segment without accelerations: nothing is filtered, every row is compared."""
    n = len(table)
    return Segment(table.name, np.arange(n, dtype=float), table.q, table.qd, np.zeros_like(table.q), table.u0, np.zeros(n), table.tau,
                   np.ones(n, dtype=bool), None, table.tau_sim, table.tau, True, 0, n, base=table.base, heading=table.heading,
                   current=table.current)


def needs_filter(r: Recording) -> bool:
    """True where something has to be derived from, or interpolated between, the rows of `r`."""
    t = np.asarray(r.t[np.isfinite(r.t)])
    uneven = len(t) > 1 and not _is_even(t)
    return r.qd is None or r.qdd is None or slope_missing(r) or uneven


def slope_missing(r: Recording) -> bool:
    """Return whether base, carriage or water move and their acceleration is not given."""
    return any(getattr(r, name) is not None and getattr(r, f"d{name}") is None for name in ("u0", "base", "current"))


def plan(recordings: Iterator[Recording], cutoff_hz: float | None = None, predicted: bool = False) -> Preparation:
    """Return how the recordings of a campaign are prepared: not filtered where all is given, else with the cut-off that suits the data.

    `cutoff_hz` overrides the choice; ConfigError where no recording holds it. Where the torques are to be `predicted`, the errors of the
    joints are added. Streams: one recording is held at a time.
    """
    needed, spans = cutoff_hz is not None, list[tuple[float, float]]()

    def channels() -> Iterator[tuple[Array, Array | None, float]]:
        """Yield angles, rates and time step s of every stretch, and note whether one needs the filter."""
        nonlocal needed
        for recording in recordings:
            needed = needed or needs_filter(recording)
            motion = recording.without_torque()  # its torques may hold empty cells
            for start, stop in stretches(motion, with_torque=False):
                part = resample(motion, start, stop)
                spans.append((float(part.t[1] - part.t[0]), part.duration))
                yield part.q, part.qd, float(part.t[1] - part.t[0])

    choice = choose_cutoff(channels(), added=predicted)
    if cutoff_hz is not None:
        require_cutoff(cutoff_hz, spans)
    if not needed:
        return Preparation(None)
    return Preparation(LowPass(choice.cutoff_hz if cutoff_hz is None else cutoff_hz), choice.source)
