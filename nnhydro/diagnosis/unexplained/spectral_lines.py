"""A hum: a line in the spectrum of what remains, at one frequency in all recordings whatever the motion.

    S_k = sum_r I_rk / background_rk,     p = K min_k max(Q(R, S_k), F(2R, 8R; S_k / B_k)),     Q the upper regularised gamma function

I_rk is the periodogram of recording r at the frequency k of K; over a smooth background its ordinates are exponential, so that sums over R
recordings are gamma distributed. The background is the median of the ordinates around, the line's own left out, beside the trend of all
recordings: the noise of angles rises to the band's edge. A state of the arm makes such a line only at the frequencies at which all
recordings move, a free pendulum's own and its harmonics: where the acceleration has a line, none is reported. Nor is a wider peak, such as
that of an irregular sea: a line also stands out from B_k, the mean of four ordinates so close to it that it is just over there.
Source: Fisher (1929), Proc. R. Soc. A 125, pooled over recordings; ours.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import FORM, P_ALARM
from nnhydro.diagnosis.decision.heldout_errors import Residual
from nnhydro.recordings.filtering.periodogram import hann, hann_power

Array = NDArray[np.float64]
LOWEST = 1.0  # Hz: lowest line; below lie the motions and slow drifts
AROUND, WIDTH = 12, 2  # ordinates on either side that make the background; ordinates next to the line that do not
ADJACENT = (-WIDTH - 3, -WIDTH - 1, WIDTH + 1, WIDTH + 3)  # ordinates where a line is over, nearly independent under the window
WELL_INSIDE = 0.95  # highest line in edges of the band, next to which the cut leaks
TREND = 3  # degree of the trend in logarithms
HEAVY = 1.4  # heavier tail of the ratios than exponential, since few ordinates make the background: measured on noise
TESTS = 4  # tests of the mismatch in all: two of the search, and one for lines at each of two joints
MOST = 0.5  # largest share of a line in one recording: a line is in all of them
FEWEST_ROWS, FEWEST = 64, 4  # fewest rows of a recording, and fewest recordings


@final
@dataclass(frozen=True)
class Line:
    """The strongest line in one joint's residual: p of "there is none", Hz, its amplitude N m, its share."""

    joint: int
    p_value: float
    frequency_hz: float
    amplitude: float
    share: float  # of the residual's energy

    @property
    def material(self) -> bool:
        """Whether it is significant and large enough to be reported."""
        return TESTS * self.p_value <= P_ALARM and self.share >= FORM

    def sentence(self) -> str:
        """Return it in words."""
        return (f"a hum of {self.amplitude:.2g} N m at {self.frequency_hz:.2f} Hz in the torque of joint {self.joint}: a spectral line in "
                "all recordings")


def _trend(records: Sequence[tuple[Array, float]], highest: float) -> Callable[[Array], Array]:
    """The smooth part of the spectra of records (x, dt) up to `highest` Hz, which a line in a few ordinates does not bend.

        ln I(f) = sum_(i <= TREND) c_i (ln f)^i        by least squares with a soft L1 loss
    """
    from scipy.optimize import least_squares

    found = []
    for x, dt in records:
        f, power = hann_power(x - x.mean(), dt, zero_ends=False)
        inside = (f > 0) & (f <= highest) & (power > 0)
        if inside.sum() > AROUND:
            found.append((np.log(f[inside]), np.log(power[inside]) - np.log(power[inside]).mean()))
    if not found:
        return np.ones_like
    u, level = (np.concatenate(parts) for parts in zip(*found, strict=True))
    start = np.polynomial.Polynomial.fit(u, level, TREND)

    def away(c: Array) -> Array:
        """Return how far the polynomial of the coefficients `c` lies from the ordinates."""
        made: Array = np.polynomial.Polynomial(c, start.domain, start.window)(u) - level
        return made

    bent = least_squares(away, np.asarray(start.coef, np.float64), loss="soft_l1").x
    made = np.polynomial.Polynomial(bent, start.domain, start.window)
    return lambda f: np.asarray(np.exp(made(np.log(np.maximum(f, np.exp(u.min()))))), np.float64)


