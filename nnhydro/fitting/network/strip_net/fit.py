"""A strip net trained on the torques of recordings: which loads of the strips' motion and memory give what rigid links leave.

    minimise  sum over rows and joints of hypot((model - left)_j / s_j, SOFT),      s_j = mean |left_j|

every recording weighed by the root of what it has to explain. Some recordings at a time, all strips side by side. Matrices take orthogonal
steps (muon.py), all else AdamW's (gradient_fit.py), over one cycle of rates.
"""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
import torch
from torch import Tensor

from nnhydro.errors import ModelError, require
from nnhydro.fitting.network.gradient_fit import adamw_step, cycle
from nnhydro.fitting.network.strip_net.memory import Memory
from nnhydro.fitting.network.strip_net.muon import Muon
from nnhydro.fitting.network.strip_net.rows import StripRun, Together, torque_of
from nnhydro.models.learned.strip_inputs import PLAIN
from nnhydro.models.learned.strip_net import FASTEST, StripNet

SIZE, BATCH = 16, 8
RATE, MATRIX_RATE, DECAY = 3e-2, 0.1, 0.05  # at the cycle's top; the share of a weight that a step takes off is DECAY times its rate
EPOCHS, STEPS = 90, 800  # passes over the stretches; of many so few that steps are no more
NOISE = 0.03  # of the inputs' spread, added in training
SOFT = 0.03  # of the mean torque: below it misfits count by their squares
STATED = 1e-3  # of the loss, for a coefficient of the arm or of plain loads of 1
TINY = 1e-6


def loads(net: StripNet, rows: Together, noise: Tensor | None = None) -> Tensor:
    """Return the loads (m, strips) of the runs that lie `rows`, one run after the other."""
    z = rows.given if noise is None else replace(rows.given, x=rows.given.x + NOISE * noise * torch.randn_like(rows.given.x))
    e, both, r = net.encode(z)
    dsigma, ds = torch.split((z.speeds + z.speeds[rows.before]) / 2 * rows.way, 1, dim=-1)
    half, lasting = torch.cat([net.theta / 2 * dsigma, net.kappa / 2 * ds], dim=-1), torch.from_numpy(rows.lasting)
    begun = net.lasting(both.index_select(0, lasting), z.speeds[lasting])
    states: tuple[Tensor, Tensor] = Memory.apply(both, half, dsigma, *begun, rows)  # type: ignore[no-untyped-call]
    return net.load(z, e, r, *states).index_select(0, rows.place)


def _fresh(runs: Sequence[StripRun], generator: torch.Generator) -> StripNet:
    x, r = (torch.cat([getattr(run.given, name).flatten(0, 1) for run in runs]) for name in ("x", "r"))
    odd, k = x.shape[1], SIZE // 2

    def weights(rows: int, columns: int) -> Tensor:
        found: Tensor = (2 * torch.rand(rows, columns, generator=generator) - 1) / rows**0.5
        return found

    def draws(lowest: float, highest: float, count: int) -> Tensor:
        return lowest + (highest - lowest) * torch.rand(count, generator=generator)

    rate = torch.exp(draws(float(np.log(0.08)), float(np.log(4.0)), 2 * k)) / FASTEST
    scales = (x.square().mean(dim=0).sqrt() + 1e-3, r.mean(dim=0), r.std(dim=0) + 0.01, r.amin(dim=0), r.amax(dim=0),
              torch.tensor([max(run.drift for run in runs)]))
    inward = (weights(odd - 1, SIZE), weights(SIZE, 3 * k), weights(SIZE + 1, 2 * k), torch.logit(rate), draws(0.0, 1.3, k),
              draws(0.0, 3.0, k))
    outward = (weights(SIZE + 3 * k + 1, SIZE), weights(k + 1, SIZE), draws(-0.33, 0.33, SIZE), torch.zeros(SIZE, 1),
               torch.zeros(r.shape[1] - 1, SIZE), weights(odd, 1))
    return StripNet(*scales, *inward, *outward, torch.zeros(PLAIN), torch.zeros(runs[0].columns.shape[2]))


def _weights(runs: Sequence[StripRun], s: Tensor) -> list[Tensor]:
    """How much each row (t, 1) of a recording counts: together as the root of what the recording leaves to explain."""
    return [run.keep[:, None] / ((run.left[run.keep] / s).abs().sum() + TINY).sqrt() for run in runs]


