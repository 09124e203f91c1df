"""Hypothesis: a joint rubs with a constant torque against its rotation."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.physics.flow import Flow
from nnhydro.physics.joints import DRY_WIDTH, smooth_sign


@effect
@final
@dataclass(frozen=True)
class CoulombFriction(LoadEffect):
    """Constant friction at one joint."""

    id = "coulomb_friction"
    family = "dry_friction"
    name = "Coulomb friction"
    mechanism = "Dry contact in a seal, bearing or gear: the joint drags with the same torque at any speed, against the way it turns."
    equation = "tau_j = T_C tanh(qd_j / v_0),  v_0 = 0.005 rad/s"
    source = "Rivera (1995), section 3.2, eq. 3-2-4: friction opposes rotation"
    signature = Signature(
        depends_on=("qd",), parity="odd", region="everywhere but at rest: a step where the joint reverses",
        excited_by="slow reversals of that joint", mistaken_for=("stribeck_friction", "load_friction", "viscous_friction", "backlash"),
    )
    acts = "joint"
    dissipates = True

    level: Values = parameter("N m", 0.1, (0.0, 1e3), "friction torque while the joint turns", per="arm")

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d level, (n, joints, 1)."""
        sign = smooth_sign(flow.motion.qd[:, self.joint - 1:self.joint], DRY_WIDTH)
        return at_joint(sign, self.joint, flow.arm.n_links)

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"Joint {self.joint} rubs with {said['level']} at any speed, against the way it turns: dry friction."
