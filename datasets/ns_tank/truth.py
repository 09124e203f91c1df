"""Water of a two-link arm whose strips are Navier-Stokes cylinders. Imports nothing of nnhydro.

The arm, the strips' places and the torques: datasets/strip_arm.py. No law of drag or added mass stands here. SI units.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from flow import Grid, forces
from numpy.typing import NDArray

sys.path.append(str(Path(__file__).parents[1]))

from strip_arm import Link, Motion, strip_motions

Array = NDArray[np.float64]

RHO, NU = 1190.0, 2.4e-5  # kg/m3, m2/s: water with 73 % glycerine by mass at 20 degrees
GRID = Grid(angles=128, layers=112, wall=0.010)


def strip_forces(m: Motion, links: list[Link]) -> Array:
    """f (n, strips) N/m of the water on every strip: the Navier-Stokes runs (minutes)."""
    w, dw = strip_motions(m, links)
    return RHO * links[0].diameter**3 * forces(m.t, w, dw, NU / links[0].diameter**2, GRID)
