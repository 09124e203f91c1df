"""The analytic model: a named sum of load terms seen through the arm's belt, gears and sensors, whose own faults may be part of it."""

from dataclasses import dataclass
from typing import Any, ClassVar, final

from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, with_effects
from nnhydro.effects.sensor_view import SensorView
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion
from nnhydro.physics.transmission import sensor_torque, to_drives


@final
@dataclass(frozen=True, eq=False)
class StripTheory(TorqueModel):
    """Sensor torque of the sum `loads`; `name` is the baseline's name (contract: rigid, textbook, drag-only, constant, state)."""

    kind: ClassVar[str] = "strip_theory"
    name: str
    loads: Loads
    instruments: tuple[InstrumentEffect, ...] = ()  # confirmed faults of sensors and drives, in any order

    def torque(self, motion: Motion) -> Tensor:
        """Return the sensor torques (n, joints) N m."""
        if not self.instruments:
            return sensor_torque(self.loads.torque(Flow(self.arm, motion)), motion.qd, self.arm)
        return with_effects(SensorView.of(self.loads, Flow(self.arm, motion)), self.instruments).tau

    def by_term(self, motion: Motion) -> dict[str, Tensor]:
        """Return each term's share of the torque at the drives, before the gears, (n, joints) N m."""
        return {name: to_drives(tau, self.arm) for name, tau in self.loads.by_term(Flow(self.arm, motion)).items()}

    def document(self) -> dict[str, Any]:
        """Return name, terms and instruments."""
        return {"name": self.name, "terms": self.loads.document(),
                "instruments": [instrument.document() for instrument in self.instruments]}
