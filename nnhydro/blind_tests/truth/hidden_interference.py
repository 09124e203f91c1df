"""Hidden causes in the water between bodies: the other link's wake, a wall.

    link_interference  a strip looks ahead along its own motion; link 1 (or 2) passing its ray at distance b after the way r takes
                       a exp(-(b/spread)^2) / (1 + r/6D) of its speed, spread = 0.5 D + 0.12 r; C_D falls with the square
    wall_proximity     C_D, C_M (1 + a (D/gap)) (plain) or 1 + 4 a exp(-gap/3D) (other), gap to a wall along the tow
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nnhydro.blind_tests.truth.flow import LinkFlow, dot
from nnhydro.blind_tests.truth.registry import hides
from nnhydro.blind_tests.truth.world import Array, Cause, Draft, Generator, TrueArm

POINTS = 10  # of the shading link


def shadow(flow: LinkFlow, other: int) -> Array:
    """Return the depth (n, s) in 0..1 of link `other`'s wake at the strips of this link."""
    D, F = flow.arm.links[other].diameter, flow.frames
    speed = np.sqrt(dot(flow.v, flow.v))
    ahead = flow.v / (speed[..., None] + 1e-3)
    deepest = np.zeros(speed.shape)
    for z in (np.arange(POINTS) + 0.5) * flow.arm.links[other].length / POINTS:
        to = (F.P[:, other] + z * F.e[:, other])[:, None] - flow.pos
        way = dot(to, ahead)
        offset = to[..., 0] * ahead[..., 1] - to[..., 1] * ahead[..., 0]
        spread = 0.5 * D + 0.5 * flow.arm.links[other].length / POINTS + 0.12 * np.maximum(way, 0)
        depth = np.exp(-((offset / spread) ** 2)) / (1 + np.maximum(way, 0) / (6 * D)) * np.clip(way / D, 0, 1)
        deepest = np.maximum(deepest, depth)
    depth_there: Array = deepest * speed**2 / (speed**2 + 0.05**2)
    return depth_there


@hides("link_interference", two_links=True)
def link_interference(rng: Generator, arm: TrueArm) -> Draft:
    """Draw which link lies in the other's wake."""
    shielded, gentle = (1 if rng.random() < 0.75 else 0), bool(rng.random() < 0.4)

    def make(a: float) -> Cause:
        """Return the cause whose depth is `a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            if flow.i != shielded:
                return flow
            lost = a * shadow(flow, 1 - shielded)
            return flow.times(1 - 0.8 * lost if gentle else (1 - lost) ** 2)
        return Cause("link_interference", shielded + 1, "other" if gentle else "plain", "a link loses drag in the other's wake",
                     {"depth": (a, "1")}, water, order=1)
    return Draft(make, 0.02, 1.0)


@hides("wall_proximity")
def wall_proximity(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a tank wall at one side of the tow."""
    fading, wall = bool(rng.random() < 0.4), arm.reach + float(rng.uniform(0.03, 0.10))

    def make(a: float) -> Cause:
        """Return the cause whose strength is `a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            D = flow.link.diameter
            gap = np.maximum(wall - flow.pos[..., 0], 0.1 * D)
            factor = 1 + (4 * a * np.exp(-gap / (3 * D)) if fading else a * D / (gap + 0.3 * D))
            return replace(flow.times(factor), C_M=flow.C_M * factor)
        return Cause("wall_proximity", None, "other" if fading else "plain", "C_D and C_M rise near a wall",
                     {"strength": (a, "1"), "wall": (wall, "m")}, water, order=1)
    return Draft(make, 0.02, 2.5)
