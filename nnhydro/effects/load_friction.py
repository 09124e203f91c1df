"""Hypothesis: a joint rubs the harder the more torque it carries."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.joints import SIGN_WIDTH, smooth_sign


@effect
@final
@dataclass(frozen=True)
class LoadFriction(InstrumentEffect):
    """Friction in proportion to the torque carried by one joint."""

    id = "load_friction"
    family = "dry_friction"
    name = "load-dependent friction"
    mechanism = "Gear teeth and bearings are pressed together by the torque that they pass on, and rub in proportion to it."
    equation = "reading_j = tau_j + mu |tau_j| tanh(qd_j / v_0),  v_0 = 0.02 rad/s"
    source = "Coulomb's law with the transmitted torque as load; Rivera (1995), section 3.2, names losses that grow with load"
    signature = Signature(
        depends_on=("qd", "tau"), parity="odd", region="where the joint turns under load, nothing where it turns unloaded",
        excited_by="the same speed with and without load", mistaken_for=("coulomb_friction", "stribeck_friction", "torque_gain"),
    )
    acts = "joint"
    stage = 1
    dissipates = True

    coefficient: Values = parameter("1", 0.05, (0.0, 0.9), "friction torque per unit of torque carried", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return |tau_j| sgn(qd_j) at the joint as read, (n, joints, 1)."""
        at = slice(self.joint - 1, self.joint)
        load = seen.joint_torque(seen.tau)[:, at].abs() * smooth_sign(seen.motion.qd[:, at], SIGN_WIDTH)
        return seen.as_read(at_joint(load, self.joint, seen.arm.n_links))

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading with the friction."""
        return seen.tau + self.change(seen)

    def sentence(self, said: Mapping[str, str]) -> str:
        """Return the finding."""
        return f"Joint {self.joint} rubs with {said['coefficient']} times the torque that it carries: friction under load."
