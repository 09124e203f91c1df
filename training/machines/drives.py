"""Friction, compliant gears, lags, and free swings, integrated in time; nothing of the package."""

import math

import numpy as np
from arms import PI
from scipy.signal import lfilter, lfiltic


def lag1(x, T, dt):
    """Return x (n,) behind a first-order lag of T seconds, exact where x is constant between samples."""
    a = math.exp(-dt / T)
    zi = lfiltic([1 - a], [1, -a], y=[x[0]])
    return lfilter([1 - a], [1, -a], x, zi=zi)[0]


def lugre(v, dt, Fc, Fs=None, vs=0.05, Fv=0.0, z0=2e-4, alpha=2.0):
    """Return LuGre friction (n,) at the speeds v: sliding level Fc (a number, or (n,) with the load), breakaway Fs, viscous Fv.

    The bristle bends by z0 before it slides, and its step is exact at constant speed. Source: Canudas de Wit et al. (1995), IEEE Trans.
    Autom. Control 40(3).
    """
    Fs = Fc if Fs is None else Fs
    fc, fs = np.broadcast_to(Fc, v.shape), np.broadcast_to(Fs, v.shape)
    g = fc + (fs - fc) * np.exp(-(np.abs(v / vs) ** alpha))
    s0 = float(np.mean(fc)) / z0
    rate = (s0 * np.abs(v) / g * dt).tolist()
    target = (g * np.sign(v) / s0).tolist()
    z, out = 0.0, []
    for r, zt, d in zip(rate, target, (v * dt).tolist(), strict=True):
        z = zt + (z - zt) * math.exp(-r) if r > 1e-12 else z + d
        out.append(z)
    return s0 * np.array(out) + Fv * v


def rk4(f, y, T, dt):
    """Return the states (T/dt + 1, variables) of y' = f(t, y), by the classical Runge-Kutta method."""
    out = [y]
    t = 0.0
    for _ in range(round(T / dt)):
        k1 = f(t, y)
        k2 = f(t + dt / 2, tuple(a + dt / 2 * b for a, b in zip(y, k1, strict=True)))
        k3 = f(t + dt / 2, tuple(a + dt / 2 * b for a, b in zip(y, k2, strict=True)))
        k4 = f(t + dt, tuple(a + dt * b for a, b in zip(y, k3, strict=True)))
        y = tuple(a + dt / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(y, k1, k2, k3, k4, strict=True))
        t += dt
        out.append(y)
    return np.array(out)


def free_pendulum(arm, angle, T, dt, Fc=0.0, Fv=0.0, z0=1e-3):
    """Return the angles (n, 1) of a free pendulum from `angle` off its rest, with dry friction Fc (a bristle) and viscous friction Fv."""
    J = arm.I[0] + arm.m[0] * arm.c[0] ** 2
    mgc = arm.m[0] * arm.g * arm.c[0]
    s0 = Fc / z0 if Fc else 0.0

    def f(t, y):
        q, v, z = y
        dz = v - s0 * abs(v) * z / Fc if Fc else 0.0
        fr = s0 * z + Fv * v
        return v, (-mgc * math.cos(q) - fr) / J, dz

    return rk4(f, (-PI / 2 + angle, 0.0, 0.0), T, dt)[:, :1]


def flank(e, de, k, c, gap):
    """Return the torque (N m) of a spring k and damper c at the twist e (rad), de (rad/s), behind a gap that cannot pull."""
    if not gap:
        return k * e + c * de
    if e > gap / 2:
        return max(k * (e - gap / 2) + c * de, 0.0)
    if e < -gap / 2:
        return min(k * (e + gap / 2) + c * de, 0.0)
    return 0.0


def compliant(arm, th, dt, k, c, gap=0.0, sub=4):
    """Return the torque (n,) of a drive at the angles th (n,) whose link is behind a spring k, a damper c and a gap (its whole width)."""
    J, mgc = arm.I[0] + arm.m[0] * arm.c[0] ** 2, arm.m[0] * arm.g * arm.c[0]
    # starts at rest on the loaded flank
    q = float(th[0]) - mgc * math.cos(th[0]) / k - math.copysign(gap / 2, math.cos(th[0]))
    v, out, h = 0.0, [], dt / sub
    for angle, speed in zip(th.tolist(), np.gradient(th, dt).tolist(), strict=True):
        out.append(flank(angle - q, speed - v, k, c, gap))
        for s in range(sub):
            x = angle + speed * h * s
            acc = (flank(x - q, speed - v, k, c, gap) - mgc * math.cos(q)) / J
            v += h * acc
            q += h * v
    return np.array(out)
