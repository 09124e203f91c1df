"""The law of the strips as it was learned, and the arm's own linear loads beside it: coefficients that all joints share, a set a member."""

from dataclasses import dataclass, fields
from typing import final

import torch
from torch import Tensor

from nnhydro.features.body_columns import body_columns
from nnhydro.features.strip_law import law_torque
from nnhydro.features.strip_state import StripView, strip_states
from nnhydro.physics.flow import Flow


@final
@dataclass(frozen=True, eq=False)
class StripLaw:
    """tau = law of features/strip_law.py with the variables of the sets `names`, held within the range of training, plus body columns."""

    names: tuple[str, ...]
    lowest: Tensor  # (k,)
    highest: Tensor  # (k,)
    coefficients: Tensor  # (E, p): drag, inertia, what remembers, neurons
    body: Tensor  # (E, b), features/body_columns.py
    neurons: Tensor  # (k, states): the directions N of features/strip_neurons.py

    def torque(self, flow: Flow) -> Tensor:
        """Return the sensor torques (E, n, joints) N m."""
        view = StripView(flow)
        z, of_three = strip_states(view, self.names)
        held = torch.minimum(torch.maximum(z, self.lowest[:, None]), self.highest[:, None])
        whole = torch.einsum("njp,ep->enj", body_columns(flow), self.body)
        return whole + law_torque(view, held, of_three, self.coefficients, self.neurons) if self.names else whole

    def arrays(self) -> dict[str, Tensor]:
        """Return the tensors that a model file holds."""
        return {f.name: getattr(self, f.name) for f in fields(self)[1:]}
