"""Hypothesis: a joint rubs the harder the more torque it carries."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.dry_contact import DryContact
from nnhydro.effects.effect import ANY_SIZE, InstrumentEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.joints import DRY_WIDTH, SIGN_WIDTH


@effect
@final
@dataclass(frozen=True)
class LoadFriction(DryContact, InstrumentEffect):
    """Friction that grows with the torque carried by one joint, from a level without load."""

    id = "load_friction"
    family = "dry_friction"
    name = "load-dependent friction"
    mechanism = "The torque presses gear teeth and bearings together, so that their friction grows with it."
    equation = ("reading_j = tau_j + (T_0 + mu |tau_j|) z,  dz/dt = (sign(qd_j) - z) |qd_j| / z_0;  "
                "z_0 = 0: z = tanh(qd_j / v),  v <= 0.005 rad/s, under load <= 0.02 rad/s")
    source = ("level and share of the torque carried: Rhoban, BAM, friction model M3, "
              "https://bam.readthedocs.io/en/latest/theory/models.html; Rivera (1995), section 3.2, names losses that grow with load; "
              "a contact that bends: see coulomb_friction")
    signature = Signature(
        depends_on=("qd", "tau"), parity="odd", region="where the joint turns under load, nothing where it turns unloaded",
        excited_by="the same speed with and without load", mistaken_for=("coulomb_friction", "stribeck_friction", "torque_gain"),
    )
    acts = "joint"
    varies = True
    stage = 1
    dissipates = True

    coefficient: Values = parameter("1", 0.05, (0.0, 0.9), "friction torque per unit of torque carried", per="arm")
    level: Values = parameter("N m", 0.1, ANY_SIZE, "friction torque without load, T_0", per="arm", absent=True)

    def narrower(self) -> tuple["LoadFriction", ...]:
        """Return the law without a level."""
        return (replace(self, level=()),)

    def columns(self, seen: SensorView) -> Tensor:
        """Return |tau_j| sgn(qd_j) and sgn(qd_j) at the joint as read, (n, joints, 2), or the first alone."""
        signs = [self.sign(seen.motion, widths) for widths in (SIGN_WIDTH / DRY_WIDTH, 1.0)]
        load, unloaded = seen.joint_torque(seen.tau)[:, self.joint - 1].abs() * signs[0], signs[1:] if self.level else []
        shapes = torch.stack([load, *unloaded], dim=1)
        return seen.as_read(at_joint(shapes, self.joint, seen.arm.n_links))

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading with the friction."""
        return seen.tau + self.change(seen)

    def quantities(self) -> dict[str, Quantity]:
        """Return coefficient and level and, where the contact bends, over how much of turning."""
        return {name: q for name, q in super().quantities().items() if name != "bending" or any(self.bending)}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        more = f", plus {text['level']} without load" if self.level else ""
        bent = f" The friction reaches its level {text['bending']} after a reversal (presliding)." if any(self.bending) else ""
        return f"Joint {self.joint} has load-dependent friction: {text['coefficient']} times the torque that it carries{more}.{bent}"