def _loss(net: StripNet, runs: Sequence[StripRun], weights: Sequence[Tensor], s: Tensor, noise: Tensor | None) -> Tensor:
    levers, columns, left = (torch.cat([getattr(run, name) for run in runs]) for name in ("levers", "columns", "left"))
    tau = torque_of(loads(net, Together.of(runs), noise), net.body, levers, columns)
    seen = [run.sensor_torque(part) for run, part in zip(runs, torch.split(tau, [len(run.keep) for run in runs]), strict=True)]
    misfit = (torch.hypot((torch.cat(seen) - left) / s, torch.tensor(SOFT)) * torch.cat(list(weights))).sum()
    whole = torch.stack([1 / w.amax() ** 2 for w in weights]).sum()
    return misfit / whole.sqrt() + STATED * (net.body.square().sum() + net.plain.square().sum())


FIXED = ("spread", "middle", "wide", "lowest", "highest", "drift")
STATED_PARTS = ("plain", "body")
MATRICES = ("inner", "drive", "gate", "odd", "even")


def _flat_vector(net: StripNet, names: Sequence[str]) -> Tensor:
    """The tensors `names` as one vector to be learned."""
    return torch.cat([getattr(net, name).flatten() for name in names]).requires_grad_(True)


def _parts(net: StripNet, names: Sequence[str], flat: Tensor) -> dict[str, Tensor]:
    """The tensors `names` of a net, from one vector."""
    like = [getattr(net, name) for name in names]
    return {name: x.view(old.shape) for name, x, old in zip(names, torch.split(flat, [x.numel() for x in like]), like, strict=True)}


class _Learning:
    """What is learned of a net, and how: matrices along orthogonal steps, all else by AdamW, over one cycle of rates."""

    def __init__(self, net: StripNet) -> None:
        self._net, self._count = net, 0
        self._names = tuple(field.name for field in fields(net) if field.name not in FIXED + STATED_PARTS + MATRICES)
        self._flat = [_flat_vector(net, self._names), _flat_vector(net, STATED_PARTS)]
        self._first, self._second = ([torch.zeros_like(w) for w in self._flat] for _ in range(2))
        self._matrices = [getattr(net, name).clone().requires_grad_(True) for name in MATRICES]
        self._muon = Muon(self._matrices)

    @property
    def net(self) -> StripNet:
        """The net as it is so far."""
        learned = _parts(self._net, self._names, self._flat[0]) | _parts(self._net, STATED_PARTS, self._flat[1])
        return replace(self._net, **learned, **dict(zip(MATRICES, self._matrices, strict=True)))

    def step(self, loss: Tensor, progress: float) -> None:
        """Go a step down the loss of `net`, at `progress` 0..1 of the training."""
        self._count += 1
        gradients, top = torch.autograd.grad(loss, [*self._flat, *self._matrices]), cycle(progress)
        for part, rate, decay in ((slice(1), RATE, DECAY), (slice(1, 2), 3 * RATE, 0.0)):
            adamw_step(self._flat[part], gradients[:2][part], self._first[part], self._second[part], self._count, top * rate, decay)
        self._muon.step(self._matrices, gradients[2:], top * MATRIX_RATE, DECAY)


def fit_strip_net(runs: Sequence[StripRun], seed: int, epochs: int = EPOCHS) -> StripNet:
    """Return a net trained on `runs`; raises ModelError where its loss becomes infinite or no number."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        generator, rng = torch.Generator().manual_seed(seed), np.random.default_rng(seed)
        net, batches = _fresh(runs, generator), -(-len(runs) // BATCH)
        s = torch.cat([run.left[run.keep] for run in runs]).abs().mean(dim=0) + TINY
        epochs, weights = min(epochs, -(-STEPS // batches)), _weights(runs, s)
        learning = _Learning(net)
        parts = [part for _ in range(epochs) for part in np.array_split(rng.permutation(len(runs)), batches)]
        for number, part in enumerate(parts):
            loss = _loss(learning.net, [runs[i] for i in part], [weights[i] for i in part], s, net.spread)
            require(bool(torch.isfinite(loss)), f"the trained memory's loss is {loss.item()} after {number} steps: recordings may hold "
                    "extreme values (nnhydro check); or train without it (strip_net = false in --config)", ModelError)
            learning.step(loss, number / len(parts))
    return StripNet(*(getattr(learning.net, field.name).detach().double() for field in fields(net)))
