"""Strip loads with coefficients over the travel, one run in time order, as loops for numba: the fast twin of travel.py and travel_term.py.

    F_i  = sum_s (k_D C_D(u) |w| w + k_M C_M(u) dw),    Mo_i = sum_s (...) x_s,    u = min(s/(D tau_s), 1)
    C(u) = c_0 + c_1 v + c_2 v^2 + c_3 v^3 + sum_{k <= K/2} c_{3+k} (k/K - u)_+^3 + sum_{k > K/2} c_{3+k} (u - k/K)_+^3,    v = u - 1/2

What counts as a reversal, a pause or a running start is said in travel.py; a test holds the two equal. Three passes a strip over a block of
rows: what has no memory (vectorised), the memory (a few operations a row), the curves (vectorised). numba must be installed.
"""

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from nnhydro.physics.travel.travel import BACK, STILL

Array = NDArray[np.float64]
Function = Callable[..., Any]
MEMORY: Final = 7  # a strip's path, path at its last zero, direction, origin of s, under way since ever, s_0, last time in motion
PIECE: Final = 1024  # rows: what a strip needs of them stays in the first cache

_jit: Callable[[Function], Function] = njit(fastmath={"contract", "reassoc", "nsz"}, error_model="numpy")


@_jit
def _steps(x: float, A: Array, B: Array, turned: Array, moved: Array, w: Array, step: Array) -> None:
    """Velocity of the strip and its path since the row before, as if the velocity had kept its sign."""
    for k in range(len(A)):
        w[k] = A[k] * x + B[k]
        step[k] = abs(x * turned[k] + moved[k])


@_jit
def _wake_travel(t: Array, w: Array, step: Array, memory: Array, keep: bool, length: float | None, dwell: float | None, D: float,
                s: Array) -> None:
    """Travel s, m. None for a memory length or a pause leaves the code for it out, which would double the time of this loop."""
    path, zero, direction, origin, ever, s0, moving = memory
    base = -np.inf if ever > 0.0 else origin
    for k in range(1, len(w)):
        product, onward = w[k] * w[k - 1], step[k]
        if product <= 0.0:
            if product < 0.0:  # the velocity vanishes on the way
                a, b = abs(w[k]), abs(w[k - 1])
                share = 0.5 * (t[k] - t[k - 1]) / max(a + b, 1e-300)
                zero, onward = path + b * b * share, (b * b + a * a) * share
            elif w[k - 1] == 0.0:
                zero = path
        path += onward
        if w[k] * direction <= 0.0:  # at rest, not yet started or perhaps reversed
            if abs(w[k]) > STILL and path - zero > BACK * D:
                if direction == 0.0 or not keep:
                    reached = max(origin, zero)
                    if direction != 0.0:
                        ever = 0.0
                        if length is not None:
                            s0 = reached - origin + s0 * np.exp((origin - reached) / (length * D))
                    origin = reached
                direction = 1.0 if w[k] > 0.0 else -1.0
            if direction == 0.0:
                origin = max(origin, zero)
            base = -np.inf if ever > 0.0 else origin
        if dwell is not None:
            if abs(w[k]) > STILL:
                moving = t[k]
            if t[k] - moving > dwell:
                origin, ever, s0 = max(origin, path), 0.0, 0.0
                base = origin
        s[k] = path - base
        if length is not None:
            s[k] += s0 * np.exp(-s[k] / (length * D))
    memory[0], memory[1], memory[2], memory[3], memory[4], memory[5], memory[6] = path, zero, direction, origin, ever, s0, moving


