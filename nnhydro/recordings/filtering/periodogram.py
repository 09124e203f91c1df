"""The periodogram under a Hann window: what every search for lines and bands looks at.

    P_k = |sum_n w_n x_n exp(-2 pi i k n / N)|^2,     w_n = sin^2(pi n / (N - 1)) with its zero ends, or sin^2(pi (n + 1) / (N + 1))

Source: Harris (1978), Proc. IEEE 66(1).
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def hann(n: int, zero_ends: bool = True) -> Array:
    """Return the Hann window (n,), with its zeros at the ends or without them."""
    made: Array = np.hanning(n) if zero_ends else np.hanning(n + 2)[1:-1]
    return made


def hann_power(x: Array, dt: float, zero_ends: bool = True, points: int | None = None) -> tuple[Array, Array]:
    """Return frequencies (m,) Hz and ordinates (m, ...) of `x` (n, ...), which is padded with zeros to `points` where these are given."""
    window = hann(len(x), zero_ends).reshape(-1, *[1] * (x.ndim - 1))
    power: Array = np.abs(np.fft.rfft(x * window, points, axis=0)) ** 2
    return np.asarray(np.fft.rfftfreq(points or len(x), dt), np.float64), power
