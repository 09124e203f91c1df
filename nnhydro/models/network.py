"""A physics-feature MLP: an ensemble of small tanh networks on dimensionless inputs, scaled back by the Morison scale.

    tau_j = base_j + S_j b tanh( y_j / b ),   y = [g(x) - g(P x)] / 2,   g(x) = W_0 x + W_n tanh( ... tanh(W_1 x + c_1) ... )

    x     features, standardised on the training recordings and held within the range seen there
    P     parity: -1 for features that change sign in the mirror image of the rig, so that torques change sign with the mirror exactly
    S     Morison scale (features/scaling)                                                             [N m]
    base  0 for the network, a calibrated physics model for the hybrid                                 [N m]
    b     bound of the scaled output: a hybrid can only leave its baseline so far

All members of the ensemble are evaluated in one batched product; their mean is the prediction, their scatter its uncertainty.
Source: Rivera (1995), section 2.4 (tanh layer with offsets, linear output); features, scale, bound and ensemble are ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import torch
from torch import Tensor


@final
@dataclass(frozen=True, eq=False)
class Ensemble:
    """Weights of E networks: for each layer (E, inputs, outputs) and offsets (E, 1, outputs); `skip` (E, inputs, outputs)."""

    weights: tuple[Tensor, ...]
    offsets: tuple[Tensor, ...]
    skip: Tensor

    @staticmethod
    def fresh(sizes: Sequence[int], members: int, seed: int) -> "Ensemble":
        """Return new weights for layers of `sizes` (inputs, hidden ..., outputs): Xavier, last layer and skip zero."""
        generator = torch.Generator().manual_seed(seed)
        weights, offsets = [], []
        for k, (a, b) in enumerate(pairwise(sizes)):
            bound = 0.0 if k == len(sizes) - 2 else (6 / (a + b)) ** 0.5
            weights.append((2 * torch.rand(members, a, b, generator=generator) - 1) * bound)
            offsets.append(torch.zeros(members, 1, b))
        return Ensemble(tuple(weights), tuple(offsets), torch.zeros(members, sizes[0], sizes[-1]))

    def tensors(self) -> list[Tensor]:
        """Return all tensors in a fixed order."""
        return [*self.weights, *self.offsets, self.skip]

    def replaced(self, tensors: Sequence[Tensor]) -> "Ensemble":
        """Return an ensemble of the same layout with other tensors, in the order of `tensors()`."""
        layers = len(self.weights)
        return Ensemble(tuple(tensors[:layers]), tuple(tensors[layers:2 * layers]), tensors[-1])

    def __call__(self, x: Tensor) -> Tensor:
        """Return g (E, n, outputs) for the inputs x (n, inputs)."""
        h = x.expand(len(self.skip), *x.shape)
        y = torch.bmm(h, self.skip)
        for weight, offset in zip(self.weights[:-1], self.offsets[:-1], strict=True):
            h = torch.tanh(torch.baddbmm(offset, h, weight))
        return y + torch.baddbmm(self.offsets[-1], h, self.weights[-1])


def bounded(y: Tensor, bound: float) -> Tensor:
    """Return b tanh(y/b)."""
    return bound * torch.tanh(y / bound)


def mirrored(ensemble: Ensemble, x: Tensor, parity: Tensor) -> Tensor:
    """Return y (E, n, outputs), exactly odd under the mirror that multiplies the inputs x (n, inputs) by `parity` (inputs,)."""
    both = ensemble(torch.cat([x, x * parity]))
    return 0.5 * (both[:, :len(x)] - both[:, len(x):])
