"""Hypothesis: a hose or cable pulls a joint back."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import pi
from typing import final

import numpy as np
import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_VALUE, LoadEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow

FURTHEST = 2 * pi  # rad: a rest angle beyond a turn is no hose's but that of a constant torque
SIDEWAYS = 1.0  # rad: a hose stiffens or softens about the angle at which it lies slack, not about another one
NONE = 1e-9  # of the largest torque within a turn: terms below it are no part of the law


@effect
@final
@dataclass(frozen=True)
class UmbilicalStiffness(LoadEffect):
    """A spring at one joint with a rest angle, linear or with a stiffness that grows or falls with the angle."""

    id = "umbilical_stiffness"
    family = "restoring"
    name = "hose or cable stiffness"
    mechanism = "A hose, cable or boot across the joint pulls it back towards the angle at which it is slack."
    equation = "tau_j = k x + p, or with k_2 x^2 + k_3 x^3 besides,  x = q_j - q_mean;  tau_j(q_rest) = 0"
    source = ("MathWorks, Nonlinear Rotational Spring, two-sided polynomial: "
              "https://uk.mathworks.com/help/sdl/ref/nonlinearrotationalspring.html; the same terms on both sides are ours")
    signature = Signature(
        depends_on=("q",), parity="mixed", region="grows with the distance from the rest angle, in every recording alike",
        excited_by="holding the joint at both ends of its range", mistaken_for=("torque_bias", "torque_drift", "buoyancy_tilt"),
        zero_at_rest=False,
    )
    acts = "joint"

    stiffness: Values = parameter("N m/rad", 0.5, ANY_VALUE, "torque per angle at x = 0: the spring constant of a linear one", per="arm")
    preload: Values = parameter("N m", 0.0, ANY_VALUE, "torque at x = 0: stiffness times q_mean - q_rest, where linear", per="arm")
    quadratic: Values = parameter("N m/rad^2", 0.0, ANY_VALUE, "asymmetry of the stiffness, k_2", per="arm", absent=True)
    cubic: Values = parameter("N m/rad^3", 0.0, ANY_VALUE, "growth of the stiffness on both sides, k_3", per="arm", absent=True)

    about: float = field(default=0.0, kw_only=True)  # rad: q_mean, so that its size hangs on no choice of the angle's origin

    def centre(self, angles: tuple[float, ...]) -> "UmbilicalStiffness":
        """Return the law about the mean angle of its joint."""
        return replace(self, about=angles[self.joint - 1])

    def narrower(self) -> tuple["UmbilicalStiffness", ...]:
        """Return the linear spring alone."""
        return (replace(self, quadratic=(), cubic=()),)

    @property
    def linear(self) -> bool:
        """Whether its pull grows in proportion."""
        return not any((*self.quadratic, *self.cubic))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d (stiffness, preload, quadratic, cubic), (n, joints, 4), or of the first two alone."""
        x = flow.motion.q[:, self.joint - 1] - self.about
        bent = [x**2] * len(self.quadratic) + [x**3] * len(self.cubic)
        return at_joint(torch.stack([x, torch.ones_like(x), *bent], dim=1), self.joint, flow.arm.n_links)

    def _law(self) -> np.polynomial.Polynomial:
        """The torque over x, without terms too small to measure."""
        c = [self.preload[0], self.stiffness[0], *self.quadratic, *self.cubic]
        sizes = [abs(x) * FURTHEST**n for n, x in enumerate(c)]
        while len(c) > 1 and sizes[len(c) - 1] <= NONE * max(sizes):
            c.pop()
        return np.polynomial.Polynomial(c)

    def _rest(self) -> tuple[float, float] | None:
        """Stiffness and x where it lies slack, the least one of those towards which it pulls; None where it pulls nowhere."""
        law = self._law()
        slope, zeros = law.deriv(), np.asarray(law.roots(), complex)
        found = [(float(slope(z.real)), float(z.real)) for z in zeros if abs(z.imag) < 1e-9 * (1 + abs(z)) and slope(z.real) > 0]
        return min(found, key=lambda rest: abs(rest[1]), default=None)

    def plausible(self) -> bool:
        """Return whether the rest angle is one that a hose could have, and whether what bends bends about it."""
        rest, bend = self._rest(), self._law().deriv(2)
        if rest is None or abs(rest[1]) > FURTHEST:
            return not any(self.linear_values())
        turns = float(-bend.coef[0] / bend.coef[1]) if bend.degree() == 1 else None
        return not any(bend.coef) or (turns is not None and abs(turns - rest[1]) <= SIDEWAYS)

    def quantities(self) -> dict[str, Quantity]:
        """Return the rest angle, and the stiffness there."""
        k, x = self._rest() or (self.stiffness[0], 0.0)
        return {"stiffness": Quantity(k, "N m/rad"), "rest_angle": Quantity(self.about + x, "rad")}

    def _grows(self) -> str:
        """How its stiffness changes within a radian of its rest angle, in words."""
        rest = self._rest()
        if self.linear or rest is None:
            return ""
        stiffer = [self._law().deriv()(rest[1] + side) > rest[0] for side in (-1.0, 1.0)]
        if len(set(stiffer)) > 1:
            return " Its stiffness is larger on one side of this angle than on the other."
        return f" Its stiffness {'grows' if stiffer[0] else 'falls'} away from this angle."

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"A hose or cable pulls joint {self.joint} towards {text['rest_angle']} with a stiffness of {text['stiffness']}."
                f"{self._grows()}")
