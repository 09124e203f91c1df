"""Planar arms by Newton and Euler, as arm.yaml states them and as they are; numpy only, nothing of the package.

A true machine differs from its arm.yaml: masses, centres and moments of inertia are drawn within the uncertainty that is stated there.
"""

import numpy as np

PI = np.pi
G = 9.81
KEYS = ("length_m", "diameter_m", "mass_kg", "com_m", "inertia_kg_m2", "known_to")
INDUSTRIAL = [(0.55, 0.12, 14.0, 0.26, 0.42, 0.04), (0.48, 0.09, 7.5, 0.19, 0.16, 0.04)]
ONE = [(0.65, 0.071, 2.9, 0.33, 0.105, 0.02)]  # links of arms in a tank, in the order of KEYS
TWO = [(0.55, 0.07, 2.2, 0.27, 0.06, 0.02), (0.45, 0.06, 1.4, 0.22, 0.026, 0.02)]


class Arm:
    """True machine: arrays (links,) of length L, diameter D, mass m, centre of mass c, moment of inertia I about it (SI)."""

    def __init__(self, document, rng, spread=1.0):
        self.g = document.get("gravity_m_s2", 0.0)
        self.rho = document["fluid"]["density_kg_m3"]
        self.nu = document["fluid"]["kinematic_viscosity_m2_s"]
        links = document["links"]
        self.L, self.D, self.m, self.c, self.I = (np.array([link[key] for link in links], float) for key in KEYS[:5])
        self.n = len(self.L)
        known = np.array([link.get("known_to", 0.01) for link in links])
        for values in (self.m, self.c, self.I):
            values *= 1 + spread * known * np.clip(rng.normal(size=self.n), -1.5, 1.5)


def arm_yaml(name, links, rho=0.0, g=0.0, nu=1e-6, **more):
    """Return arm.yaml's document; links are tuples in the order of KEYS, rho in kg/m3, g in m/s2, nu in m2/s."""
    document = {"schema": "nnhydro/arm/1", "name": name, "fluid": {"density_kg_m3": float(rho), "kinematic_viscosity_m2_s": float(nu)}}
    if g:
        document["gravity_m_s2"] = float(g)
    document["links"] = [dict(zip(KEYS, map(float, link), strict=True)) for link in links]
    document.update(more)
    return document


def pendulum(name, L, m, c, I, known=0.05, D=0.02):  # noqa: E741 (the moment of inertia)
    """Return arm.yaml's document of one link under gravity."""
    return arm_yaml(name, [(L, D, m, c, I, known)], g=G)


def deriv(q, dt):
    """Return rates and accelerations by central differences."""
    dq = np.gradient(q, dt, axis=0)
    return dq, np.gradient(dq, dt, axis=0)


def cross(a, b):
    """Return the cross product of vectors (n, 2) in the plane."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def kinematics(arm, q, dq, ddq, u0=None, du0=None):
    """Return of each link position, velocity, acceleration of its joint (n, 2), axes e and n, and its own rates w, al (n,)."""
    T = len(q)
    z = np.zeros(T)
    ph, w, al = np.cumsum(q, 1), np.cumsum(dq, 1), np.cumsum(ddq, 1)
    p = np.zeros((T, 2))
    v = np.stack([z, z if u0 is None else u0], 1)
    a = np.stack([z, z if du0 is None else du0], 1)
    out = []
    for i in range(arm.n):
        e = np.stack([np.cos(ph[:, i]), np.sin(ph[:, i])], 1)
        n = np.stack([-e[:, 1], e[:, 0]], 1)
        out.append({"p": p, "v": v, "a": a, "e": e, "n": n, "w": w[:, i], "al": al[:, i]})
        W, A = w[:, i : i + 1], al[:, i : i + 1]
        p = p + arm.L[i] * e
        v = v + arm.L[i] * W * n
        a = a + arm.L[i] * (A * n - W**2 * e)
    return out


def motion_of(arm, q, dt, u0=None):
    """Return rates, accelerations and kinematics of the angles q (n, joints), rad, on a carriage of speed u0 (n,), m/s."""
    dq, ddq = deriv(q, dt)
    return dq, ddq, kinematics(arm, q, dq, ddq, u0, None if u0 is None else np.gradient(u0, dt))


def rigid(arm, K):
    """Return the torques (n, joints), N m, that the dry arm asks of its drives."""
    T = len(K[0]["w"])
    tau = np.zeros((T, arm.n))
    for i, k in enumerate(K):
        ac = k["a"] + arm.c[i] * (k["al"][:, None] * k["n"] - k["w"][:, None] ** 2 * k["e"])
        F = arm.m[i] * (ac + np.array([0.0, arm.g]))
        r = k["p"] + arm.c[i] * k["e"]
        for j in range(i + 1):
            tau[:, j] += cross(r - K[j]["p"], F) + arm.I[i] * k["al"]
    return tau


def point_mass(arm, K, mass):
    """Return the torques (n, joints), N m, that a mass (kg) at the tip asks for."""
    k = K[-1]
    L = arm.L[-1]
    F = mass * (k["a"] + L * (k["al"][:, None] * k["n"] - k["w"][:, None] ** 2 * k["e"]) + np.array([0.0, arm.g]))
    r = k["p"] + L * k["e"]
    return np.stack([cross(r - K[j]["p"], F) for j in range(arm.n)], 1)
