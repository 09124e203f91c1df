"""Hypothesis: a joint rubs with a constant torque against its rotation."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.dry_contact import DryContact
from nnhydro.effects.effect import ANY_SIZE, LoadEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.coulomb_friction import CoulombTerm


@effect
@final
@dataclass(frozen=True)
class CoulombFriction(DryContact, LoadEffect):
    """Constant friction at one joint, whose contact may bend like a spring before it slips."""

    id = "coulomb_friction"
    family = "dry_friction"
    name = "Coulomb friction"
    mechanism = "Dry contact in a seal, bearing or gear resists the motion of the joint with the same torque at any speed."
    equation = ("tau_j = T_C z,  dz/dt = (sign(qd_j) - z) |qd_j| / z_0,  v_0 <= 0.005 rad/s;  z_0 = 0: z = tanh(qd_j / v_0)")
    source = ("Rivera (1995), section 3.2, eq. 3-2-4: friction opposes rotation; a contact that bends: dz/dt of the LuGre model at a "
              "level that the speed does not change (known as Dahl's: not checked), in J. Christopherson's collection, "
              "https://github.com/jchristopherson/friction, README.md")
    signature = Signature(
        depends_on=("qd",), parity="odd", region="everywhere but at rest: a step where the joint reverses",
        excited_by="slow reversals of that joint", mistaken_for=("stribeck_friction", "load_friction", "viscous_friction", "backlash"),
    )
    acts = "joint"
    everywhere = True
    standard = True
    varies = True
    dissipates = True

    level: Values = parameter("N m", 0.1, ANY_SIZE, "friction torque while the joint turns", per="arm")
    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d level, (n, joints, 1)."""
        z = CoulombTerm(self.level, self.width, sum(self.bending)).sign(flow.motion, self.joint)
        return at_joint(z[:, None], self.joint, flow.arm.n_links)

    def quantities(self) -> dict[str, Quantity]:
        """Return the level and, where the contact bends, over how much of turning."""
        return {"level": Quantity(self.level[0], "N m")} | self.bent()

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        bent = f" The friction reaches this level {text['bending']} after a reversal (presliding)." if any(self.bending) else ""
        return f"Joint {self.joint} has dry (Coulomb) friction of {text['level']}, the same at any speed.{bent}"