def _ratios(x: Array, dt: float, highest: float, trend: Callable[[Array], Array] = np.ones_like) -> tuple[Array, Array, Array, Array]:
    """Frequencies (k,) Hz up to `highest`, ordinates over their background, the same next to each, N m of lines that would make them."""
    f, power = hann_power(x - x.mean(), dt, zero_ends=False)
    inside = max(int(np.searchsorted(f, highest, side="right")), AROUND + 1)
    f, power = f[:inside], power[:inside]
    flat = power / trend(f)
    padded, ended = np.pad(flat, AROUND, mode="reflect"), np.pad(flat, AROUND, constant_values=np.nan)
    around = np.stack([padded[AROUND + k:AROUND + k + len(power)] for k in range(-AROUND, AROUND + 1) if abs(k) > WIDTH])
    background = np.maximum(np.median(around, axis=0) / np.log(2), 1e-300)
    adjacent = np.nanmean([ended[AROUND + k:AROUND + k + len(power)] for k in ADJACENT], axis=0)
    amplitude: Array = 2 * np.sqrt(power) / hann(len(x), zero_ends=False).sum()
    return f, flat / background, adjacent / background, amplitude


def _moves(parts: Sequence[Residual], grid: Array, highest: float) -> NDArray[np.bool_]:
    """Return at which frequencies of `grid`, Hz, the accelerations of the recordings together have a line."""
    from scipy.special import gammaincc

    made = np.zeros(len(grid), dtype=bool)
    for name in parts[0].state:
        if name.startswith("ddq"):
            spectra = [_ratios(part.state[name], part.dt, highest) for part in parts]
            S = np.sum([np.interp(grid, f, ratio) for f, ratio, *_ in spectra], axis=0)
            made |= len(grid) * gammaincc(len(parts), S / HEAVY) <= P_ALARM
    return made


def _with_background(parts: Sequence[Residual], highest: float) -> list[Residual]:
    """Return the recordings that are long enough to have a background below `highest` Hz: in a few ordinates no line is reported."""
    return [part for part in parts if len(part.r) * part.dt * highest > AROUND]


def strongest(parts: Sequence[Residual], joint: int, edge: float = np.inf, flat: Sequence[Residual] | None = None) -> Line | None:
    """Return the strongest line in the residual of `joint` (from 0), which holds what lies below `edge` Hz.

    It is looked for in `flat`, the residuals with all frequencies divided by their noise, where these are given. None where recordings are
    too few or too short.
    """
    from scipy.special import fdtrc, gammaincc

    long = [part for part in parts if part.dt > 0 and len(part.r) >= FEWEST_ROWS]
    highest = WELL_INSIDE * min([edge, *(0.5 / part.dt for part in long)])
    used = _with_background(long, highest)
    if len(used) < FEWEST or highest <= LOWEST:
        return None
    spectra = [_ratios(part.r[:, joint], part.dt, highest) for part in used]
    looked_in = used if flat is None else _with_background([part for part in flat if part.dt > 0 and len(part.r) >= FEWEST_ROWS], highest)
    trend = _trend([(part.r[:, joint], part.dt) for part in looked_in], highest)
    whitened = [_ratios(part.r[:, joint], part.dt, highest, trend) for part in looked_in]
    longest = max(len(part.r) * part.dt for part in used)
    grid = np.arange(LOWEST, highest, 1 / longest)
    at = [np.interp(grid, f, ratio) for f, ratio, *_ in whitened]
    S, B = np.sum(at, axis=0), np.sum([np.interp(grid, f, adjacent) for f, _, adjacent, _ in whitened], axis=0)
    shared = (np.max(at, axis=0) <= MOST * S) & ~_moves(used, grid, highest)
    if not shared.any():
        return None
    n = len(used)
    p = np.where(shared, np.maximum(gammaincc(n, S / HEAVY), fdtrc(2 * n, 2 * n * len(ADJACENT), S / np.maximum(B, 1e-300))), 1.0)
    best = int(np.lexsort((-S, p))[0])
    amplitude = float(np.median([np.interp(grid[best], f, a) for f, *_, a in spectra]))
    energy = float(np.mean(np.concatenate([part.r[:, joint] for part in used]) ** 2))
    return Line(joint + 1, float(min(1.0, len(grid) * p[best])), float(grid[best]), amplitude, amplitude**2 / 2 / max(energy, 1e-300))

