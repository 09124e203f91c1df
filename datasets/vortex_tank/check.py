"""Prints the vortex tank's drag: python datasets/vortex_tank/check.py   (half a minute of one core)

A strip is set off within half a diameter and goes on at 1 D/s; C_D is the mean force over 1/2 rho D U^2 between two distances travelled.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from vortices import forces

STEPS = (0.02, 0.01)  # s; the recordings are computed at 0.004 s and speeds of 5 to 40 D/s
BETWEEN = (1, 3, 6, 10, 20, 40, 60)  # diameters travelled

for step in STEPS:
    t = np.arange(0.0, BETWEEN[-1] + 1.0, step)
    u = np.tanh(t / 0.5)[:, None]
    C_D = -2 * forces(t, u, np.gradient(u, t, axis=0))[:, 0]
    s = np.cumsum(u[:, 0]) * step
    means = [f"{a} to {b} D: {C_D[(s > a) & (s <= b)].mean():.2f}" for a, b in pairwise(BETWEEN)]
    print(f"step {step} s: C_D " + ", ".join(means))
