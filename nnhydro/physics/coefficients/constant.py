"""A constant factor on both coefficients: the simplest law, and the way to carry a published correction into a model.

    g = factor

Source: ours.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.coefficients.law import Law, StripState


@final
@dataclass(frozen=True)
class Constant(Law):
    """The same factor on C_D and C_M."""

    kind: ClassVar[str] = "constant"
    factor: float = 1.0

    def drag(self, state: StripState) -> Tensor:
        """Return `factor`."""
        return torch.full((1, 1, 1), self.factor, dtype=torch.float64)

    def added_mass(self, state: StripState) -> Tensor:
        """Return `factor`."""
        return self.drag(state)
