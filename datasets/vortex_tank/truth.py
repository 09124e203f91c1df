"""Water of a two-link arm whose strips shed discrete vortices. Imports nothing of nnhydro.

The arm, the strips' places and the torques: datasets/strip_arm.py. No law of drag or added mass stands here. SI units.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from vortices import forces

sys.path.append(str(Path(__file__).parents[1]))

from strip_arm import Link, Motion, strip_motions

Array = NDArray[np.float64]

RHO = 1000.0  # kg/m3


def strip_forces(m: Motion, links: list[Link]) -> Array:
    """f (n, strips) N/m of the water on every strip: the vortex runs (seconds)."""
    w, dw = strip_motions(m, links)
    return RHO * links[0].diameter**3 * forces(m.t, w, dw)
