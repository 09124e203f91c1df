"""A strip net trained on the torques of recordings: which loads of the strips' motion and memory give what rigid links leave.

    minimise  sum over rows and joints of hypot((model - left)_j / s_j, SOFT),      s_j = mean |left_j|

every recording weighed by the root of what it has to explain. Some recordings at a time, all strips side by side. Matrices take orthogonal
steps (muon.py), all else Adam's with decoupled weight decay, over one cycle of rates. Source: Loshchilov & Hutter (2019); one cycle:
Smith & Topin (2019), arXiv 1708.07120.
"""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from nnhydro.fitting.network.strip_net.muon import Muon
from nnhydro.fitting.network.strip_net.rows import StripRun, join_runs
from nnhydro.models.learned.strip_inputs import PLAIN
from nnhydro.models.learned.strip_net import FASTEST, StripNet, real_and_imaginary, recurrence

SIZE, BATCH = 16, 8
RATE, MATRIX_RATE, DECAY = 3e-2, 0.1, 0.05  # at the cycle's top; the share of a weight that a step takes off is DECAY times its rate
EPOCHS, STEPS = 90, 500  # passes over the stretches; of many so few that steps are no more
NOISE = 0.03  # of the inputs' spread, added in training
SOFT = 0.03  # of the mean torque: below it misfits count by their squares
STATED = 1e-3  # of the loss, for a coefficient of the arm or of plain loads of 1
TINY = 1e-6


class _Scan(torch.autograd.Function):
    """`recurrence` with its gradient; written as one step, as a tape of small steps takes most of the time."""

    @staticmethod
    def forward(ctx: Any, keep_re: Tensor, keep_im: Tensor, re: Tensor, im: Tensor) -> tuple[Tensor, Tensor]:
        """Return h_t = keep_t h_{t-1} + z_t, all (n, s, k), as real and imaginary part."""
        ctx.a, ctx.h = recurrence(keep_re, keep_im, re, im)
        return real_and_imaginary(ctx.h)

    @staticmethod
    def backward(ctx: Any, re: Tensor, im: Tensor) -> tuple[Tensor, ...]:
        """Return the gradients over keep and z, (n, s, k), by the scan g_t + conj(keep_{t+1}) g_{t+1} backward in time."""
        a, g = ctx.a.conj(), torch.complex(re, im).numpy()
        for now, keep, after in zip(g[-2::-1], a[:0:-1], g[::-1], strict=False):
            now += keep * after
        along = np.zeros_like(g)
        np.multiply(g[1:], ctx.h[:-1].conj(), out=along[1:])
        return tuple(torch.from_numpy(x.copy()) for x in (along.real, along.imag, g.real, g.imag))


def loads(net: StripNet, runs: Sequence[StripRun], noise: Tensor | None = None) -> list[Tensor]:
    """Return the loads (t, strips) of every run."""
    z, way, moves, steady = join_runs(runs)
    z = z if noise is None else replace(z, x=z.x + NOISE * noise * torch.randn_like(z.x))
    e, both, r = net.encode(z)
    middle, speeds = ((x + x.roll(1, 0)) / 2 for x in (both, z.speeds))  # no step leads to the first row: way is 0
    keep, turned, re, im = net.increments(middle, speeds * way)
    if bool(moves.any()):
        begin = (torch.where(moves, x, 0.0) for x in net.lasting(both[:1], z.speeds[:1]))
        re, im = (torch.cat([first, x[1:]]) for first, x in zip(begin, (re, im), strict=True))
    if bool(steady.any()):
        keep, turned = (torch.where(steady, 0.0, x) for x in (keep, turned))
        re, im = (torch.where(steady, a, b) for a, b in zip(net.lasting(both, z.speeds), (re, im), strict=True))
    states: tuple[Tensor, Tensor] = _Scan.apply(keep, turned, re, im)  # type: ignore[no-untyped-call]
    load = net.load(z, e, r, *states)
    parts = torch.split(load, [run.given.x.shape[1] for run in runs], dim=1)
    return [part[:len(run.keep)] for part, run in zip(parts, runs, strict=True)]


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
    outward = weights(SIZE + 3 * k + 1, SIZE), weights(k + 1, SIZE), draws(-0.33, 0.33, SIZE), torch.zeros(SIZE, 1), weights(odd, 1)
    return StripNet(*scales, *inward, *outward, torch.zeros(PLAIN), torch.zeros(runs[0].columns.shape[2]))


def _size(run: StripRun, s: Tensor) -> Tensor:
    """What the recording leaves to explain."""
    return (run.left[run.keep] / s).abs().sum() + TINY


def _loss(net: StripNet, runs: Sequence[StripRun], s: Tensor, noise: Tensor | None) -> Tensor:
    misfit, sizes = torch.zeros(()), torch.stack([_size(run, s) for run in runs])
    for run, load, size in zip(runs, loads(net, runs, noise), sizes, strict=True):
        off = ((run.torque(load, net.body) - run.left) / s)[run.keep]
        misfit = misfit + torch.hypot(off, torch.tensor(SOFT)).sum() / size.sqrt()
    return misfit / sizes.sum().sqrt() + STATED * (net.body.square().sum() + net.plain.square().sum())


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
    """What is learned of a net, and how: matrices along orthogonal steps, all else by Adam, over one cycle of rates."""

    def __init__(self, net: StripNet, steps: int) -> None:
        self._net = net
        self._names = tuple(field.name for field in fields(net) if field.name not in FIXED + STATED_PARTS + MATRICES)
        self._flat = [_flat_vector(net, self._names), _flat_vector(net, STATED_PARTS)]
        self._matrices = [getattr(net, name).clone().requires_grad_(True) for name in MATRICES]
        self._muon = Muon(self._matrices)
        groups: list[dict[str, Any]] = [{"params": self._flat[:1], "weight_decay": DECAY}, {"params": self._flat[1:], "weight_decay": 0.0}]
        self._adam = torch.optim.AdamW(groups, RATE, fused=True)
        self._rates = torch.optim.lr_scheduler.OneCycleLR(self._adam, [RATE, 3 * RATE], total_steps=steps, pct_start=0.1)

    @property
    def net(self) -> StripNet:
        """The net as it is so far."""
        learned = _parts(self._net, self._names, self._flat[0]) | _parts(self._net, STATED_PARTS, self._flat[1])
        return replace(self._net, **learned, **dict(zip(MATRICES, self._matrices, strict=True)))

    def step(self, loss: Tensor) -> None:
        """Go a step down the loss of `net`."""
        self._adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_([self._flat[0], *self._matrices], 1.0)
        self._adam.step()
        cycle = self._rates.get_last_lr()[0] / RATE
        self._muon.step(self._matrices, float(cycle) * MATRIX_RATE, DECAY)
        self._rates.step()


def fit_strip_net(runs: Sequence[StripRun], seed: int, epochs: int = EPOCHS) -> StripNet:
    """Return a net trained on `runs`."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        generator, rng = torch.Generator().manual_seed(seed), np.random.default_rng(seed)
        net, batches = _fresh(runs, generator), -(-len(runs) // BATCH)
        s = torch.cat([run.left[run.keep] for run in runs]).abs().mean(dim=0) + TINY
        epochs = min(epochs, -(-STEPS // batches))
        learning = _Learning(net, epochs * batches)
        for _ in range(epochs):
            for part in np.array_split(rng.permutation(len(runs)), batches):
                learning.step(_loss(learning.net, [runs[int(i)] for i in part], s, net.spread))
    return StripNet(*(getattr(learning.net, field.name).detach().double() for field in fields(net)))
