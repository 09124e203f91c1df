"""Morison's loads of water on the strips of an arm, with factors on Cd and Cm; numpy only, nothing of the package."""

import numpy as np
from arms import PI, cross, motion_of, rigid

CURVE_S = [0, 1, 2, 3, 4, 5, 6, 8, 12, 40]  # travel in diameters since the start or the last reversal
CURVE_D = [0.25, 0.62, 0.95, 1.22, 1.33, 1.25, 1.12, 1.0, 0.97, 0.97]  # factor on Cd
CURVE_M = [1.2, 1.0, 0.72, 0.5, 0.42, 0.48, 0.58, 0.68, 0.72, 0.72]  # factor on Cm
RE = [1e3, 2.3e3, 5e3, 1.5e4, 1e5, 1.8e5, 2.2e5, 2.9e5, 3.65e5, 4.3e5, 5e5, 8e5, 1e6]
CD = [0.95, 0.89, 0.94, 1.14, 1.17, 1.16, 1.06, 0.92, 0.73, 0.54, 0.35, 0.36, 0.4]  # of a smooth cylinder (Wieselsberger 1922)


def water(arm, K, cd, cm, V=(0.0, 0.0), wave=None, mult=None, S=20, tip_cda=0.0, shed=None):
    """Return the torques (n, joints), N m, that the drives need against drag, and against the water's inertia, on S strips a link.

    V is a current (m/s), wave the water's own velocity and acceleration, each (n, 2). mult(i, x, w) gives factors on Cd and Cm of link i,
    shed(i, x, w) an addition to Cd, from the strips' places x (strips,) and speeds w (n, strips). tip_cda is Cd A (m2) of a body at the
    tip.
    """
    T = len(K[0]["w"])
    drag, inert = np.zeros((T, arm.n)), np.zeros((T, arm.n))
    u, du = (np.zeros((T, 2)), np.zeros((T, 2))) if wave is None else wave
    u = u + np.asarray(V, float)
    for i, k in enumerate(K):
        x = (np.arange(S) + 0.5) * arm.L[i] / S
        dx = arm.L[i] / S
        vr = k["v"] - u
        w = (vr * k["n"]).sum(1)[:, None] + k["w"][:, None] * x
        dn = -k["w"][:, None] * k["e"]
        dw = ((k["a"] - du) * k["n"] + vr * dn).sum(1)[:, None] + k["al"][:, None] * x
        fc, fm = (1.0, 1.0) if mult is None else mult(i, x, w)
        fd = 0.5 * arm.rho * arm.D[i] * cd[i] * fc * w * np.abs(w) * dx
        if shed is not None:
            fd = fd + 0.5 * arm.rho * arm.D[i] * w * np.abs(w) * shed(i, x, w) * dx
        area = arm.rho * PI / 4 * arm.D[i] ** 2
        fi = area * (cm[i] * fm * dw - (du * k["n"]).sum(1)[:, None]) * dx
        for j in range(i + 1):
            lev = cross(k["p"] - K[j]["p"], k["n"])[:, None] + x
            drag[:, j] += (fd * lev).sum(1)
            inert[:, j] += (fi * lev).sum(1)
    if tip_cda:
        drag += tip_drag(arm, K, u, tip_cda)
    return drag, inert


def tip_drag(arm, K, u, cda):
    """Return the torques (n, joints), N m, against a body at the tip, along its whole velocity through water of velocity u (n, 2)."""
    k = K[-1]
    r = k["p"] + arm.L[-1] * k["e"]
    v = k["v"] + arm.L[-1] * k["w"][:, None] * k["n"] - u
    F = 0.5 * arm.rho * cda * np.linalg.norm(v, axis=1)[:, None] * v
    return np.stack([cross(r - K[j]["p"], F) for j in range(arm.n)], 1)


def tank(arm, q, dt, cd, cm, u0=None, **how):
    """Return rates, accelerations, kinematics, and the torques of the dry arm, of drag and of the water's inertia."""
    dq, ddq, K = motion_of(arm, q, dt, u0)
    drag, inert = water(arm, K, cd, cm, **how)
    return dq, ddq, K, rigid(arm, K), drag, inert


def travel(w, dt, D):
    """Return the distance (n, strips) in diameters since the start or the last reversal, of each strip for itself."""
    s = np.zeros_like(w)
    a = np.zeros(w.shape[1])
    sg = np.sign(w[0])
    for t in range(1, len(w)):
        new = np.sign(w[t])
        flip = (new != sg) & (new != 0)
        a[flip] = 0.0
        sg = np.where(new != 0, new, sg)
        a += np.abs(w[t]) * dt / D
        s[t] = a
    return s


def developing(arm, dt, inertia=True):
    """Return the factors on Cd, and on Cm if inertia is set, of a wake that develops over the travel."""

    def mult(i, x, w):
        s = travel(w, dt, arm.D[i])
        return np.interp(s, CURVE_S, CURVE_D), np.interp(s, CURVE_S, CURVE_M) if inertia else 1.0

    return mult


def drag_crisis(arm):
    """Return the factors by which Cd follows each strip's Reynolds number."""
    return lambda i, x, w: (np.interp(np.abs(w) * arm.D[i] / arm.nu, RE, CD), 1.0)


def shedding(arm, dt, strouhal, amplitude, walk, start, swell=0.0):
    """Return the addition to Cd at twice the frequency of shedding; walk (n,) and start (rad) are of its phase, swell of its amplitude."""

    def shed(i, x, w):
        f = strouhal * np.abs(w.mean(1)) / arm.D[i]
        ph = np.cumsum(2 * PI * 2 * f) * dt + walk + start
        return (amplitude * (1 + swell * np.sin(0.5 * ph / 9)) * np.sin(ph))[:, None]

    return shed


def regular_wave(t, speed, omega, direction):
    """Return velocity and acceleration (n, 2) of a regular wave along `direction` (rad) at the times t."""
    e = np.array([np.cos(direction), np.sin(direction)])
    return speed * np.sin(omega * t)[:, None] * e, speed * omega * np.cos(omega * t)[:, None] * e
