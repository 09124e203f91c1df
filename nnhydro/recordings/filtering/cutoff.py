"""Choose the low-pass cut-off from the data: the one that makes the derived accelerations least wrong.

    E(f_c) = sum_f [ N(f) g(f; f_c)^2 + max(S(f) - N(f), 0) (1 - g(f; f_c))^2 ]

    S   spectrum of the acceleration: (2 pi f)^4 times that of the angle, or (2 pi f)^2 times that of a measured rate
    N   its noise, a power law a f^p fitted where the spectrum rises again: motors move arms slowly, differentiation
        amplifies noise, so S falls to a valley and rises beyond it (p = 4 for white angle noise, less for time jitter)
    g   gain of the low-pass

The first term is the noise that passes, the second the motion that is lost (Wiener's criterion for Butterworth gains). Channels
enter by the logarithm of E, so that one spike in one recording does not decide. For one motion whose torque is to be predicted, E is first
added over its joints: the noise of a joint at rest is small, and must not take what another one moves. Of angles and measured rates, the
source with the smaller error is taken. Source: ours.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import ConfigError, require
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.periodogram import hann, hann_power

Array = NDArray[np.float64]
HIGHEST = 25.0  # Hz, McLain & Rock's cut-off: arms driven by motors hold little above it
LOWEST = 1.0  # Hz
SIGNAL_OVER_NOISE = 2.0  # a band counts as motion from here on: the mean of a dozen noisy lines hardly doubles by chance
BANDS_PER_OCTAVE = 4


def require_cutoff(cutoff_hz: float, spans: Iterable[tuple[float, float]]) -> None:
    """Raise ConfigError for a cut-off that no recording holds; `spans` are (step of time, duration) in s of the recordings.

    Above half the sampling rate there is nothing to filter, and below one period in the longest recording nothing is left to compare.
    """
    seen = [(dt, duration) for dt, duration in spans if dt > 0 and duration > 0]
    if not seen:
        return
    highest, lowest = 0.5 / min(dt for dt, _ in seen), 1.0 / max(duration for _, duration in seen)
    choose = "or none to have it chosen from the data"
    require(cutoff_hz <= highest, f"cut-off {cutoff_hz:g} Hz: lies above half the sampling rate, {highest:.4g} Hz: give a lower --cutoff, "
            f"{choose}", ConfigError)
    require(cutoff_hz >= lowest, f"cut-off {cutoff_hz:g} Hz: the longest recording ({1 / lowest:.4g} s) holds less than one period of it: "
            f"give a higher --cutoff, {choose}", ConfigError)


@final
@dataclass(frozen=True)
class CutoffChoice:
    """The chosen cut-off and which channel gave it."""

    cutoff_hz: float
    source: str  # "q" or "qd"


def acceleration_density(x: Array, dt: float, power: int) -> tuple[Array, Array]:
    """Return frequencies in Hz (without 0) and one-sided density, (rad/s^2)^2/Hz, of the acceleration in the straightened `x` (n,).

    `power` of w: 4 for an angle, 2 for a rate, 0 for an acceleration.
    """
    n = len(x)
    f, ordinates = hann_power(x - np.linspace(x[0], x[-1], n), dt)
    density = 2.0 * dt * ordinates / (hann(n) ** 2).sum()
    spectrum: Array = density * (2 * np.pi * f) ** power
    return f[1:], spectrum[1:]


def _bands(f: Array, spectrum: Array) -> tuple[Array, Array, Array]:
    """Centre (Hz), mean power of a line and number of lines of each band of a quarter octave, from half the lowest cut-off on."""
    top = max(float(f[-1]), LOWEST) if len(f) else LOWEST
    edges = np.exp2(np.arange(np.log2(LOWEST) - 1, np.log2(top) + 1 / BANDS_PER_OCTAVE, 1 / BANDS_PER_OCTAVE))
    index = np.digitize(f, edges)
    lines = np.bincount(index, minlength=len(edges) + 1)[1:]
    power = np.bincount(index, spectrum, minlength=len(edges) + 1)[1:]
    there = lines > 0
    return edges[there] * 2 ** (0.5 / BANDS_PER_OCTAVE), power[there] / lines[there], lines[there].astype(float)


def noise_law(centre: Array, level: Array) -> Array:
    """Return the noise part a f^p, 0 <= p <= 4, of an acceleration spectrum in bands at `centre` (Hz); zero where none rises.

    The law is fitted from the valley beyond the largest band up to 0.8 of the highest frequency.
    """
    low = centre <= 0.8 * centre[-1] if len(centre) else np.zeros(0, dtype=bool)
    x, y = centre[low], level[low]
    if len(y) < 3:
        return np.zeros_like(centre)
    top = int(np.argmax(y[: max(len(y) // 2, 1)]))
    valley = top + int(np.argmin(y[top:]))
    if len(y) - valley < 3 or y[-1] <= 2.0 * y[valley]:
        return np.zeros_like(centre)
    slope = float(np.clip(np.polyfit(np.log(x[valley:]), np.log(y[valley:]), 1)[0], 0.0, 4.0))
    height = float(np.exp(np.mean(np.log(y[valley:]) - slope * np.log(x[valley:]))))
    result: Array = height * centre**slope
    return result


def _errors(x: Array, dt: float, power: int, grid: Array) -> Array:
    """E(f_c) of one channel on the `grid` of cut-offs, (rad/s^2)^2."""
    f, density = acceleration_density(x, dt, power)
    centre, level, lines = _bands(f, density / (len(x) * dt))  # the power of a line
    noise = noise_law(centre, level)
    motion = np.where(level > SIGNAL_OVER_NOISE * noise, level - noise, 0.0)
    gain = np.stack([LowPass(float(c)).gain(centre) for c in grid])
    errors = (lines * (noise * gain**2 + motion * (1.0 - gain) ** 2)).sum(axis=1)
    result: Array = np.maximum(errors, 1e-12 * (lines * level).sum() + 1e-30)  # a locked joint: log(0)
    return result


def _log_error(x: Array, dt: float, power: int, grid: Array, added: bool) -> Array:
    """log E(f_c) of a recording, channels `x` (n, links): of the sum over its joints if `added`, else the sum of the joints' own."""
    errors = np.stack([_errors(joint, dt, power, grid) for joint in x.T])
    made: Array = np.log(errors.sum(axis=0)) if added else np.log(errors).sum(axis=0)
    return made


def choose_cutoff(channels: Iterable[tuple[Array, Array | None, float]], added: bool = False) -> CutoffChoice:
    """Return the cut-off for evenly sampled channels (q (n, links), qd (n, links) or None, dt), one tuple a recording.

    `added`: the errors of the joints are added first, as the torque of one motion has them.
    """
    grid = np.geomspace(LOWEST, HIGHEST, 60)
    total = {"q": np.zeros(len(grid)), "qd": np.zeros(len(grid))}
    highest, all_rates = HIGHEST, True
    for q, qd, dt in channels:
        highest = min(highest, 0.2 / dt)
        all_rates = all_rates and qd is not None
        total["q"] += len(q) * _log_error(q, dt, 4, grid, added)
        total["qd"] += len(q) * _log_error(qd, dt, 2, grid, added) if qd is not None else 0.0
    if not all_rates:
        total.pop("qd")
    allowed = grid <= max(highest, LOWEST)
    best = {name: int(np.argmin(np.where(allowed, error, np.inf))) for name, error in total.items()}
    source = min(best, key=lambda name: float(total[name][best[name]]))
    return CutoffChoice(round(float(grid[best[source]]), 2), source)
