"""One smooth trajectory from all that was recorded of a motion: angles, rates and accelerations, each with its own noise.

    minimise  sum (q - B c)^2 / s_q^2 + sum (qd - B' c)^2 / s_v^2 + sum (qdd - B'' c)^2 / s_a^2        B: quintic B-splines on even knots

The knots lie so closely that the trajectory passes what lies below the band's upper edge and no more; where accelerations are measured
they lie closer, and hold the corners of a motion. Where a channel is missing its sum is absent; of angles that are the integral of the
rates, the mean alone counts. Rows are fewer than samples: accelerations
are brought to them as torques are, by the cosines that the rows hold, since a corner that is sampled folds into the band.

The band itself ends where the acceleration is no longer known:

    N(f) = 1 / (1/N_q + 1/N_v + 1/N_a),   N_q = 2 dt s_q^2 (2 pi f)^4,  N_v = 2 dt s_v^2 (2 pi f)^2,  N_a = 2 dt s_a^2    [(rad/s^2)^2/Hz]
    edge = the highest f at which some joint's acceleration has more than KNOWN^-2 times N(f)

because regressors that are noise bias every coefficient towards 0 by the ratio of noise to motion.

Source: bias of errors in variables, Fuller (1987), section 1.1.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.filtering.cutoff import acceleration_density
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import STATE_OVER_CUTOFF, resample, stretches, surroundings
from nnhydro.recordings.filtering.spline import Channel, RegressionSplines
from nnhydro.recordings.recording import Recording

Array = NDArray[np.float64]
KNOWN = 0.2  # noise to motion, in amplitude, at the band's edge: coefficients are biased by 4 % there and by less below
LOWEST_EDGE, HIGHEST_EDGE = 0.3, 8.0  # Hz: above, corners of a motion are sharper than any record of them
FEWEST_LINES = 6.0  # of the longest stretch, as many as LOWEST_EDGE leaves in 20 s: bands of long records end lower, of short ones higher
ROWS_PER_PERIOD = 8.0  # of the band's edge: laws that bend (friction, drag) spread a motion to higher frequencies
ROW_RATE = 100.0  # Hz at least: between rows a step of dry friction is displaced by 3 ms rms, a fifth of what a drive's filter delays
WIDEST = 50.0  # Hz: the spectrum is looked at up to here
RISE = 2.0  # of the least level: a spectrum that rises again so much has met its noise; a band's mean hardly doubles by chance
TINY = 1e-10  # of the largest level: a computed motion without noise holds nothing below
BANDS_PER_OCTAVE = 4
PASSED_OVER = 7  # bands: between two lines of a periodic motion, whose odd harmonics are a factor of 3 apart, lie 1.6 octaves
NOISE_DRAWS = 4  # of what is left of the records' noise: its variance is averaged over neighbouring frequencies, too
THIRD = np.sqrt(20.0)  # white noise of unit variance has third differences of variance 20


@final
@dataclass(frozen=True)
class Trajectory:
    """Motion on an even grid: t (n,) s, q, qd, qdd (n, links), u0, du0 (n,); `around`: base, heading and water as a segment holds them.

    `others` (2, n, links): the accelerations as recorded and those of the other channels alone, where there are both.
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array
    u0: Array
    du0: Array
    around: dict[str, Array]
    others: Array | None = None
    noise: Array | None = None  # (draws, 3, n, links): what is left in q, qd, qdd of the records' white noise, drawn anew


def step_level(x: Array) -> Array:
    """Return the standard deviation (links,) of white noise with the third differences of `x` (n, links), whose jumps count."""
    made: Array = np.sqrt(np.mean(np.diff(x, n=3, axis=0) ** 2, axis=0)) / THIRD
    return made


def _encoder_step(x: Array) -> float:
    """The smallest step between the values of `x` (n,) where it takes few; 0 where nearly every row has a value of its own."""
    values = np.unique(x)
    steps = np.diff(values)
    return float(steps[steps > 1e-9 * np.ptp(values)].min()) if 1 < len(values) < len(x) / 4 else 0.0


def _grouped_median(x: Array, step: float) -> float:
    """The median of `x` (n,) whose values are known to `step`: interpolated within its group; 0 where that is the lowest."""
    middle = float(np.median(x)) if len(x) else 0.0
    if step == 0 or middle < step / 2:
        return middle
    below, alike = np.mean(x < middle - step / 2), np.mean(np.abs(x - middle) <= step / 2)
    return float(middle - step / 2 + step * (0.5 - below) / alike) if alike > 0 else middle


def white_level(x: Array | None) -> Array | None:
    """Return the standard deviation (links,) of the white noise in `x` (n, links) from its third differences; None where there is none.

    Jumps are no noise. The median of steps of an encoder is that of grouped data: within its step as many lie below as above.
    """
    if x is None:
        return None
    d = np.diff(x, n=3, axis=0)
    size = np.abs(d - np.median(d, axis=0))
    robust = 1.4826 * np.array([_grouped_median(s, step) for s, step in zip(size.T, map(_encoder_step, x.T), strict=True)])
    all_steps = step_level(x)
    level: Array = np.where(robust > 0, np.minimum(robust / THIRD, all_steps), all_steps)
    return level


