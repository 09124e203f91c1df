"""Rates and accelerations that were smoothed: in a band where the angles are well known, they hold less than the slope of these.

    H(f) = sum conj(D) Y / sum |D|^2,     D, Y the spectra of dx/dt and of its record y, summed over recordings, in bands of half an octave

Below `SMOOTHED` where |D|^2 is `KNOWN` times what the noise of x makes of it, y was computed with a filter. Its white noise says nothing of
what the filter took. A sensor of its own passes what the arm can do.
Source: the H1 estimate of a transfer function, Bendat & Piersol (2010), Random Data, chapter 6.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
EDGES = 0.3 * 2.0 ** np.arange(0.0, 5.01, 0.5)  # Hz: what arms move at
SMOOTHED = 0.9  # of the slope of x: a torque that is a tenth too small is seen
KNOWN = 100.0  # the estimate is then 1 % low
SHOWN = 0.003  # of the largest band: more than the window spreads from there
COHERENT = 0.98  # share of y in a band that is x's: sharp corners fold into it
FEWEST = 64  # rows of a recording


def _spectra(dt: float, x: Array, y: Array, white: float) -> Array:
    """The sums over bands of conj(D) Y, |D|^2, |Y|^2 and of what white noise `white` in x makes of |D|^2, (bands, 4)."""
    slope, kept = (x[2:] - x[:-2]) / (2 * dt), y[1:-1]
    window, f = np.hanning(len(slope)), np.fft.rfftfreq(len(slope), dt)
    passed = np.sinc(2 * f * dt)  # of a derivative by central differences
    D, Y = (np.fft.rfft((z - z.mean()) * window) for z in (slope, kept))
    D = D / np.where(passed > 0.1, passed, np.inf)
    noise = (2 * np.pi * f * white) ** 2 * (window**2).sum()
    band = np.digitize(f, EDGES) - 1
    inside = (band >= 0) & (band < len(EDGES) - 1) & (passed > 0.3)
    made = np.zeros((len(EDGES) - 1, 4))
    for column, z in enumerate(((np.conj(D) * Y).real, np.abs(D) ** 2, np.abs(Y) ** 2, noise)):
        made[:, column] = np.bincount(band[inside], z[inside], len(EDGES) - 1)
    return made


def is_smoothed(records: Iterable[tuple[float, Array, Array, float]]) -> bool:
    """Return whether y was smoothed, from (step s, x (n,), y (n,), white noise of x) of `records` on even times."""
    sums = np.zeros((len(EDGES) - 1, 4))
    for dt, x, y, white in records:
        if len(x) >= FEWEST:
            sums += _spectra(dt, x, y, white)
    cross, slope, recorded, noise = sums.T
    known = (slope > np.maximum(KNOWN * noise, SHOWN * slope.max())) & (cross**2 > COHERENT * slope * recorded)
    return bool((cross[known] < SMOOTHED * slope[known]).any())
