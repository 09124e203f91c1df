"""The truth of a recipe as a model: `truth: FOLDER`, with any model that can be stepped, such as a learned twin of a recorded tank.

Under a controller a learned truth runs as machine code (native_loop.py): its acceleration is a search, not a solution of equations.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.deployment.native import NativeArm
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.errors import require
from nnhydro.models.storage import load_model
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LoadTerm
from nnhydro.simulation.motions.motion_kind import Reference
from nnhydro.simulation.native_loop import track
from nnhydro.simulation.run import Run
from nnhydro.simulation.torque_law import TorqueLaw


@final
@dataclass(frozen=True)
class ModelTruth(LoadTerm):
    """A whole model, rigid body included, as the only term of a sum; faults of sensors and drives are no part of it."""

    kind: ClassVar[str] = ""
    dynamics: Dynamics

    def torque(self, flow: Flow) -> Tensor:
        """Return the joint torques (n, joints) N m."""
        with torch.no_grad():
            return self.dynamics.model.torque(flow.motion)

    def track_all(self, references: Mapping[str, Reference], law: TorqueLaw, rate_hz: float, hold: int) -> Iterator[Run]:
        """Yield one run a reference under `law`, which acts every `hold` steps of 1/`rate_hz` s.

        Raises ConfigError where the arm runs away, ModelError without a C compiler or where the model has no acceleration for a torque.
        """
        arm = NativeArm(self.dynamics.model, self.dynamics.affine)
        for name, reference in references.items():
            yield track(name, reference, arm, law, rate_hz, hold)


def model_truth(folder: Path, where: str) -> ModelTruth:
    """Return the model in `folder`; raises ConfigError naming `where` without one, ModelError where it cannot be stepped."""
    require(folder.is_dir(), f"{where}: truth: {folder} is not the folder of a model")
    return ModelTruth(Dynamics(load_model(folder)))
