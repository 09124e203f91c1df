"""Motions that drives and carriages are given; numpy only, nothing of the package."""

import numpy as np
from arms import PI


def smooth_step(x):
    """Return 3 x^2 - 2 x^3, x cut off at 0 and 1."""
    return np.clip(x, 0, 1) ** 2 * (3 - 2 * np.clip(x, 0, 1))


def multisine(T, dt, amps, f0, f1, k, rng, centre=0.0):
    """Return angles (n, joints): k sines between f0 and f1 (Hz), of amplitude amps (rad) about centre, that set in within a second."""
    t = np.arange(0, T, dt)
    n = len(amps)
    q = np.zeros((len(t), n))
    for j in range(n):
        f = np.linspace(f0, f1, k) * (1 + 0.1 * rng.uniform(-1, 1, k))
        a = 1 / np.sqrt(f)
        s = sum(ai * np.sin(2 * PI * fi * t + ph) for ai, fi, ph in zip(a, f, rng.uniform(0, 2 * PI, k), strict=True))
        q[:, j] = amps[j] * s / np.abs(s).max()
    x = np.clip(t, 0, 1)
    q *= (x**3 * (10 - 15 * x + 6 * x * x))[:, None]
    return q + np.asarray(centre, float)


def path(points, moves, dwells, dt, kind="quintic"):
    """Return angles (n, joints) from point to point, moves and dwells in s; the speed's profile is quintic or a rounded trapezoid."""
    pts = np.atleast_2d(np.asarray(points, float))
    pts = pts.T if pts.shape[0] == 1 else pts
    q = [pts[:1]]
    K = len(pts) - 1
    moves, dwells = np.broadcast_to(moves, K), np.broadcast_to(dwells, K)
    for a, b, m, d in zip(pts[:-1], pts[1:], moves, dwells, strict=True):
        x = np.arange(1, round(m / dt) + 1) / round(m / dt)
        if kind == "quintic":
            s = x**3 * (10 - 15 * x + 6 * x * x)
        else:
            s = np.cumsum(smooth_step(x / 0.28) * smooth_step((1 - x) / 0.28))
            s /= s[-1]
        q.append(a + s[:, None] * (b - a))
        q.append(np.repeat(b[None], round(d / dt), 0))
    return np.concatenate(q)


def picks(rng, dt, n, lo, hi, moves, dwells, K=8):
    """Return angles (n, joints) of a robot that picks and places, between K points drawn from lo to hi."""
    pts = rng.uniform(lo, hi, (K, n))
    pts[-1] = pts[0]
    return path(pts, rng.uniform(*moves, K - 1), dwells, dt, "trapezoid")


def slews(rng, dt, n=1, lo=-1.3, hi=1.3, K=9, moves=(0.5, 2.2), dwell=0.8):
    """Return angles (n, joints) of slews with rests, between K points drawn from lo to hi."""
    return path(rng.uniform(lo, hi, (K, n)), rng.uniform(*moves, K - 1), dwell, dt)


def zigzag(rng, dt, low, high, moves):
    """Return angles (n, 1) of six slews to and fro, each from a rest of 2.5 s."""
    return path(np.r_[0, np.cumsum(np.resize([1, -1], 6) * rng.uniform(low, high, 6))], rng.uniform(*moves, 6), 2.5, dt)


def hold(angle, T, dt):
    """Return angles (n, 1) that stand still."""
    return np.full((round(T / dt), 1), angle)


def ramp(T, dt, U, t0=1.0, up=1.5, down=1.5):
    """Return the carriage's speed (n,), m/s: up to U after t0, and down half a second before the end."""
    t = np.arange(0, T, dt)
    return U * smooth_step((t - t0) / up) * smooth_step((T - 0.5 - t) / down)
