"""Viscous friction: a torque against the rotation of a joint, proportional to its rate.

    tau_j = b_j qd_j                                        [N m]

    b_j   `coefficient` of joint j                            [N m s/rad]
    qd_j  rate of joint j, relative to the link inboard     [rad/s]

Holds for full films of lubricant and for damping in gears and belts. Source: one aggregate friction law a joint, as Rivera (1995),
section 3.2, reports from Dupont (1993).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, final

from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.physics.joints import diagonal_columns
from nnhydro.physics.load_term import ANY_SIZE, LinearTerm, Values, parameter


@final
@dataclass(frozen=True)
class ViscousTerm(LinearTerm):
    """Friction proportional to speed with one coefficient per joint."""

    kind: ClassVar[str] = "viscous_friction"
    row_by_row = True
    former: ClassVar[Mapping[str, str]] = {"b": "coefficient"}
    coefficient: Values = parameter("N m s/rad", 0.02, ANY_SIZE, "friction torque per unit joint rate", per="joint")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d coefficient, (n, joints, joints)."""
        return diagonal_columns(flow.motion.qd)