@_jit
def _loads(x: float, k: Array, M: Array, N: Array, w: Array, s: Array, drag: Any, mass: Any, F: Array, Mo: Array) -> None:
    """Add the strip's force and moment; `k`: 1/(D tau_s), k_D, k_M; `drag`, `mass`: the curves' coefficients as tuples."""
    scale, k_D, k_M = k[0], k[1], k[2]
    knots = len(drag) - 3
    for i in range(1, len(w)):
        u = s[i] * scale
        u = u if u < 1.0 else 1.0
        v = u - 0.5
        C_D = drag[0] + v * (drag[1] + v * (drag[2] + v * drag[3]))
        C_M = mass[0] + v * (mass[1] + v * (mass[2] + v * mass[3]))
        for j in range(1, knots):  # K - 1 inner knots; ramps to both sides cancel less than ramps to one
            ramp = j * (1.0 / knots) - u if 2 * j <= knots else u - j * (1.0 / knots)
            ramp = ramp if ramp > 0.0 else 0.0
            cube = ramp * ramp * ramp
            C_D += drag[3 + j] * cube
            C_M += mass[3 + j] * cube
        f = k_D * C_D * abs(w[i]) * w[i] + k_M * C_M * (M[i] * x + N[i])
        F[i] += f
        Mo[i] += f * x


@_jit
def _piece(start: int, stop: int, t: Array, motion: Array, x: Array, D: Array, k: Array, drag: Any, mass: Any, keep: bool,
           length: float | None, dwell: float | None, developed: bool, memory: Array, scratch: Array, out: Array) -> None:
    """What `strip_loads` does, for the rows `start` + 1 to `stop`."""
    n, t = stop - start, t[start:stop]
    w, step, s, turned, moved = scratch[0, :n], scratch[1, :n], scratch[2, :n], scratch[3, :n], scratch[4, :n]
    for link in range(len(x)):
        A, B, M = motion[link, 0, start:stop], motion[link, 1, start:stop], motion[link, 2, start:stop]
        N, phi = motion[link, 3, start:stop], motion[link, 4, start:stop]
        F, Mo = out[link, 0, start:stop], out[link, 1, start:stop]
        for i in range(1, n):
            turned[i] = phi[i] - phi[i - 1]
            moved[i] = (B[i] + B[i - 1]) * 0.5 * (t[i] - t[i - 1])
            F[i], Mo[i] = 0.0, 0.0
        for strip in range(x.shape[1]):
            _steps(x[link, strip], A, B, turned, moved, w, step)
            if developed:
                s[:] = np.inf
            else:
                _wake_travel(t, w, step, memory[link, strip], keep, length, dwell, D[link], s)
            _loads(x[link, strip], k[link], M, N, w, s, drag[link], mass[link], F, Mo)


@_jit
def strip_loads(t: Array, motion: Array, x: Array, D: Array, k: Array, drag: Any, mass: Any, keep: bool, length: float | None,
                dwell: float | None, developed: bool, memory: Array, out: Array) -> None:
    """Fill `out` (links, 2, rows) with F N and Mo N m of each link for a block; column 0 of every array is the row before the block.

    `motion` (links, 5, rows) holds A, B, M, N, phi, of which as many as `t` has count; x (links, s); `k` (links, 3) as `_loads` takes it;
    `keep`: a reversal keeps s; `length` of the memory in diameters and `dwell` in s, or None; `developed`: steady rows; `memory`
    (links, s, 7) goes from block to block.
    """
    scratch = np.zeros((5, PIECE + 1))
    for start in range(0, len(t) - 1, PIECE):
        stop = min(start + PIECE + 1, len(t))
        _piece(start, stop, t, motion, x, D, k, drag, mass, keep, length, dwell, developed, memory, scratch, out)


@_jit
def fastest(motion: Array, x: Array, peak: Array) -> None:
    """Raise `peak` (links, s) to the largest |w| of a block, m/s."""
    for link in range(len(x)):
        for strip in range(x.shape[1]):
            top = peak[link, strip]
            for i in range(1, motion.shape[2]):
                v = abs(motion[link, 0, i] * x[link, strip] + motion[link, 1, i])
                top = v if v > top else top
            peak[link, strip] = top
