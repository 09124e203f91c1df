"""Compares the flow solver with other solutions: python datasets/ns_tank/check.py [cylinder] [street] [start]   (minutes of one core each)

    cylinder  the forces of datasets/cfd_cylinder (OpenFOAM, second order, 21,888 cells), rms of the difference over rms of the force
    street    drag coefficient and Strouhal number of the developed vortex street at Re 100 and 200
    start     impulsive start at Re 550 and 1000: C_D sqrt(Re t U/D) / (4 sqrt(pi)), 1 in the limit t -> 0 (Rayleigh layers of the potential
              flow, friction and pressure alike: Collins & Dennis 1973; Bar-Lev & Yang 1975, J. Fluid Mech. 72, 625)
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from flow import FAR, Grid, forces
from numpy.typing import NDArray

Array = NDArray[np.float64]

OTHER = Path(__file__).parent.parent / "cfd_cylinder" / "recordings"
D, NU, RHO = 0.02, 1e-6, 1000.0  # of cfd_cylinder
CYCLES = {"sin_kc5": 4.0}  # s compared: its first two cycles
PUBLISHED = {100: ("1.33 to 1.37", "0.164 to 0.166"), 200: ("1.31 to 1.36", "0.195 to 0.197")}
ENDS = 3  # rows at either end that are not compared


def cylinder() -> None:
    """One line a recording."""
    for path in sorted(OTHER.glob("*.csv")):
        table = np.genfromtxt(path, delimiter=",", names=True)
        table = table[table["t_s"] <= CYCLES.get(path.stem, np.inf)]
        u, du = table["u0_m_s"][:, None] / D, table["du0_m_s2"][:, None] / D
        F = RHO * D**3 * forces(table["t_s"], u, du, NU / D**2)[:, 0]
        part = slice(ENDS, -ENDS)
        off, size = (np.sqrt(np.mean(x[part] ** 2)) for x in (F - table["Fx_N_per_m"], table["Fx_N_per_m"]))
        print(f"{path.stem:12s} {100 * off / size:5.1f} %", flush=True)


def street() -> None:
    """Both Reynolds numbers at once: speeds of 1 and 2 D/s in one water."""
    t = np.arange(0.0, 110.0, 0.02)
    u = np.tanh(t / 0.5)[:, None] * np.array([1.0, 2.0])
    F = forces(t, u, np.gradient(u, t, axis=0), 0.01, Grid(96, 96, 0.015), longest=0.02, fades=8.0)
    for b, Re in enumerate((100, 200)):
        late = t > (70.0 if b == 0 else 60.0)
        C = -2 * F[late, b] / u[-1, b] ** 2
        spectrum = np.abs(np.fft.rfft((C - C.mean()) * np.hanning(len(C)), 16 * len(C)))
        hz = np.fft.rfftfreq(16 * len(C), t[1] - t[0])[spectrum.argmax()]
        print(f"Re {Re}: C_D {C.mean():.3f} (published {PUBLISHED[Re][0]}), Strouhal number {hz / 2 / u[-1, b]:.4f} "
              f"({PUBLISHED[Re][1]}); outer boundary at {FAR:g} D", flush=True)


def start() -> None:
    """C_D over its early limit at times U t/D."""
    for Re in (550, 1000):
        t = np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 500)])
        u = np.ones((len(t), 1))
        F = forces(t, u, 0 * u, 1.0 / Re, Grid(192, 160, 0.004), longest=0.002, fades=0.1)[:, 0]
        shown = ", ".join(f"{T:g}: C_D {-2 * F[k]:.3f} ratio {-2 * F[k] * np.sqrt(Re * T) / (4 * np.sqrt(np.pi)):.3f}"
                          for T in (0.01, 0.03, 0.1, 0.3, 1.0, 1.5, 2.0, 2.5) for k in [int(np.searchsorted(t, T))])
        print(f"Re {Re}: {shown}", flush=True)


if __name__ == "__main__":
    for name in sys.argv[1:] or ("cylinder", "street", "start"):
        {"cylinder": cylinder, "street": street, "start": start}[name]()
