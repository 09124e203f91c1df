"""A channel that comes late: pure delay and first-order lag of a sampled signal, exact for its cubic spline.

    time_delay        y(t) = x(t - delay), held at the ends
    first_order_lag   T dy/dt = x - y, in balance at the first row:  y = x - T x' + T^2 x'' - T^3 x''' + decaying part, piece by piece
"""

import numpy as np
from torch import Tensor

from nnhydro.physics.motion import tensor


def time_delay(t: Tensor, x: Tensor, delay: float) -> Tensor:
    """Return `x` (n, k) `delay` s later (earlier where negative)."""
    from scipy.interpolate import CubicSpline

    if len(t) < 4 or delay == 0.0:
        return x
    times = t.numpy()
    return tensor(CubicSpline(times, x.numpy())(np.clip(times - delay, times[0], times[-1])))


def first_order_lag(t: Tensor, x: Tensor, lag: float) -> Tensor:
    """Return `x` (n, k) through a first-order low-pass with the time constant `lag` s."""
    from scipy.interpolate import CubicSpline

    if len(t) < 4 or lag <= 0.0:
        return x
    times, spline = t.numpy(), CubicSpline(t.numpy(), x.numpy())
    d1, d2, d3 = (spline(times, order) for order in (1, 2, 3))
    d3_before = np.concatenate([d3[:1], d3[:-1]])  # the third derivative jumps at each row
    balance = x.numpy() - lag * d1 + lag**2 * d2
    before, after = balance - lag**3 * d3_before, balance - lag**3 * d3
    decay = np.exp(-np.diff(times) / lag)
    y = before.copy()
    for k in range(1, len(y)):
        y[k] = before[k] + (y[k - 1] - after[k - 1]) * decay[k - 1]
    return tensor(y)
