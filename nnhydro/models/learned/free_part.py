"""The free part as it was learned: torques that the mirror image of the rig need not repeat."""

from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.features.free_part import FreeRange, free_functions
from nnhydro.physics.flow import Flow


@final
@dataclass(frozen=True, eq=False)
class FreePart:
    """tau_j = f(q, qd) c_j with the functions f of features/free_part.py."""

    seen: FreeRange
    coefficients: Tensor  # (E, functions, joints) N m

    def torque(self, flow: Flow) -> Tensor:
        """Return the sensor torques (E, n, joints) N m."""
        return torch.einsum("nf,efj->enj", free_functions(flow, self.seen), self.coefficients)

    def arrays(self) -> dict[str, Tensor]:
        """Return the tensors that a model file holds."""
        return {"coefficients": self.coefficients, **self.seen.tensors()}

    @staticmethod
    def of_arrays(tensors: dict[str, Tensor]) -> "FreePart":
        """Return the part whose tensors `arrays` gave."""
        return FreePart(FreeRange(tensors["lowest"], tensors["highest"], tensors["fastest"]), tensors["coefficients"])
