"""Campaigns as a stranger would bring them: one arm of one link, simulated here without nnhydro, written as loggers and spreadsheets write.

    tau = (I + m c^2 + 1/3 m' L^3 C_M) qdd + int 1/2 rho C_D(Re) D |x qd| x qd x dx + cable + friction + noise,   m' = rho pi D^2 / 4
"""

from datetime import datetime, timedelta

import numpy as np
import yaml

L, D, MASS, COM, INERTIA, RHO, NU = 0.8, 0.08, 3.0, 0.4, 0.16, 1000.0, 1e-6
C_D, C_M = 1.15, 0.9
X = (np.arange(20) + 0.5) * L / 20
ARM = {"schema": "nnhydro/arm/1", "name": "a stranger's arm", "fluid": {"density_kg_m3": RHO},
       "links": [{"length_m": L, "diameter_m": D, "mass_kg": MASS, "com_m": COM, "inertia_kg_m2": INERTIA}]}


def motion(k, rate, seconds=10.0):
    """Angle, rate and acceleration (n,) of run `k`: three sines that begin at rest."""
    rng = np.random.default_rng(100 + k)
    t = np.arange(round(seconds * rate)) / rate
    w, a = 2 * np.pi * rng.uniform(0.08, 0.45, 3), rng.uniform(0.2, 0.5, 3) * rng.choice([-1, 1], 3)
    phase = w * t[:, None]
    return t, (a * (1 - np.cos(phase))).sum(1), (a * w * np.sin(phase)).sum(1), (a * w**2 * np.cos(phase)).sum(1)


def crisis(speed):
    """C_D of a cylinder that falls by half where the boundary layer turns turbulent."""
    return C_D * (1 - 0.5 / (1 + np.exp(-(np.abs(speed) * D / NU - 6e4) / 8e3)))


def torque(q, qd, qdd, extras=()):
    """The drive's torque (n,) N m."""
    speed = qd[:, None] * X
    drag = (0.5 * RHO * (crisis(speed) if "drag crisis" in extras else C_D) * D * np.abs(speed) * speed * X).sum(1) * (L / 20)
    tau = (INERTIA + MASS * COM**2 + RHO * np.pi / 4 * D**2 * L**3 / 3 * C_M) * qdd + drag
    if "slack cable" in extras:
        tau = tau + 6.0 * np.where(q > 0.5, q - 0.5, np.where(q < -0.9, q + 0.9, 0.0))
    if "Stribeck" in extras:
        tau = tau + (0.8 + 1.2 * np.exp(-(qd / 0.12) ** 2)) * np.tanh(qd / 0.01)
    return tau


def runs(rate, extras=(), count=6, noise=0.02):
    """Time, angle (an encoder of 16 bits) and torque of `count` runs."""
    for k in range(count):
        t, q, qd, qdd = motion(k, rate, 5.0 if rate > 500 else 10.0)
        tau = torque(q, qd, qdd, extras)
        tau = tau + noise * tau.std() * np.random.default_rng(k).standard_normal(len(t))
        yield t, np.round(q / (2 * np.pi / 65536)) * (2 * np.pi / 65536), tau


def plain(t, q, tau):
    """CSV with our own names."""
    return "t_s,q1_rad,tau1_Nm\n" + "".join(f"{a:.6f},{b:.7f},{c:.5f}\n" for a, b, c in zip(t, q, tau, strict=True))


def milliseconds(t, q, tau):
    """A logger at 1 kHz whose clock counts milliseconds: now and then two rows have the same stamp."""
    jitter = np.random.default_rng(1).uniform(-2.0e-4, 2.0e-4, len(t))
    stamps = np.maximum.accumulate(np.round(np.maximum(t + 0.6 * jitter, 0), 3))
    twice = np.linspace(7, len(t) - 9, max(len(t) // 250, 1)).astype(int)
    stamps[twice] = stamps[twice - 1]
    return "t_s,q1_rad,tau1_Nm\n" + "".join(f"{a:.3f},{b:.7f},{c:.5f}\n" for a, b, c in zip(stamps, q, tau, strict=True))


def german(t, q, tau):
    """A spreadsheet in German: semicolons, decimal commas, local time, degrees, a row of units."""
    start = datetime(2024, 5, 3, 14, 7, 12)
    rows = ["Zeit;Winkel;Moment;Bemerkung", "-;°;Nm;-"]
    for a, b, c in zip(t, np.degrees(q), tau, strict=True):
        when = (start + timedelta(seconds=float(a))).strftime("%d.%m.%Y %H:%M:%S,%f")[:-3]
        rows.append(f"{when};{b:.6f};{c:.5f};".replace(".", ",").replace(when.replace(".", ","), when))
    return "\r\n".join(rows) + "\r\n"


def write(folder, kind, count=6):
    """Write the campaign `kind` of `count` runs to `folder` and return it."""
    rate = {"1 kHz": 1000.0, "20 Hz": 20.0}.get(kind, 100.0)
    extras = {"slack cable": ("slack cable",), "drag crisis": ("drag crisis",), "Stribeck": ("Stribeck",),
              "everything at once": ("slack cable", "drag crisis", "Stribeck")}.get(kind, ())
    text = {"German": german, "1 kHz": milliseconds, "everything at once": german}.get(kind, plain)
    (folder / "recordings").mkdir(parents=True)
    (folder / "recordings" / "Thumbs.db").write_bytes(b"\0")
    for k, run in enumerate(runs(rate, extras, count)):
        content = text(*run)
        (folder / "recordings" / f"Lauf {k + 1}.csv").write_bytes(content.encode("utf-16") if text is german else content.encode())
    (folder / ("arm.yml" if text is german else "arm.yaml")).write_text(yaml.safe_dump(ARM))
    if text is german:
        (folder / "columns.yaml").write_text("columns: {t_s: Zeit, q1_rad: Winkel, tau1_Nm: Moment}\n")
    return folder


HEALTHY = ("German", "1 kHz", "20 Hz")
HIDING = ("slack cable", "drag crisis", "Stribeck", "everything at once")
