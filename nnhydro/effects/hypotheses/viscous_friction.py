"""Hypothesis: a joint drags in proportion to its speed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

from torch import Tensor

from nnhydro.effects.effect import ANY_SIZE, Effect, LoadEffect, Signature, Values, effect, of_joint, parameter
from nnhydro.effects.quantity import Interval, Quantity
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.viscous_friction import ViscousTerm


@effect
@final
@dataclass(frozen=True)
class ViscousFriction(LoadEffect):
    """Friction proportional to speed at one joint."""

    id = "viscous_friction"
    family = "viscous"
    name = "viscous friction"
    mechanism = "Grease, a fluid film or the damping of the motor resists the joint in proportion to its speed."
    equation = "tau_j = b (1 + a sgn(qd_j)) qd_j"
    source = "Rivera (1995), section 3.2: one aggregate friction law a joint"
    signature = Signature(
        depends_on=("qd",), parity="odd", region="fast turning of that joint",
        excited_by="turning at several speeds while the links rest in the flow",
        mistaken_for=("coulomb_friction", "reynolds_drag", "drag_form", "flow_memory"),
    )
    acts = "joint"
    everywhere = True
    standard = True
    varies = True
    dissipates = True
    shown_by_reversals = ("asymmetry",)

    coefficient: Values = parameter("N m s/rad", 0.05, ANY_SIZE, "friction torque per unit joint rate, b", per="arm")
    asymmetry: Values = parameter("1", 0.0, (-0.5, 0.5), "share by which b is larger forwards and smaller backwards, a", per="arm",
                                  linear=False, grid=(0.0,), absent=True, detail=(-0.2, 0.2))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d coefficient, (n, joints, 1)."""
        column = of_joint(ViscousTerm(self.coefficient).columns(flow), self.joint)
        return column + self.asymmetry[0] * column.abs() if any(self.asymmetry) else column

    def quantities(self) -> dict[str, Quantity]:
        """Return the coefficient and, where it differs between the directions, by what share."""
        share = {"asymmetry": Quantity(self.asymmetry[0], "1")} if any(self.asymmetry) else {}
        return {"coefficient": Quantity(self.coefficient[0], "N m s/rad")} | share

    def statement(self, intervals: Mapping[str, Interval] | None = None, instead: Mapping[str, str] | None = None) -> str:
        """Return the finding as one sentence; of directions that may be alike it says nothing."""
        low, high = (intervals or {}).get("asymmetry", (1.0, 1.0))
        return Effect.statement(replace(self, asymmetry=(0.0,)) if low <= 0 <= high else self, intervals, instead)

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        other = f"; forwards it is larger by the share {text['asymmetry']}, backwards smaller" if any(self.asymmetry) else ""
        return f"Joint {self.joint} has viscous friction of {text['coefficient']}, proportional to its speed{other}."
