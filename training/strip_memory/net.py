"""Trained memories of the strips, many side by side, each with recordings and first numbers of its own.

The net is that of nnhydro/models/learned/strip_net.py, its training that of nnhydro/fitting/network/strip_net (fit.py, muon.py), where the
equations and their sources stand. A leading axis e counts the nets.
"""

import math
from typing import Any

import torch
from torch import Tensor, nn

FASTEST = 6.0  # a diameter
LINEAR, CUBIC, QUINTIC = 3.4445, -4.7750, 2.0315
BETA, ROUNDS = 0.9, 5


def scan(a: Tensor, b: Tensor) -> Tensor:
    """h_t = a_t h_{t-1} + b_t along axis 1, from h = 0; on a GPU in log2 of its length rounds."""
    if not a.is_cuda:
        keep, h = a.numpy(), b.clone()
        now = h.numpy()
        for t in range(1, a.shape[1]):
            now[:, t] += keep[:, t] * now[:, t - 1]
        return h
    step = 1
    while step < a.shape[1]:
        b = b + a * torch.cat([torch.zeros_like(b[:, :step]), b[:, :-step]], dim=1)
        a = a * torch.cat([torch.ones_like(a[:, :step]), a[:, :-step]], dim=1)
        step *= 2
    return b


class Scan(torch.autograd.Function):
    """`scan` with its gradient, a scan backward in time."""

    @staticmethod
    def forward(ctx: Any, a: Tensor, b: Tensor) -> Tensor:
        h = scan(a.detach(), b.detach())
        ctx.save_for_backward(a, h)
        return h

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor, Tensor]:
        a, h = ctx.saved_tensors
        after = torch.cat([a[:, 1:].conj(), torch.zeros_like(a[:, :1])], dim=1).resolve_conj()
        g = scan(after.flip(1), grad.flip(1)).flip(1)
        return g * torch.cat([torch.zeros_like(h[:, :1]), h[:, :-1]], dim=1).conj(), g


def weights(nets: int, rows: int, columns: int) -> nn.Parameter:
    return nn.Parameter((2 * torch.rand(nets, rows, columns) - 1) / rows**0.5)


class StripMemories(nn.Module):
    """Loads (e, t, strips) (D/s)^2 of x (e, t, strips, odd), r, dsigma, ds, V^2 and plain loads."""

    def __init__(self, nets: int, odd: int, size: int, columns: int, plain: int) -> None:
        super().__init__()
        k = self.k = size // 2
        self.inner, self.drive, self.gate = weights(nets, odd - 1, size), weights(nets, size, 3 * k), weights(nets, size + 1, 2 * k)
        rate = torch.exp(math.log(0.08) + math.log(4.0 / 0.08) * torch.rand(nets, 2 * k)) / FASTEST
        self.gate_bias = nn.Parameter(torch.logit(rate))
        self.theta, self.kappa = nn.Parameter(1.3 * torch.rand(nets, k)), nn.Parameter(3.0 * torch.rand(nets, k))
        self.odd, self.even = weights(nets, size + 3 * k + 1, size), weights(nets, k + 1, size)
        self.even_bias = nn.Parameter(0.33 * (2 * torch.rand(nets, size) - 1))
        self.out, self.skip = nn.Parameter(torch.zeros(nets, size, 1)), weights(nets, odd, 1)
        self.body, self.plain = nn.Parameter(torch.zeros(nets, columns)), nn.Parameter(torch.zeros(nets, plain))

    def forward(self, x: Tensor, r: Tensor, way: Tensor, V2: Tensor, plain: Tensor, dropped: float) -> Tensor:
        def times(z: Tensor, w: Tensor) -> Tensor:
            return torch.einsum("etsi,eio->etso", z, w)

        def mid(z: Tensor) -> Tensor:
            return (torch.cat([z[:, :1], z[:, :-1]], dim=1) + z) / 2

        k, e = self.k, torch.tanh(times(x[..., :-1], self.inner))
        gate = times(torch.cat([e**2, r], dim=-1), self.gate) + self.gate_bias[:, None, None]
        rate, d = mid(FASTEST * torch.sigmoid(gate)), mid(times(e, self.drive))
        keep = torch.exp(-rate * way[..., :1])
        turn = torch.cat([self.theta[:, None, None] * way[..., :1], self.kappa[:, None, None] * way[..., 1:]], dim=-1)
        half = torch.polar(torch.ones_like(turn), turn / 2)
        drive = torch.complex(torch.cat([d[..., :k], d[..., 2 * k:]], dim=-1), torch.cat([d[..., k:2 * k], 0 * d[..., 2 * k:]], dim=-1))
        h = Scan.apply(keep * half**2, (1 - keep) * half * drive)
        o = times(torch.cat([e, h.real, h.imag[..., :k], x[..., -1:]], dim=-1), self.odd)
        v = times(torch.cat([h.imag[..., k:], r], dim=-1), self.even) + self.even_bias[:, None, None]
        u = nn.functional.dropout((torch.tanh(v + o) - torch.tanh(v - o)) / 2, dropped)
        return V2 * (times(u, self.out) + times(x, self.skip))[..., 0] + torch.einsum("etsp,ep->ets", plain, self.plain)


def orthogonal(g: Tensor) -> Tensor:
    """UV' of each g = USV' (e, rows, columns), about."""
    wide = g.shape[1] <= g.shape[2]
    x = (g if wide else g.mT) / (g.flatten(1).norm(dim=1)[:, None, None] + 1e-30)
    for _ in range(ROUNDS):
        a = x @ x.mT
        x = LINEAR * x + (CUBIC * a + QUINTIC * a @ a) @ x
    return x if wide else x.mT


class Steps:
    """Adam's steps, or orthogonal ones of the matrices and Adam's of all else, over one cycle of rates."""

    def __init__(self, net: StripMemories, steps: int, rate: float, matrix_rate: float, decay: float) -> None:
        stated = [net.body, net.plain]
        self._learned = [p for name, p in net.named_parameters() if name not in ("body", "plain")]
        self._matrices = [net.inner, net.drive, net.gate, net.odd, net.even] if matrix_rate else []
        self._momenta, self._rate, self._matrix_rate, self._decay = [torch.zeros_like(p) for p in self._matrices], rate, matrix_rate, decay
        orthogonal_ones = {id(p) for p in self._matrices}
        self._adam = torch.optim.AdamW([{"params": [p for p in self._learned if id(p) not in orthogonal_ones], "weight_decay": decay},
                                        {"params": stated, "weight_decay": 0.0}], rate)
        self._rates = torch.optim.lr_scheduler.OneCycleLR(self._adam, [rate, 3 * rate], total_steps=steps, pct_start=0.1)

    def step(self, loss: Tensor) -> None:
        self._adam.zero_grad()
        for p in self._matrices:
            p.grad = None
        loss.backward()
        with torch.no_grad():
            norm = torch.stack([p.grad.flatten(1).square().sum(dim=1) for p in self._learned]).sum(dim=0).sqrt().clamp(min=1.0)
            for p in self._learned:
                p.grad /= norm.view(-1, *[1] * (p.dim() - 1))
            rate = self._matrix_rate * self._rates.get_last_lr()[0] / self._rate
            for p, m in zip(self._matrices, self._momenta, strict=True):
                m.lerp_(p.grad, 1 - BETA)
                along = orthogonal(torch.lerp(p.grad, m, BETA))
                p.mul_(1 - rate * self._decay).sub_(along, alpha=rate * max(1.0, p.shape[1] / p.shape[2]) ** 0.5)
        self._adam.step()
        self._rates.step()
