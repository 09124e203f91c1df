"""What every model is: motion in, sensor torque out."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from torch import Tensor

from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation


@dataclass(frozen=True, eq=False)
class TorqueModel(ABC):
    """A model of what the arm's torque sensors read. Subclasses are final; `kind` is their name in model files.

    `preparation` is the filter with which the model was made; predictions choose the one that suits the motion.
    `fit` says how the model came about.
    """

    kind: ClassVar[str] = ""
    arm: Arm
    preparation: Preparation
    fit: dict[str, Any]

    @abstractmethod
    def torque(self, motion: Motion) -> Tensor:
        """Return the sensor torques (n, joints) N m for one run in time order."""

    def std(self, motion: Motion) -> Tensor | None:
        """Return the model's own standard deviation (n, joints) N m, None where it knows none."""
        return None

    def torque_and_std(self, motion: Motion) -> tuple[Tensor, Tensor | None]:
        """Return both; of a model that finds them together, at the price of one."""
        return self.torque(motion), self.std(motion)

    @abstractmethod
    def document(self) -> dict[str, Any]:
        """Return what model.json holds beyond arm, preparation and fit: plain numbers, lists and strings."""

    def arrays(self) -> dict[str, Tensor]:
        """Return the tensors that weights.safetensors holds; empty where there are none."""
        return {}
