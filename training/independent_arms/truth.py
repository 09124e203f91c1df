"""Healthy two-link arms in water: flat, numpy only, nothing of the package. `campaign(seed)` gives arm.yaml's document and recordings.

The torques are those of Lagrange's equations of two rods and of Morison's load on 60 strips per link; the motions are given, so that no
integrator errs. Noise is what differs: white to strongly coloured, alike or different by a ratio up to 10 between recordings, logged at 25
Hz to 1 kHz, rates and accelerations recorded with noise or not at all.
"""

import numpy as np

STRIPS = 60
KINDS = ("plain", "ratio3", "ratio10", "ar95", "ar98", "heavy", "khz", "slow25", "few3", "many30", "angles")


def motion(rng, t, tow):
    """Angles, rates, accelerations (n, 2) and carriage speed and acceleration (n,) of one recording."""
    q, qd, qdd = (np.zeros((len(t), 2)) for _ in range(3))
    for j in range(2):
        q[:, j] += rng.uniform(-1.0, 1.0)
        for _ in range(3):
            f, a, p = rng.uniform(0.1, 0.7), rng.uniform(0.1, 0.5), rng.uniform(0, 2 * np.pi)
            w = 2 * np.pi * f
            q[:, j] += a * np.sin(w * t + p)
            qd[:, j] += a * w * np.cos(w * t + p)
            qdd[:, j] -= a * w**2 * np.sin(w * t + p)
    u = tow * (1 - np.cos(2 * np.pi * t / t[-1])) / 2
    return q, qd, qdd, u, tow * np.pi / t[-1] * np.sin(2 * np.pi * t / t[-1])


def torque(arm, q, qd, qdd, u, du, water=None, drag=None):
    """Joint torques (n, 2) N m by virtual work of rods and strips; the carriage moves along +Y.

    `water` (velocity, acceleration), each (n, 2), is the water's own motion; `drag` gives C_D's factor from w, both (n, strips), and D.
    """
    tau = np.zeros_like(q)
    phi, om, al = np.cumsum(q, axis=1), np.cumsum(qd, axis=1), np.cumsum(qdd, axis=1)
    e = [np.stack([np.cos(phi[:, i]), np.sin(phi[:, i])], axis=1) for i in range(2)]
    n = [np.stack([-np.sin(phi[:, i]), np.cos(phi[:, i])], axis=1) for i in range(2)]
    base_v, base_a = np.stack([0 * u, u], axis=1), np.stack([0 * du, du], axis=1)
    water_v, water_a = (np.zeros_like(base_v), np.zeros_like(base_a)) if water is None else water
    for i, link in enumerate(arm["links"]):
        m, c, inertia, L, D = (link[k] for k in ("mass_kg", "com_m", "inertia_kg_m2", "length_m", "diameter_m"))
        start_v, start_a = base_v.copy(), base_a.copy()
        for k in range(i):
            Lk = arm["links"][k]["length_m"]
            start_v += Lk * om[:, k:k + 1] * n[k]
            start_a += Lk * (al[:, k:k + 1] * n[k] - om[:, k:k + 1] ** 2 * e[k])
        acc = start_a + c * (al[:, i:i + 1] * n[i] - om[:, i:i + 1] ** 2 * e[i])
        x = (np.arange(STRIPS) + 0.5) * L / STRIPS
        wet_v, wet_a = start_v - water_v, start_a - water_a
        w = (wet_v * n[i]).sum(axis=1)[:, None] + om[:, i:i + 1] * x
        # the inertia term's acceleration is taken in the link's own frame
        dw = ((wet_a * n[i]).sum(axis=1) - om[:, i] * (wet_v * e[i]).sum(axis=1))[:, None] + al[:, i:i + 1] * x
        factor = 1.0 if drag is None else drag(w, D)
        pressure = (water_a * n[i]).sum(axis=1)[:, None]  # its gradient pushes the displaced volume on (Morison et al. 1950)
        f = 0.5 * 1000 * arm["cd"][i] * factor * D * np.abs(w) * w + 1000 * np.pi / 4 * D**2 * (arm["cm"][i] * dw - pressure)
        for j in range(i + 1):
            lever_c = c * n[i] + sum((arm["links"][k]["length_m"] * n[k] for k in range(j, i)), start=np.zeros_like(acc))
            tau[:, j] += m * (acc * lever_c).sum(axis=1) + inertia * al[:, i]
            offset = sum((arm["links"][k]["length_m"] * (n[k] * n[i]).sum(axis=1) for k in range(j, i)), start=np.zeros(len(q)))
            tau[:, j] += (f * (x + offset[:, None])).sum(axis=1) * L / STRIPS
    return tau