def _acceleration_noise(f: Array, dt: float, levels: tuple[Array | None, ...], joint: int) -> Array:
    """N(f) of one joint, (rad/s^2)^2/Hz, from the white levels of angle, rate and acceleration."""
    w = 2 * np.pi * f
    known = np.zeros_like(f)
    for level, power in zip(levels, (4, 2, 0), strict=True):
        if level is not None:
            known += 1.0 / np.maximum(2 * dt * level[joint] ** 2 * w**power, 1e-300)
    return 1.0 / np.maximum(known, 1e-300)


def _channel_noise(f: Array, dt: float, levels: tuple[Array | None, ...], joint: int, power: int) -> Array:
    """N(f) of the channel that is differentiated power / 2 times alone: what it shows below this is its own noise."""
    level = levels[len(levels) - 1 - power // 2]
    return np.zeros_like(f) if level is None else 2 * dt * level[joint] ** 2 * (2 * np.pi * f) ** power


def _channels(part: Recording) -> list[tuple[str, Array, int, tuple[Array | None, ...], int]]:
    """Every record of an acceleration: (name, values (n,), power of w, white levels of all records of it, column of these)."""
    joints = tuple(white_level(x) for x in (part.q, part.qd, part.qdd))
    measured = ((None if part.integrated else part.q, 4), (part.qd, 2), (part.qdd, 0))
    found: list[tuple[str, Array, int, tuple[Array | None, ...], int]]
    found = [(f"{power} {joint}", x[:, joint], power, joints, joint)
             for x, power in measured if x is not None for joint in range(part.n_links)]
    carriage = tuple(None if x is None else x[:, None] for x in (part.u0, part.du0))
    for name, (speed, slope) in {"u": carriage, "base": (part.base, part.dbase), "water": (part.current, part.dcurrent)}.items():
        levels = (None, white_level(speed), white_level(slope))
        found += [(f"{power} {name} {column}", x[:, column], power, levels, column)
                  for x, power in ((speed, 2), (slope, 0)) if x is not None for column in range(x.shape[1]) if x[:, column].any()]
    return found


def _plateau(motion: Array) -> float:
    """Return the level at which the spectrum of an acceleration ends its fall, 0 where it falls to its end: motors move arms slowly."""
    there = motion[motion > 0]
    if len(there) < 3:
        return 0.0
    peak = int(np.argmax(there))
    valley = peak + int(np.argmin(there[peak:]))
    return float(there[valley]) if there[valley + 1:].size and there[valley + 1:].max() > RISE * there[valley] else 0.0


def _end(edges: Array, motion: Array, good: NDArray[np.bool_]) -> float:
    """Return where the good bands that hold the largest motion end, 0 without any; one bad band between two lines is passed over."""
    if not good.any():
        return 0.0
    last = int(np.argmax(np.where(good, motion, 0.0)))
    for band in range(last + 1, len(good)):
        if good[band]:
            last = band
        elif band - last >= PASSED_OVER:
            break
    return float(edges[last + 1])


def _octaves_below(lines: float) -> float:
    """Return how many whole octaves below a band of so many `lines` there are until one is left, 0 at least."""
    return float(max(np.floor(np.log2(max(lines, 1.0))), 0.0))


def known_edge(recordings: Iterable[Recording]) -> tuple[float, float, float]:
    """Return the highest frequency, Hz, at which some acceleration is known to `KNOWN`, 0 for none, and the lowest and highest edge."""
    known = list(recordings)
    longest = max((float(recording.t[stop - 1] - recording.t[start]) for recording in known
                   for start, stop in stretches(recording, with_torque=False)), default=0.0)
    first, lowest = (LOWEST_EDGE * 2.0 ** -_octaves_below(LOWEST_EDGE * longest / lines) for lines in (1.0, FEWEST_LINES))
    cap = max(HIGHEST_EDGE, FEWEST_LINES / longest) if longest else HIGHEST_EDGE
    octaves = np.log2(max(WIDEST, 2 * cap) / first)
    edges = first * 2.0 ** (np.arange(0, np.ceil(BANDS_PER_OCTAVE * octaves) + 1) / BANDS_PER_OCTAVE)
    sums: dict[str, tuple[Array, Array, Array]] = {}
    nyquist = np.inf
    for recording in known:
        for start, stop in stretches(recording, with_torque=False):
            part = resample(recording.without_torque(), start, stop)
            dt = float(part.t[1] - part.t[0])
            nyquist = min(nyquist, 0.5 / dt)
            for number, x, power, levels, column in _channels(part):
                f, S = acceleration_density(x, dt, power)
                N = np.maximum(_acceleration_noise(f, dt, levels, column), _channel_noise(f, dt, levels, column, power))
                at = np.digitize(f, edges) - 1
                inside = (at >= 0) & (at < len(edges) - 1)
                counted = [np.bincount(at[inside], w[inside] * part.duration, len(edges) - 1) for w in (S, N, np.ones_like(f))]
                before = sums.get(number, tuple(np.zeros(len(edges) - 1) for _ in range(3)))
                sums[number] = tuple(a + b for a, b in zip(before, counted, strict=True))  # type: ignore[assignment]
    highest = 0.0
    for S_sum, N_sum, count in sums.values():
        motion, noise = (np.where(count > 0, x / np.maximum(count, 1e-300), 0.0) for x in (S_sum, N_sum))
        good = (motion > np.maximum(noise, _plateau(motion)) / KNOWN**2) & (motion > TINY * motion.max())
        highest = max(highest, _end(edges, motion, good))
    return highest, lowest, float(max(lowest, min(cap, 0.9 * nyquist)))


def band_limited(x: Array, rows: int) -> Array:
    """Return `x` (n, c) on `rows` even rows over the same span, the cosines that these do not hold left out."""
    from scipy.fft import dct, idct

    if rows == len(x):
        return x
    c = dct(x, axis=0, norm="ortho")[:rows] * np.sqrt(rows / len(x))
    result: Array = idct(c, axis=0, norm="ortho")
    return result


def _weights(level: Array | None, floor: Array) -> Array:
    """1/level^2 (c,); a channel whose noise is not known counts as if it were `floor`."""
    found: Array = 1.0 / np.maximum(floor if level is None else level, floor) ** 2
    return found


def _around(r: Recording, edge: float, at: Array) -> dict[str, Array]:
    """How the base of `r` moves and turns and the water flows at the times `at` (n,) s, low-passed as the angles of any recording are."""
    from scipy.interpolate import make_interp_spline

    if r.base is None and r.heading is None and r.current is None:
        return {}
    found: dict[str, Any] = surroundings(r, LowPass(STATE_OVER_CUTOFF * edge))
    return {name: np.asarray(make_interp_spline(r.t, x, k=3)(at)) for name, x in found.items()
            if x is not None and name not in ("u0", "du0")}


def _left_of_noise(r: Recording, channels: Sequence[Channel], splines: RegressionSplines) -> Any:
    """The spline of NOISE_DRAWS times all links through white noise of the levels of the records of `r`, weighed as these are."""
    levels = [white_level(x) for x in (r.q, r.qd, r.qdd) if x is not None]
    draws = [np.random.default_rng(seed) for seed in range(NOISE_DRAWS)]
    drawn = [(order, np.concatenate([(0.0 if level is None else level) * rng.standard_normal(x.shape) for rng in draws], axis=1),
              np.tile(weights, NOISE_DRAWS)) for (order, x, weights), level in zip(channels, levels, strict=True)]
    return splines.through(drawn, may_rest=False)


def trajectory(r: Recording, edge: float, rows: int) -> Trajectory:
    """Return the motion of an evenly sampled stretch `r` on `rows` even rows, from all its channels, band-limited above `edge` Hz."""
    t = np.asarray(r.t)
    middle = (np.arange(rows) + 0.5) * len(t) / rows - 0.5  # of each row, in samples
    at = np.clip(t[0] + middle * (t[1] - t[0]), t[0], t[-1])
    spread = np.maximum(np.ptp(r.q, axis=0), 1e-9)
    levels = spread if r.integrated else white_level(r.q), white_level(r.qd), white_level(r.qdd)
    channels = [(order, x, _weights(level, 1e-7 * spread * (2 * np.pi * edge) ** order))
                for order, (x, level) in enumerate(zip((r.q, r.qd, r.qdd), levels, strict=True)) if x is not None]
    orders = [order for order, *_ in channels]
    splines = RegressionSplines.of(t, edge, orders)

    def slope(spline: Any) -> Array:
        """The second derivative of a spline on the rows, (rows, columns)."""
        return band_limited(spline.derivative(2)(t), rows)

    q = splines.through(channels)
    noise = _left_of_noise(r, channels, splines)
    left = np.stack([noise(at), noise.derivative(1)(at), slope(noise)]).reshape(3, rows, NOISE_DRAWS, r.n_links)
    moving = q.derivative(1)(at).any(axis=0)
    u0 = du0 = np.zeros(rows)
    if r.u0 is not None:
        carriage = [(order, x[:, None], _weights(white_level(x[:, None]), np.array([1e-7 * max(np.ptp(r.u0), 1e-6)])))
                    for order, x in ((0, r.u0), (1, r.du0)) if x is not None]
        u = RegressionSplines.of(t, edge, [order for order, *_ in carriage]).through(carriage)
        u0, du0 = u(at)[:, 0], band_limited(u.derivative(1)(t), rows)[:, 0]
    others = None
    if r.qdd is not None:
        others = np.stack([band_limited(r.qdd, rows), slope(RegressionSplines.of(t, edge, orders[:-1]).through(channels[:-1]))])
    return Trajectory(at, q(at), q.derivative(1)(at), slope(q), u0, du0, _around(r, edge, at), others,
                      np.where(moving, left.transpose(2, 0, 1, 3), 0.0))
