"""Hidden causes in the drag law: Reynolds number, skin, a body at the tip, the span.

    reynolds_drag  C_D (1 + a (1/2 - 1/(1 + (Re/Re_0)^-k))) (plain: a falling logistic in ln Re) or C_D (Re^2/Re_0^2 + 0.01)^(-a/2) (other)
    axial_drag     1/2 rho C_x d |u| u along the link (plain) or |u|^0.8 u (other, turbulent skin)
    tip_drag       1/2 rho C_d S |v| v of a sphere (plain), |v|^0.85 v (other)
    drag_form      C_D (1 + a (2x/L - 1)) (plain) or 1 + a cos(2 pi x/L) (other)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nnhydro.blind_tests.truth.flow import LinkFlow
from nnhydro.blind_tests.truth.registry import hides
from nnhydro.blind_tests.truth.world import Cause, Draft, Generator, TrueArm


@hides("reynolds_drag")
def reynolds_drag(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a drag coefficient that falls with the local Reynolds number."""
    power, Re0, k = bool(rng.random() < 0.5), float(np.exp(rng.uniform(np.log(1.2e4), np.log(4e4)))), rng.uniform(1.5, 4.0)

    def make(a: float) -> Cause:
        """Return the cause whose exponent or drop is `a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            z = np.abs(flow.w) * flow.link.diameter / flow.arm.nu / Re0
            return flow.times((z**2 + 0.01) ** (-a / 2) if power else 1 + a * (1 / (1 + z**k) - 0.5))
        return Cause("reynolds_drag", None, "other" if power else "plain", "C_D falls with the local Reynolds number",
                     {"exponent" if power else "drop": (a, "1"), "reynolds": (Re0, "1")}, water, order=1)
    return Draft(make, 0.01, 0.6 if power else 1.4)


@hides("axial_drag", two_links=True)
def axial_drag(rng: Generator, arm: TrueArm) -> Draft:
    """Draw skin friction along the links."""
    p = 0.8 if rng.random() < 0.4 else 1.0

    def make(a: float) -> Cause:
        """Return the cause whose cx is `a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            f = 0.5 * flow.arm.rho * a * flow.link.diameter * np.abs(flow.u) ** p * flow.u
            return replace(flow, extra=flow.extra + f[..., None] * flow.e)
        return Cause("axial_drag", None, "plain" if p == 1 else "other", "skin friction along the links", {"cx": (a, "1")}, water, order=1)
    return Draft(make, 0.002, 1.0)


@hides("tip_drag")
def tip_drag(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a body at the tip."""
    p = 0.85 if rng.random() < 0.4 else 1.0

    def make(a: float) -> Cause:
        """Return the cause whose cd_area is `a` m2."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            if flow.i < len(flow.arm.links) - 1:
                return flow
            v = flow.v[:, -1]  # the last strip, half a strip inside the tip
            pull = 0.5 * flow.arm.rho * a * np.linalg.norm(v, axis=1, keepdims=True) ** p * v
            extra = flow.extra.copy()
            extra[:, -1] += pull / (flow.x[1] - flow.x[0])
            return replace(flow, extra=extra)
        return Cause("tip_drag", None, "plain" if p == 1 else "other", "drag of a body at the tip", {"cd_area": (a, "m2")}, water, order=1)
    return Draft(make, 2e-5, 0.03)


@hides("drag_form")
def drag_form(rng: Generator, arm: TrueArm) -> Draft:
    """Draw a drag coefficient that varies along the span."""
    wavy, side = bool(rng.random() < 0.4), float(rng.choice([-1.0, 1.0]))

    def make(a: float) -> Cause:
        """Return the cause whose span is `side * a`."""
        def water(flow: LinkFlow) -> LinkFlow:
            """Return the flow past a link as this cause changes it."""
            z = flow.x / flow.link.length
            return flow.times(1 + side * a * (np.cos(2 * np.pi * z) if wavy else 2 * z - 1))
        return Cause("drag_form", None, "other" if wavy else "plain", "C_D varies along the span",
                     {"span": (side * a, "1")}, water, order=1)
    return Draft(make, 0.02, 0.95)