def coloured(rng, n, rho):
    """Noise (n, 2) of unit variance with correlation `rho` from row to row."""
    e, made = rng.standard_normal((n, 2)), np.zeros((n, 2))
    made[0] = e[0]
    for k in range(1, n):
        made[k] = rho * made[k - 1] + np.sqrt(1 - rho**2) * e[k]
    return made


def campaign(seed, plant=None):
    """Return (kind, arm document, [(name, columns)]) of one arm, healthy unless `plant(true, t, motion)` gives other torques and angles."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    links = [{"length_m": rng.uniform(0.4, 0.6), "diameter_m": rng.uniform(0.05, 0.08), "mass_kg": rng.uniform(0.5, 2.0), "com_m": 0.25,
              "inertia_kg_m2": rng.uniform(0.01, 0.04)} for _ in range(2)]
    built = ("mass_kg", "com_m", "inertia_kg_m2")
    true = {"links": [{k: v * (1 + 0.01 * rng.standard_normal() * (k in built)) for k, v in link.items()} for link in links],
            "cd": rng.uniform(0.8, 1.4, 2), "cm": rng.uniform(0.6, 1.0, 2)}
    rate = {"khz": 1000.0, "slow25": 25.0}.get(kind, rng.choice([50.0, 100.0]))
    count = {"few3": 3, "many30": 30}.get(kind, int(rng.integers(5, 13)))
    recordings = []
    for k in range(count):
        t = np.arange(0, rng.uniform(4, 8), 1 / rate)
        q, qd, qdd, u, du = motion(rng, t, rng.uniform(0, 0.6) * (k % 3 == 0))
        if plant is None:
            tau = torque(true, q, qd, qdd, u, du)
        else:
            tau, q, qd, qdd = plant(true, t, (q, qd, qdd, u, du))
        rho = {"ar95": 0.95, "ar98": 0.98}.get(kind, 0.5)
        e = rng.standard_t(3, (len(t), 2)) / np.sqrt(3) if kind == "heavy" else coloured(rng, len(t), rho)
        size = 0.01 * tau.std(axis=0) * {"ratio3": 3.0, "ratio10": 10.0}.get(kind, 1.0) ** (k % 2)
        columns = {"t_s": t, "u0_m_s": u, "du0_m_s2": du}
        for j in range(2):
            columns[f"q{j + 1}_rad"] = q[:, j] + 3e-5 * rng.standard_normal(len(t))
            if kind != "angles":
                columns[f"dq{j + 1}_rad_s"] = qd[:, j] + 1e-3 * rng.standard_normal(len(t))
                columns[f"ddq{j + 1}_rad_s2"] = qdd[:, j] + 1e-2 * rng.standard_normal(len(t))
            columns[f"tau{j + 1}_Nm"] = tau[:, j] + size[j] * e[:, j]
        recordings.append((f"r{k:02d}", columns))
    arm = {"schema": "nnhydro/arm/1", "name": f"healthy_{seed}", "fluid": {"density_kg_m3": 1000.0, "kinematic_viscosity_m2_s": 1e-6},
           "links": [{k: float(v) for k, v in link.items()} for link in links]}
    return kind, arm, recordings
