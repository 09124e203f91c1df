"""Any simulation with physics added to it: what a diagnosis makes of a baseline that is not one of ours.

    tau = simulation + after - before          `before`, `after`: the same physics without and with what was found
"""

from dataclasses import dataclass
from typing import Any, ClassVar, final

from torch import Tensor

from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion


@final
@dataclass(frozen=True, eq=False)
class CorrectedSimulation(TorqueModel):
    """`simulation` with what was found added; None stands for a simulation outside: torques are then what must be added to its own."""

    kind: ClassVar[str] = "amended"
    simulation: TorqueModel | None
    before: StripTheory
    after: StripTheory

    def torque(self, motion: Motion) -> Tensor:
        """Return the sensor torques (n, joints) N m; without a simulation of ours, the change of them."""
        change = self.after.torque(motion) - self.before.torque(motion)
        return change if self.simulation is None else change + self.simulation.torque(motion)

    def document(self) -> dict[str, Any]:
        """Return the parts, and whether the torques have to be added to a simulation outside."""
        inner = self.simulation
        return {"simulation": None if inner is None else {"kind": inner.kind, "arm": inner.arm.document(), "model": inner.document()},
                "to_be_added": inner is None, "before": self.before.document(), "after": self.after.document()}

    def arrays(self) -> dict[str, Tensor]:
        """Return the simulation's tensors."""
        return {} if self.simulation is None else self.simulation.arrays()
