"""The sine and cosine of deployment/sine.py for numba."""

from collections.abc import Callable
from typing import Any

from numba import njit

from nnhydro.deployment.sine import PI, ROUND, P, Q

Function = Callable[..., Any]
_inline: Callable[[Function], Function] = njit(inline="always", fastmath={"contract"}, error_model="numpy")


@_inline
def reduce_argument(x: float) -> tuple[float, float]:
    """Return r and (-1)^k of `x` rad."""
    k = (x * 0.3183098861837907 + ROUND) - ROUND
    odd = k - 2.0 * ((k * 0.5 + ROUND) - ROUND)
    return (((x - k * PI[0]) - k * PI[1]) - k * PI[2]) - k * PI[3], 1.0 - 2.0 * odd * odd


@_inline
def sin(x: float) -> float:
    """Return the sine of `x` rad."""
    r, sign = reduce_argument(x)
    z = r * r
    p = ((((((P[0] * z + P[1]) * z + P[2]) * z + P[3]) * z + P[4]) * z + P[5]) * z + P[6]) * z + P[7]
    value: float = (r + r * z * p) * sign
    return value


@_inline
def cos(x: float) -> float:
    """Return the cosine of `x` rad."""
    r, sign = reduce_argument(x)
    z = r * r
    p = ((((((Q[0] * z + Q[1]) * z + Q[2]) * z + Q[3]) * z + Q[4]) * z + Q[5]) * z + Q[6]) * z + Q[7]
    value: float = (1.0 - 0.5 * z + z * z * p) * sign
    return value
