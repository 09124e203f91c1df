"""Given rates that do not fit the angles: another unit, the wrong sign, another scale, noise, or a lag.

    q(b) - q(a) = r int_a^b dq dt        over blocks of 0.1 s;  r = 1 where both are right
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from nnhydro.recordings.checks.degrees import too_wide
from nnhydro.recordings.checks.oddity import Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Array, Reading
from nnhydro.recordings.checks.sampling import ROWS_A_PERIOD, rows_a_period
from nnhydro.recordings.filtering.computed_slopes import lag_of_slope
from nnhydro.recordings.readers.map_line import mapping_text

WINDOW = 0.1  # s
MOVED = 0.02  # rad: below, there is nothing to compare
FOLLOWS = 0.8  # correlation below which a rate does not belong to its angle
AGREEING = 0.97  # share of the windows that must agree
NOISY = 0.1  # of the rate's rms
DEGREE = np.pi / 180
KNOWN: tuple[tuple[float, str, dict[str, str | float]], ...] = (
    (-1.0, "has the wrong sign", {"sign": -1}), (DEGREE, "is in deg/s", {"unit": "deg/s"}),
    (2 * np.pi / 60, "is in rpm", {"unit": "rpm"}), (2 * np.pi, "is in rev/s", {"unit": "rev/s"}))
TOLERANCE = 0.1  # relative


class Fit(NamedTuple):
    """How rate and angle of one joint go together."""

    ratio: float
    correlation: float
    noise: float  # rad/s, scatter of the rate about the angle's own over a window
    rms: float  # rad/s
    lag: float  # s; 0 where none is certain


def fit(reading: Reading, joint: int) -> Fit | None:
    """Return the regression of the angle's increments on the integrated rate; None where the joint hardly moves."""
    r = reading.recording
    assert r.qd is not None
    steps, areas, noises = [], [], []
    for start, stop in reading.stretches:
        t, q, qd = np.asarray(r.t[start:stop]), r.q[start:stop, joint], r.qd[start:stop, joint]
        area = np.concatenate([[0.0], np.cumsum(0.5 * (qd[1:] + qd[:-1]) * np.diff(t))])
        at = np.arange(0, len(t), max(round(WINDOW / reading.dt), 1))
        moves = np.diff(q[at]) != 0  # a frozen encoder says nothing about the rate
        steps.append(np.diff(q[at])[moves])
        areas.append(np.diff(area[at])[moves])
        noises.append(np.diff(qd, n=2) / np.sqrt(6))
    if not steps or reading.moved[joint] < MOVED:
        return None
    dq, da = np.concatenate(steps), np.concatenate(areas)
    if len(dq) < 5:
        return None
    if not da.any():
        return Fit(np.inf, 0.0, 0.0, 0.0, 0.0)
    ratio = _ratio(dq, da)
    near = np.argsort(np.abs(dq - ratio * da))[: int(len(dq) * AGREEING)]  # jumps of the encoder aside
    dq, da = dq[near], da[near]
    power = float(np.sqrt((da**2).sum() * (dq**2).sum()))
    return Fit(ratio, float((dq * da).sum()) / power if power > 0 else 0.0, float(np.std(np.concatenate(noises))),
               float(np.sqrt(np.nanmean(r.qd[:, joint] ** 2))),
               lag_of_slope((np.asarray(r.t[a:b]), r.q[a:b, joint], r.qd[a:b, joint]) for a, b in reading.stretches))


def _ratio(dq: Array, da: Array) -> float:
    """Median of dq / da, each weighted by |da|: a few jumps do not move it."""
    dq, da = dq[da != 0], da[da != 0]
    order = np.argsort(dq / da)
    weight = np.cumsum(np.abs(da[order]))
    return float((dq / da)[order][int(np.searchsorted(weight, 0.5 * weight[-1]))])


@check
class Rates(RecordingCheck):
    """dq must be the time derivative of q."""

    id = "rates"
    looks_for = "rates in another unit, of the wrong sign or scale, noisy, or late"
    remedy = "map it, or remove the column: rates are derived from the angles"

    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield one finding a joint."""
        if reading.recording.qd is None or reading.dt > 0.5:
            return
        for joint in range(reading.arm.n_links):
            found = fit(reading, joint) if rows_a_period(reading, joint) > ROWS_A_PERIOD else None
            if found is not None:
                yield from self._judge(reading, joint, found)

    def _judge(self, reading: Reading, joint: int, found: Fit) -> Iterator[Oddity]:
        """What is wrong with a rate channel, from its regression on the derivative of the angle."""
        name, angle = reading.arm.column("qd", joint + 1), reading.arm.column("q", joint + 1)
        if found.rms == 0:
            yield Oddity(reading.name, "warning", name, f"is 0 throughout while {angle} moves by {reading.moved[joint]:.2g} rad",
                         "is it a default of the logger? Remove the column: rates are derived from the angles")
        elif abs(found.correlation) < FOLLOWS:
            yield Oddity(reading.name, "warning", name, f"does not follow the derivative of {angle} (correlation {found.correlation:.2f})",
                         "is it another joint's, or delayed? Remove the column: rates are derived from the angles")
        elif abs(found.ratio * DEGREE - 1) < TOLERANCE:
            if not too_wide(reading.recording.q[:, joint]):
                yield Oddity(reading.name, "error", angle, f"is {1 / DEGREE:.1f} times the integral of {name}: the angle is in degrees",
                             f"map it, {mapping_text(reading.recording.origin, angle, unit='deg')}",
                             in_file=f"convert {angle} from degrees to rad in the file")
        elif abs(found.ratio - 1) > TOLERANCE:
            what, how = next(((w, h) for value, w, h in KNOWN if abs(found.ratio / value - 1) < TOLERANCE),
                             ("has another scale (a gear?)", {"scale": float(f"{found.ratio:.4g}")}))
            yield Oddity(reading.name, "warning", name, f"{what}: the derivative of {angle} is {found.ratio:.4g} times the column",
                         f"map it, {mapping_text(reading.recording.origin, name, **how)}, or remove the column: "
                         "rates are derived from the angles",
                         in_file=f"correct {name} in the file, or remove the column there")
        elif found.noise > NOISY * found.rms:
            yield Oddity(reading.name, "note", name, f"is noisy: {found.noise:.2g} rad/s from row to row at {found.rms:.2g} rad/s rms",
                         "the source of the rates is chosen by the lower noise; leave the column out if in doubt")
        elif found.lag > 0:
            yield Oddity(reading.name, "note", name, f"lags the derivative of {angle} by {1e3 * found.lag:.1f} ms",
                         "the logger computed it from the angles: a diagnosis takes these alone")
