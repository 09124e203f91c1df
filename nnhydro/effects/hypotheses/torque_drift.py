"""Hypothesis: the offset of a torque sensor moves over the campaign."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_VALUE, InstrumentEffect, Signature, Values, at_joint, effect, parameter
from nnhydro.effects.hypotheses.torque_bias import TorqueBias
from nnhydro.effects.quantity import Quantity
from nnhydro.effects.sensor_view import SensorView


@effect
@final
@dataclass(frozen=True)
class TorqueDrift(InstrumentEffect):
    """A slow curve over the time in the campaign, without its mean, added to one torque channel."""

    id = "torque_drift"
    family = "torque_sensor"
    name = "torque sensor drift"
    mechanism = "The sensor warms up, creeps or takes in water: its zero moves from recording to recording."
    equation = "reading_j = tau_j + c_1 P_1(p) + c_2 P_2(p) + c_3 P_3(p),  p the time in the campaign, -1 to 1, P_k Legendre's polynomials"
    source = ("drift of strain gauges with temperature: Model Based In Situ Calibration with Temperature compensation of 6 axis Force "
              "Torque Sensors (2018), arXiv 1812.00650, abstract at https://www.scholarfeed.org/paper/1812.00650v1; the polynomials "
              "are ours")
    signature = Signature(
        depends_on=("clock",), parity="even", region="the whole of each recording alike, other in early than in late ones",
        excited_by="recordings spread over the day, one motion repeated at its start and end",
        mistaken_for=("torque_bias", "umbilical_stiffness"), zero_at_rest=False,
    )
    acts = "joint"
    stage = 4
    random_intercept = True

    trend: Values = parameter("N m", 0.0, ANY_VALUE, "half of the change from first to last row", per="arm")
    bend: Values = parameter("N m", 0.0, ANY_VALUE, "curvature over the campaign", per="arm")
    turn: Values = parameter("N m", 0.0, ANY_VALUE, "third-order part over the campaign", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return P_1, P_2, P_3 at the joint, (n, joints, 3); 0 where the place in the campaign is not known."""
        p = torch.full_like(seen.motion.t, torch.nan) if seen.place is None else seen.place.clamp(-1, 1)
        curve = torch.stack([p, (3 * p**2 - 1) / 2, (5 * p**3 - 3 * p) / 2], dim=1)
        return at_joint(torch.nan_to_num(curve), self.joint, seen.arm.n_links)

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading with the drift."""
        return seen.tau + self.change(seen)

    def for_prediction(self, offset: float) -> InstrumentEffect:
        """Return the zero at the end of the campaign as a bias: its further course is unknown."""
        return TorqueBias(joint=self.joint, offset=(float(self.linear_values().sum()) + offset,))

    def quantities(self) -> dict[str, Quantity]:
        """Return the change from the first to the last row of the campaign, and the largest swing in between."""
        p = torch.linspace(-1, 1, 201, dtype=torch.float64)
        c1, c2, c3 = self.linear_values()
        curve = c1 * p + c2 * (3 * p**2 - 1) / 2 + c3 * (5 * p**3 - 3 * p) / 2
        return {"change": Quantity(float(curve[-1] - curve[0]), "N m"), "swing": Quantity(float(curve.max() - curve.min()), "N m")}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"The torque sensor of joint {self.joint} drifts: its zero moves by {text['change']} from the first to the last recording "
                f"(largest difference in between: {text['swing']}).")
