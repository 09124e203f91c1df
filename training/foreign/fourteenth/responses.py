"""What remembers: bristles of a seal, the travel of strips, a boundary layer, and vortices; with coefficients from the literature."""

import numpy as np
from machines import Array
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.signal import fftconvolve

TRAVELS = np.arange(7) * 8 / 6  # in diameters
# C_D and C_M over the travel since rest, of McLain & Rock (1998)
CD_OF_TRAVEL = CubicSpline(TRAVELS, [0, 0.430, 0.894, 1.018, 0.809, 0.748, 0.78], bc_type=((2, 0.0), (1, 0.0)))
CM_OF_TRAVEL = CubicSpline(TRAVELS, [1, 0.840, 0.460, 0.205, 0.276, 0.332, 0.36], bc_type=((2, 0.0), (1, 0.0)))
# Achenbach's and Wieselsberger's smooth-to-slightly-rough cylinder, read at round Reynolds numbers
CD_OF_LOG_REYNOLDS = PchipInterpolator(np.log10([1e3, 3e3, 1e4, 3e4, 6e4, 1e5, 1.4e5, 1.8e5, 2.3e5, 3e5, 5e5, 1e6]),
                                       [0.98, 0.96, 1.11, 1.2, 1.22, 1.2, 1.1, 0.86, 0.62, 0.55, 0.63, 0.75])


def lugre(rate: Array, dt: float, sliding: float, breakaway: float, stribeck_rate: float, stiffness: float, damping: float) -> Array:
    """LuGre's friction, by exact steps of the bristle at constant rate."""
    bristle, out = 0.0, np.zeros(len(rate))
    for k in range(len(rate)):
        level = sliding + (breakaway - sliding) * np.exp(-((rate[k] / stribeck_rate) ** 2))
        pace = stiffness * abs(rate[k]) / level
        decay = np.exp(-pace * dt)
        new = bristle * decay + (rate[k] * dt if pace * dt < 1e-9 else rate[k] / pace * (1 - decay))
        out[k] = stiffness * new + damping * (new - bristle) / dt
        bristle = new
    return out


def travel_since_reversal(w: Array, dt: float, diameter: float) -> Array:
    """Distance of every strip since the start or its last reversal, in diameters."""
    total = np.cumsum(np.abs(w), 0) * dt
    sign = np.sign(np.where(np.abs(w) < 1e-9, 0, w))
    out, last, old = np.zeros_like(total), np.zeros(w.shape[1]), np.zeros(w.shape[1])
    for k in range(len(total)):
        new = (sign[k] != 0) & (sign[k] != old)
        last = np.where(new, total[k - 1] if k else 0, last)
        old = np.where(sign[k] != 0, sign[k], old)
        out[k] = total[k] - last
    return out / diameter


def half_derivative(rate: Array, dt: float) -> Array:
    """The integral of rate'(s) / sqrt(t - s) ds, rate' constant in each step (exact product integration)."""
    n = len(rate)
    slope = np.diff(rate, prepend=rate[0]) / dt
    kernel = 2 * np.sqrt(dt) * (np.sqrt(np.arange(1, n + 1)) - np.sqrt(np.arange(n)))
    return fftconvolve(slope, kernel)[:n]


def wake_oscillator(w: Array, diameter: float, strouhal: float, dt: float, rng: np.random.Generator, cells: int = 8) -> Array:
    """Facchinetti's van der Pol oscillator at twice the Strouhal frequency in coupled cells along the span, of about unit rms."""
    times, strips = w.shape
    speed = w.reshape(times, cells, strips // cells).mean(2)
    y, v = rng.normal(0, 0.5, cells), rng.normal(0, 0.5, cells)
    out = np.zeros((times, cells))
    for k in range(times):  # in dimensionless time of steps h: the speed of the flow only stretches time
        h = 2 * 2 * np.pi * strouhal * np.abs(speed[k]) / diameter * dt
        pull = np.zeros(cells)
        pull[:-1] += y[1:] - y[:-1]
        pull[1:] += y[:-1] - y[1:]
        kicks = rng.normal(0, 0.05, cells) / np.sqrt(np.maximum(h, 1e-6)) * (h > 1e-6)
        v = v + h * (-0.3 * (y * y - 1) * v - y + 0.1 * pull + kicks)
        y = y + h * v
        out[k] = y
    return np.repeat(out, strips // cells, 1) / np.sqrt(2)
