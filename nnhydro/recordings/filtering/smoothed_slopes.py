"""Rates and accelerations that were smoothed: in a band where the angles are well known, they hold less than the slope of these.

    H(f) = sum conj(D) Y / sum |D|^2,     D, Y the spectra of dx/dt and of its record y, summed over recordings, in bands of half an octave

Below `SMOOTHED` where |D|^2 is `KNOWN` times what the noise of x makes of it, y was computed with a filter. Its white noise says nothing of
what the filter took. A sensor of its own passes what the arm can do.
Source: the H1 estimate of a transfer function, Bendat & Piersol (2010), Random Data, chapter 6.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.filtering.trajectory import white_level

Array = NDArray[np.float64]
EDGES = 0.3 * 2.0 ** np.arange(0.0, 5.01, 0.5)  # Hz: what arms move at
SMOOTHED = 0.9  # of the slope of x: a torque that is a tenth too small is seen
KNOWN = 100.0  # the estimate is then 1 % low
COHERENT = 0.98  # share of y in a band that is x's: sharp corners fold into it
LOWEST_PASSED = 0.3  # of the slope by central differences: nearer to half the sampling rate they tell little
FEWEST = 64  # rows of a recording


def _spectra(dt: float, x: Array, y: Array) -> Array:
    """The sums over bands of the densities of conj(D) Y, |D|^2, |Y|^2 and of what the noise of x makes of |D|^2, (bands, 4)."""
    from scipy.signal import csd

    white = white_level(x[:, None])
    D, Y = (x[2:] - x[:-2]) / (2 * dt), y[1:-1]
    (f, cross), (_, slope), (_, recorded) = (csd(a, b, 1 / dt, nperseg=len(D)) for a, b in ((D, Y), (D, D), (Y, Y)))
    passed = np.sinc(2 * f * dt)  # of a derivative by central differences
    inside, band = passed > LOWEST_PASSED, np.digitize(f, EDGES) - 1
    inside &= (band >= 0) & (band < len(EDGES) - 1)
    passed = np.where(inside, passed, 1.0)
    noise = 2 * dt * (2 * np.pi * f * (0.0 if white is None else white[0])) ** 2
    columns = cross.real / passed, slope.real / passed**2, recorded.real, noise
    return np.stack([np.bincount(band[inside], z[inside], len(EDGES) - 1) for z in columns], axis=1)


def is_smoothed(records: Iterable[tuple[float, Array, Array]]) -> bool:
    """Return whether y was smoothed, from step s, x (n,) and y (n,) of `records` on even times."""
    sums = np.zeros((len(EDGES) - 1, 4))
    for dt, x, y in records:
        if len(x) >= FEWEST:
            sums += _spectra(dt, x, y)
    cross, slope, recorded, noise = sums.T
    known = (slope > KNOWN * noise) & (cross**2 > COHERENT * slope * recorded)
    return bool((cross[known] < SMOOTHED * slope[known]).any())
