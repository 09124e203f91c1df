"""Hypothesis: the water is not at rest but flows steadily past."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity, polar
from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.flow import Flow


@effect
@final
@dataclass(frozen=True)
class AmbientCurrent(InstrumentEffect):
    """A steady, uniform current of unknown size and direction."""

    id = "ambient_current"
    family = "water"
    name = "steady current"
    mechanism = "The water in the tank circulates, or the arm works in a stream: the speed through the water is not the speed of the arm."
    equation = "reading = tau(motion relative to water that moves with c)"
    source = "relative velocity in Morison's drag: Rivera (1995), eq. 2-3"
    signature = Signature(
        depends_on=("q", "w"), parity="mixed", region="fast motion in one direction of the tank more than in the other",
        excited_by="the same motion both ways and around several directions",
        mistaken_for=("buoyancy_tilt", "wall_proximity", "torque_bias"),
        zero_at_rest=False,
    )
    acts = "arm"
    stage = 0
    needs_water = True
    varies = True

    current_X: Values = parameter("m/s", 0.0, (-5.0, 5.0), "velocity of the water along X", per="arm")
    current_Y: Values = parameter("m/s", 0.0, (-5.0, 5.0), "velocity of the water along Y", per="arm")

    def columns(self, seen: SensorView) -> Tensor:
        """Return d tau / d current, (n, joints, 2)."""
        return seen.by_water[0].sum(dim=2)

    def met_by(self, flow: Flow) -> Flow:
        """Return `flow` in water that moves with the current."""
        velocity = torch.tensor([self.current_X[0], self.current_Y[0]], dtype=torch.float64).expand(len(flow.motion), 2)
        return flow.in_water(velocity, torch.zeros_like(velocity))

    def moved_flow(self, seen: SensorView) -> tuple[Flow, float]:
        """Return the flow in water that moves."""
        return self.met_by(seen.flow), 0.0

    def quantities(self) -> dict[str, Quantity]:
        """Return speed and direction."""
        return polar(self.current_X[0], self.current_Y[0], "m/s", "speed")

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding; of a component that no recording shows, the value is exactly 0."""
        x, y = self.current_X[0], self.current_Y[0]
        if (x == 0) != (y == 0):
            along = f"{'-' if x + y < 0 else '+'}{'Y' if x == 0 else 'X'}"
            return f"A steady current of {text['speed']} flows along {along}. These recordings do not show what flows across."
        return f"A steady current of {text['speed']} flows in the direction {text['direction']} from +X."
