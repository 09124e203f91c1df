"""What a dry contact, a mass on a spring and a first-order lag answer to a signal."""

import numpy as np
from machines import Array
from scipy.signal import cont2discrete, lfilter


def presliding(q: Array, bend: float, level: Array | None = None) -> Array:
    """Dahl's and LuGre's contact: the friction, by exact steps along the path, rises over `bend` rad to +-level (1 where not given)."""
    z, out = 0.0, np.zeros_like(q)
    step = np.diff(q, prepend=q[0])
    top = np.ones_like(q) if level is None else level
    decay = np.exp(-np.abs(step) / (bend * top / top.min()))
    target = np.sign(step) * top
    for k in range(q.size):
        if step[k]:
            z = target[k] + (z - target[k]) * decay[k]
        out[k] = z
    return out


def mode(force: Array, hz: float, zeta: float, dt: float) -> tuple[Array, Array]:
    """Answer y, dy of y'' + 2 zeta w y' + w^2 y = force, exact for a force that is linear between rows."""
    w = 2 * np.pi * hz
    system = (np.array([[0, 1], [-w * w, -2 * zeta * w]]), np.array([[0.0], [1]]), np.eye(2), np.zeros((2, 1)))
    a, b, c, d, _ = cont2discrete(system, dt, "foh")
    den = np.array([1, -np.trace(a), np.linalg.det(a)])
    out = []
    for row in range(2):
        first = (c[row] @ b)[0]
        second = (c[row] @ a @ b)[0]
        num = [d[row, 0], first + den[1] * d[row, 0], second + den[1] * first + den[2] * d[row, 0]]
        out.append(lfilter(num, den, force))
    return out[0], out[1]


def lag(signal: Array, tau: float, dt: float) -> Array:
    """First-order lag of rows along the last axis, starting settled."""
    k = np.exp(-dt / tau)
    return lfilter([1 - k], [1, -k], signal, axis=-1, zi=k * signal[..., :1])[0]
