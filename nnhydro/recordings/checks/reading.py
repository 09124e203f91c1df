"""What a check sees of one recording: the recording, the arm, and what several checks need of it, computed once."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import CHANNELS, column
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import stretches
from nnhydro.recordings.readers.table import FIRST_ROW
from nnhydro.recordings.recording import PAIRS, Recording
from nnhydro.recordings.surroundings import with_heading

Array = NDArray[np.float64]
CHANNEL_FIELDS = ("t", *CHANNELS, *PAIRS, "clock")
MOVED = 0.02  # rad by which a joint moved while its angle stood still
FAR, FAR_CODE = 50.0, 5.0  # times the farthest of the rest from the median: a wild value; the same for 999, -9999, ...
FEW, SELDOM, LEAST = 3, 1e-3, 20  # wild values that any recording may have; share of the rows that may be so; rows to judge by
WIDE = 1.0  # rad or m: an angle that is wild jumps farther than a glitch
BLOCK = 0.02  # s: increments over so long a time are read off encoders without most of their noise


@final
@dataclass(frozen=True)
class Reading:
    """One recording and its arm."""

    recording: Recording  # infinities are NaN here, and wild values the line between their neighbours
    arm: Arm
    wild: dict[str, list[tuple[int, float]]] = field(default_factory=dict)  # (row, value) of wild values by column

    @staticmethod
    def of(r: Recording, arm: Arm) -> "Reading":
        """Return what checks see of `r`."""
        channels = {name: x for name in CHANNEL_FIELDS if (x := getattr(r, name, None)) is not None}
        endless: dict[str, Any] = {name: np.where(np.isinf(x), np.nan, x) for name, x in channels.items() if np.isinf(x).any()}
        finite = replace(r, **endless) if endless else r
        calm, wild = _without_wild(finite, arm)
        return Reading(with_heading(calm), arm, wild)

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self.recording.name

    @cached_property
    def dt(self) -> float:
        """Median step of time, s; nan where there is none."""
        steps = np.diff(self.recording.t)
        steps = steps[np.isfinite(steps) & (steps > 0)]
        return float(np.median(steps)) if len(steps) else float("nan")

    @cached_property
    def ordered(self) -> bool:
        """Whether time runs forward throughout (NaN aside)."""
        steps = np.diff(self.recording.t)
        return bool((steps[np.isfinite(steps)] > 0).all())

    @cached_property
    def stretches(self) -> tuple[tuple[int, int], ...]:
        """Gap-free, finite stretches of rows; none where time is out of order."""
        return stretches(self.recording) if self.ordered else ()

    def channels(self) -> Iterator[tuple[str, Array]]:
        """Yield (column, values) of every channel there is, joints one by one."""
        for key in CHANNELS:
            values = getattr(self.recording, key, None)
            if isinstance(values, np.ndarray):
                if values.ndim == 2:
                    for joint in range(values.shape[1]):
                        yield self.arm.column(key, joint + 1), values[:, joint]
                else:
                    yield column(key), values
        for key, pair in PAIRS.items():
            values = getattr(self.recording, key)
            if values is not None:
                yield from zip((column(channel) for channel in pair), values.T, strict=True)

    @cached_property
    def at_zero(self) -> tuple[str, ...]:
        """Names of the columns that are 0 throughout, empty cells aside."""
        return tuple(name for name, x in self.channels() if not np.nan_to_num(x).any())

    def blocks(self, start: int, stop: int) -> NDArray[np.int64]:
        """Return row numbers about `BLOCK` seconds apart within one stretch."""
        step = max(round(BLOCK / self.dt), 1)
        return np.arange(start, stop, step)

    @cached_property
    def moved(self) -> Array:
        """Range of every angle, rad (links,); 0 where nothing is finite."""
        q = self.recording.q
        return np.array([np.ptp(x[np.isfinite(x)]) if np.isfinite(x).any() else 0.0 for x in q.T])

    def turned_by_rate(self, joint: int, span: tuple[int, int]) -> float:
        """Return how far the given rate takes `joint` (from 0) away within rows `span` (start, stop), rad; 0 if none is given."""
        r, (a, b) = self.recording, span
        if r.qd is None:
            return 0.0
        qd, steps = r.qd[a:b, joint], np.diff(r.t[a:b])
        return float(np.abs(np.nancumsum(0.5 * (qd[1:] + qd[:-1]) * steps)).max(initial=0.0))

    @cached_property
    def towed(self) -> bool:
        """Whether the carriage moves, or any other base or the water."""
        r = self.recording
        return any(x is not None and bool(np.nanmax(np.abs(x), initial=0.0) > 1e-3) for x in (r.u0, r.base, r.current))

    @property
    def surrounded(self) -> bool:
        """Whether base or water move in another way than a carriage along +Y."""
        return self.recording.base is not None or self.recording.current is not None


def wild_rows(x: Array) -> NDArray[np.int64]:
    """Return the rows (k,) of the few values of `x` (n,) that lie far outside all others; none where there are many such."""
    good = np.flatnonzero(np.isfinite(x))
    if len(good) < LEAST:
        return np.zeros(0, dtype=np.int64)
    away = np.abs(x[good] - np.median(x[good]))
    most = max(FEW, int(SELDOM * len(good)))
    far = np.argsort(away)[::-1][:most + 1]
    usual = float(np.median(away))
    for k in range(most, 0, -1):
        rest, nearest = float(away[far[k]]), float(away[far[k - 1]])
        coded = all(_is_code(float(x[good[row]])) for row in far[:k])
        if usual > 0 and nearest > (FAR_CODE if coded else FAR) * rest:
            return np.sort(good[far[:k]])
    return np.zeros(0, dtype=np.int64)


def _is_code(value: float) -> bool:
    """Whether a value is one of those that loggers write for none: 999, -9999, 99999, ..."""
    return bool(value == round(value) and len(text := str(abs(round(value)))) >= 3 and set(text) == {"9"})


def _without_wild(r: Recording, arm: Arm) -> tuple[Recording, dict[str, list[tuple[int, float]]]]:
    """The recording with straight lines in the place of wild values, and these by column."""
    wild: dict[str, list[tuple[int, float]]] = {}
    calm: dict[str, Any] = {}
    for key in CHANNELS:
        values = getattr(r, key, None)
        if not isinstance(values, np.ndarray):
            continue
        columns = values.reshape(len(values), -1)
        for joint in range(columns.shape[1]):
            at = wild_rows(columns[:, joint])
            if key == "q" and len(at):
                at = at[np.abs(columns[at, joint] - np.nanmedian(columns[:, joint])) > WIDE]
            if not len(at):
                continue
            wild[arm.column(key, joint + 1) if values.ndim == 2 else column(key)] = [(int(row), float(columns[row, joint])) for row in at]
            made = calm.setdefault(key, columns.copy())
            good = np.setdiff1d(np.flatnonzero(np.isfinite(columns[:, joint])), at)
            made[at, joint] = np.interp(at, good, columns[good, joint])
    changed = {key: made.reshape(getattr(r, key).shape) for key, made in calm.items()}
    return (replace(r, **changed) if changed else r), wild


def rows(start: int, stop: int | None = None) -> str:
    """Return 'row 5' or 'rows 5 to 9', `start` and the last row before `stop` counted from 0, printed as a spreadsheet counts."""
    last = start if stop is None else stop - 1
    return f"row {start + FIRST_ROW}" if last <= start else f"rows {start + FIRST_ROW} to {last + FIRST_ROW}"


def runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (start, stop) of every run of True in `flags`."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def quantum(x: Array) -> float:
    """Return the smallest step between neighbouring distinct values of `x`, 0 where it is constant."""
    steps = np.abs(np.diff(x[np.isfinite(x)]))
    steps = steps[steps > 0]
    return float(np.percentile(steps, 1)) if len(steps) else 0.0
