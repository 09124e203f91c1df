"""The linear parts of a hybrid as they were learned: the law of the strips with the arm's own loads, and the free part.

The law's coefficients are shared by all joints, one set per member; the free part is what the mirror image of the rig need not repeat.
"""

from dataclasses import dataclass, fields
from typing import final

import torch
from torch import Tensor

from nnhydro.features.body_columns import body_columns
from nnhydro.features.free_part import FreeRange, free_functions
from nnhydro.features.strip_law.law import law_torque
from nnhydro.features.strip_law.state import StripView, strip_states
from nnhydro.physics.flow import Flow


@final
@dataclass(frozen=True, eq=False)
class StripLaw:
    """tau = law of features/strip_law/law.py with the variables of the sets `names`, within the range of training, plus body columns."""

    names: tuple[str, ...]
    lowest: Tensor  # (k,)
    highest: Tensor  # (k,)
    coefficients: Tensor  # (E, p): drag, inertia, what remembers, neurons
    body: Tensor  # (E, b), features/body_columns.py
    neurons: Tensor  # (k, states): the directions N of features/strip_law/neurons.py

    def torque(self, flow: Flow) -> Tensor:
        """Return the sensor torques (E, n, joints) N m."""
        view = StripView(flow)
        z, of_three = strip_states(view, self.names)
        clamped = torch.minimum(torch.maximum(z, self.lowest[:, None]), self.highest[:, None])
        whole = torch.einsum("njp,ep->enj", body_columns(flow), self.body)
        return whole + law_torque(view, clamped, of_three, self.coefficients, self.neurons) if self.names else whole

    def arrays(self) -> dict[str, Tensor]:
        """Return the tensors that a model file holds."""
        return {field.name: getattr(self, field.name) for field in fields(self)[1:]}


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
