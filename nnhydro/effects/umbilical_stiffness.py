"""Hypothesis: a hose or cable pulls a joint back."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from typing import final

import numpy as np
import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow

FURTHEST = 2 * pi  # rad: a rest angle beyond a turn is no hose's but that of a constant torque


@effect
@final
@dataclass(frozen=True)
class UmbilicalStiffness(LoadEffect):
    """A spring at one joint with a rest angle of its own, linear or growing stiffer or softer as it bends."""

    id = "umbilical_stiffness"
    family = "restoring"
    name = "hose or cable stiffness"
    mechanism = "A hose, cable or boot across the joint bends with it and pulls it back towards the angle at which it lies slack."
    equation = "tau_j = k q_j + p, or with k_2 q_j^2 + k_3 q_j^3 besides;  tau_j(q_rest) = 0"
    source = "linear spring, and the first terms of any other: from general knowledge, not checked"
    signature = Signature(
        depends_on=("q",), parity="mixed", region="grows with the distance from the rest angle, in every recording alike",
        excited_by="holding the joint at both ends of its range", mistaken_for=("torque_bias", "torque_drift", "buoyancy_tilt"),
        zero_at_rest=False,
    )
    acts = "joint"

    stiffness: Values = parameter("N m/rad", 0.5, (0.0, 1e4), "spring constant", per="arm")
    preload: Values = parameter("N m", 0.0, (-1e4, 1e4), "torque at q = 0: -stiffness times rest angle, where it is linear", per="arm")
    quadratic: Values = parameter("N m/rad^2", 0.0, (-1e4, 1e4), "how much stiffer it is on one side, k_2", per="arm")
    cubic: Values = parameter("N m/rad^3", 0.0, (-1e4, 1e4), "how much stiffer it grows on both sides, k_3", per="arm")

    def narrower(self) -> tuple["UmbilicalStiffness", ...]:
        """Return the linear spring alone."""
        return (replace(self, quadratic=(), cubic=()),)

    @property
    def linear(self) -> bool:
        """Whether its pull grows in proportion."""
        return not any((*self.quadratic, *self.cubic))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (stiffness, preload, quadratic, cubic), (n, joints, 4), or of the first two alone."""
        q = flow.motion.q[:, self.joint - 1]
        bent = [q**2] * len(self.quadratic) + [q**3] * len(self.cubic)
        return at_joint(torch.stack([q, torch.ones_like(q), *bent], dim=1), self.joint, flow.arm.n_links)

    def _rest(self) -> tuple[float, float] | None:
        """Stiffness and angle where it lies slack, the least one of those towards which it pulls; None where it pulls nowhere."""
        law = np.polynomial.Polynomial([self.preload[0], self.stiffness[0], *(self.quadratic or (0.0,)), *(self.cubic or (0.0,))]).trim()
        slope = law.deriv()
        zeros = [float(z.real) for z in np.asarray(law.roots(), complex) if abs(z.imag) < 1e-9 * (1 + abs(z))] if any(law.coef) else [0.0]
        return min(((float(slope(q)), q) for q in zeros if slope(q) > 0), key=lambda one: abs(one[1]), default=None)

    def plausible(self) -> bool:
        """Return whether the rest angle is one that a hose could have."""
        rest = self._rest()
        return not any(self.linear_values()) or (rest is not None and abs(rest[1]) <= FURTHEST)

    def quantities(self) -> dict[str, Quantity]:
        """Return the rest angle, and the stiffness there."""
        k, q = self._rest() or (self.stiffness[0], 0.0)
        return {"stiffness": Quantity(k, "N m/rad"), "rest_angle": Quantity(q, "rad")}

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        bent = "" if self.linear else f" near there, a pull that grows {'more' if sum(self.cubic) > 0 else 'less'} than in proportion"
        return f"Joint {self.joint} is pulled back towards {said['rest_angle']} by {said['stiffness']}{bent}: a hose or cable."
