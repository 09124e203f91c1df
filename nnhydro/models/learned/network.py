"""A physics-feature MLP: an ensemble of small tanh networks on dimensionless inputs, scaled back by the Morison scale.

    tau_j = base_j + S_j bounded( l_j + y_j ),   y = [g(x) - g(P x)] / 2,   g(x) = W_n tanh( ... tanh(W_1 x + c_1) ... ) + c_n

    x     features, standardised on the training recordings and held within the range seen there
    P     parity: -1 for features that change sign in the mirror image of the rig, so that torques change sign with the mirror exactly
    l     the linear part, odd as well: a law of the strips and the odd features (models/learned/learned.py)
    S     Morison scale (features/scaling)                                                             [N m]
    base  0 for the network, a calibrated physics model for the hybrid                                 [N m]

Common layers: one stack of hidden layers a member feeds all torques. Parallel layers: every torque has a stack of its own.
All members of the ensemble are evaluated in one batched product; their mean is the prediction, their scatter its uncertainty.
Source: Rivera (1995), section 2.4 (tanh layer with offsets, linear output), figures 4-4 (common) and 4-5 (parallel); the rest is ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, final

import torch
from torch import Tensor


@final
@dataclass(frozen=True, eq=False)
class Ensemble:
    """Weights of E networks with `outputs` outputs: for each layer (G, inputs, outputs) and offsets (G, 1, outputs).

    G is E where the outputs share their layers, E times `outputs` where each has a stack of its own (member by member).
    """

    weights: tuple[Tensor, ...]
    offsets: tuple[Tensor, ...]
    outputs: int

    @staticmethod
    def fresh(sizes: Sequence[int], members: int, seed: int, parallel: bool = False) -> "Ensemble":
        """Return new weights for layers of `sizes` (inputs, hidden ..., outputs): Xavier, the last layer zero."""
        generator = torch.Generator().manual_seed(seed)
        *inner, outputs = sizes
        stacks, widths = (members * outputs, (*inner, 1)) if parallel else (members, (*inner, outputs))
        weights, offsets = [], []
        for k, (a, b) in enumerate(pairwise(widths)):
            bound = 0.0 if k == len(widths) - 2 else (6 / (a + b)) ** 0.5
            weights.append((2 * torch.rand(stacks, a, b, generator=generator) - 1) * bound)
            offsets.append(torch.zeros(stacks, 1, b))
        return Ensemble(tuple(weights), tuple(offsets), outputs)

    @property
    def members(self) -> int:
        """E."""
        return len(self.weights[0]) * self.weights[-1].shape[2] // self.outputs

    @property
    def hidden(self) -> tuple[int, ...]:
        """Neurons of each hidden layer."""
        return tuple(weight.shape[2] for weight in self.weights[:-1])

    def tensors(self) -> list[Tensor]:
        """Return all tensors in a fixed order."""
        return [*self.weights, *self.offsets]

    def with_tensors(self, tensors: Sequence[Tensor]) -> "Ensemble":
        """Return an ensemble of the same layout with other tensors, in the order of `tensors()`."""
        layers = len(self.weights)
        return Ensemble(tuple(tensors[:layers]), tuple(tensors[layers:]), self.outputs)

    def times(self, factor: Tensor) -> "Ensemble":
        """Return the ensemble with its outputs multiplied by `factor` (E, 1, outputs)."""
        each = factor.reshape(len(self.weights[-1]), 1, -1)
        return Ensemble((*self.weights[:-1], self.weights[-1] * each), (*self.offsets[:-1], self.offsets[-1] * each), self.outputs)

    def __call__(self, x: Tensor) -> Tensor:
        """Return g (E, n, outputs) for the inputs x (n, inputs), or (E, n, inputs) where every member has its own."""
        stacks = len(self.weights[0])
        h = x.expand(stacks, *x.shape) if x.dim() == 2 else x.repeat_interleave(stacks // len(x), dim=0)
        for weight, offset in zip(self.weights[:-1], self.offsets[:-1], strict=True):
            h = tanh(torch.baddbmm(offset, h, weight))
        y = torch.baddbmm(self.offsets[-1], h, self.weights[-1])
        return y if y.shape[2] == self.outputs else y.reshape(-1, self.outputs, x.shape[-2]).transpose(1, 2)


class _SinglePrecisionTanh(torch.autograd.Function):
    """tanh x = 2 / (1 + exp(-2 x)) - 1, exact to 1e-7: quicker than torch's own, and good enough to train by."""

    @staticmethod
    def forward(ctx: Any, x: Tensor) -> Tensor:
        y = torch.sigmoid(2 * x).mul_(2).sub_(1)
        ctx.save_for_backward(y)
        return y

    @staticmethod
    def backward(ctx: Any, slope: Tensor) -> Tensor:
        (y,) = ctx.saved_tensors
        inner: Tensor = torch.ops.aten.tanh_backward(slope, y)
        return inner


def tanh(x: Tensor) -> Tensor:
    """Return tanh x, in single precision (training) the quick one."""
    return _SinglePrecisionTanh.apply(x) if x.dtype == torch.float32 else torch.tanh(x)  # type: ignore[no-untyped-call]


def soft_bound(y: Tensor, bound: float) -> Tensor:
    """Return y up to half the `bound` in size, beyond it a smooth way to the bound: h tanh((y - h)/h) + h, h half the bound."""
    h = bound / 2
    within = y.clamp(-h, h)
    return within + h * torch.tanh((y - within) / h)


def odd_output(ensemble: Ensemble, x: Tensor, parity: Tensor) -> Tensor:
    """Return y (E, n, outputs), exactly odd under the mirror that multiplies the inputs x ([E,] n, inputs) by `parity`.

    The first layer takes odd and even inputs apart, since the mirror turns the sign of what the odd ones give; the last one takes the
    difference of both sides, of which its offsets are no part.
    """
    first, n = ensemble.weights[0], x.shape[-2]
    x = x.expand(len(first), -1, -1) if x.dim() == 2 else x if len(first) == len(x) else x.repeat_interleave(len(first) // len(x), dim=0)
    signs, order = parity.sort(stable=True)
    if not torch.equal(signs, parity):
        x, first = x.index_select(2, order), first.index_select(1, order)
    sizes = [int((parity < 0).sum()), int((parity >= 0).sum())]
    (odd, even), (of_odd, of_even) = torch.split(x, sizes, dim=2), torch.split(first, sizes, dim=1)
    turned, straight = torch.bmm(odd, of_odd), torch.baddbmm(ensemble.offsets[0], even, of_even)
    h = tanh(torch.cat([straight + turned, straight - turned], dim=1))
    for weight, offset in zip(ensemble.weights[1:-1], ensemble.offsets[1:-1], strict=True):
        h = tanh(torch.baddbmm(offset, h, weight))
    here, mirrored = h.chunk(2, dim=1)
    y = torch.bmm(here - mirrored, 0.5 * ensemble.weights[-1])
    return y if y.shape[2] == ensemble.outputs else y.reshape(-1, ensemble.outputs, n).transpose(1, 2)
