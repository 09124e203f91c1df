"""A trained memory of a strip: a layer of states that fade and turn over the way, as fast as the strip's own motion says.

    e = tanh(A x),   rate = FASTEST sigmoid(G (e^2, r) + g),   d = D e
    h <- exp(-rate dsigma + i a) h + (1 - exp(-rate dsigma)) exp(i a/2) d,   a = theta dsigma + kappa ds,   rate and d in mid step
    y = sum_k c_k [tanh(B o + C v + b) - tanh(-B o + C v + b)]_k / 2 + S (x, X)

x are odd in the mirror, r even; dsigma is the way on the clock of the wake, ds the signed way, in diameters. States with kappa = 0 swing
over the way and are odd. Those with theta = 0 keep what was left at a place of the water: their real part is odd, the imaginary one even.
o are e, X and all odd parts, v the even ones: y is exactly odd. X, the acceleration, is not remembered. Stable by construction:
|h| <= max |d|. Source: Gu & Dao (2023), arXiv 2312.00752 (rates that follow the input); Orvieto et al. (2023), arXiv 2303.06349 (diagonal
complex states); the places are ours.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from rows import LINEAR, Run
from torch import Tensor, nn

FASTEST = 6.0  # a diameter
SOFT = 0.03  # of the mean torque: below it misfits count by their squares


class Scan(torch.autograd.Function):
    """h_t = a_t h_{t-1} + b_t along the first axis, complex, from h = 0."""

    @staticmethod
    def forward(ctx: Any, a: Tensor, b: Tensor) -> Tensor:
        A, H = a.detach().numpy(), b.detach().numpy().copy()
        for t in range(1, len(H)):
            H[t] += A[t] * H[t - 1]
        h = torch.from_numpy(H)
        ctx.save_for_backward(a, h)
        return h

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> tuple[Tensor, Tensor]:
        a, h = ctx.saved_tensors
        A, G = a.detach().numpy().conj(), grad.detach().numpy().copy()
        for t in range(len(G) - 2, -1, -1):
            G[t] += A[t + 1] * G[t + 1]
        along = np.zeros_like(G)
        along[1:] = G[1:] * h.numpy()[:-1].conj()
        return torch.from_numpy(along), torch.from_numpy(G)


class StripMemory(nn.Module):
    """Loads y (strips, t) over rho D V^2, of x (strips, t, odd), the last X, r (strips, t, even), dsigma and ds (strips, t, 1)."""

    def __init__(self, odd: int, even: int, size: int) -> None:
        super().__init__()
        k = self.k = size // 2  # states that swing; as many keep places
        self.inner, self.drive = nn.Linear(odd - 1, size, bias=False), nn.Linear(size, 3 * k, bias=False)
        self.gate = nn.Linear(size + even, 2 * k)
        self.theta, self.kappa = nn.Parameter(torch.empty(k).uniform_(0.0, 1.3)), nn.Parameter(torch.empty(k).uniform_(0.0, 3.0))
        self.odd, self.even = nn.Linear(size + 3 * k + 1, size, bias=False), nn.Linear(k + even, size)
        self.out, self.skip = nn.Linear(size, 1, bias=False), nn.Linear(odd, 1, bias=False)
        with torch.no_grad():
            rate = torch.exp(torch.empty(2 * k).uniform_(np.log(0.08), np.log(4.0)))  # a diameter
            self.gate.bias.copy_(torch.logit(rate / FASTEST))
            self.out.weight.zero_()

    def forward(self, x: Tensor, r: Tensor, dsigma: Tensor, ds: Tensor) -> Tensor:
        k, e = self.k, torch.tanh(self.inner(x[..., :-1]))
        rate = FASTEST * torch.sigmoid(self.gate(torch.cat([e**2, r], dim=-1)))
        turn = torch.cat([self.theta * dsigma, self.kappa * ds], dim=-1)
        rate, drive = ((torch.cat([z[:, :1], z[:, :-1]], dim=1) + z) / 2 for z in (rate, self.drive(e)))  # of the step that ends here
        swing, place = torch.split(drive, [2 * k, k], dim=-1)
        d = torch.cat([torch.complex(swing[..., :k], swing[..., k:]), place.to(torch.complex64)], dim=-1)
        keep, half = torch.exp(-rate * dsigma), torch.polar(torch.ones_like(turn), turn / 2)
        a, b = keep * half**2, (1 - keep) * half * d
        h = Scan.apply(a.transpose(0, 1).contiguous(), b.transpose(0, 1).contiguous()).transpose(0, 1)
        o, v = self.odd(torch.cat([e, h.real, h.imag[..., :k], x[..., -1:]], dim=-1)), self.even(torch.cat([h.imag[..., k:], r], dim=-1))
        y = self.out((torch.tanh(o + v) - torch.tanh(v - o)) / 2) + self.skip(x)
        return y[..., 0]


def loss_of(run: Run, y: Tensor, theta: Tensor, s: Tensor, forces: bool) -> tuple[Tensor, Tensor]:
    """Misfit of the loads y (strips, t), and what there is to explain: of strip forces by their longest lever, or of torques by s N m."""
    load = run.load(y, theta)
    if forces:
        lever = run.levers.abs().amax(dim=1)
        return torch.hypot(lever * (load - run.force) / s[0], torch.tensor(SOFT)).sum(), (lever * run.force / s[0]).abs().sum()
    off = (run.torque(load, theta) - run.y)[run.keep] / s
    return torch.hypot(off, torch.tensor(SOFT)).sum(), (run.y[run.keep] / s).abs().sum()


def train(runs: list[Run], forces: bool, seed: int, config: dict[str, Any]) -> Callable[[Run], Tensor]:
    """The loads (t, strips) that a net trained on `runs` gives, and the torques beside the rigid body's."""
    torch.manual_seed(seed)
    rng, size = np.random.default_rng(seed), config["batch"]
    odd, even = (torch.cat([getattr(run, name).flatten(0, 1) for run in runs]) for name in "xr")
    spread, middle, wide = odd.square().mean(dim=0).sqrt(), even.mean(dim=0), even.std(dim=0) + 0.01
    s = torch.cat([run.y for run in runs]).abs().mean(dim=0)
    net, theta = StripMemory(odd.shape[1], even.shape[1], config["size"]), torch.zeros(LINEAR + runs[0].body.shape[2], requires_grad=True)
    steps = config["epochs"] * -(-len(runs) // size)
    optimiser = torch.optim.AdamW([{"params": list(net.parameters())}, {"params": [theta], "weight_decay": 0.0}], config["rate"])
    rates = torch.optim.lr_scheduler.OneCycleLR(optimiser, [config["rate"], 3 * config["rate"]], total_steps=steps, pct_start=0.1)

    def loads(some: list[Run], noise: float = 0.0) -> list[Tensor]:
        """y (strips, t) of several recordings, in one pass over the longest of them."""
        longest = max(run.x.shape[1] for run in some)
        given = [[nn.functional.pad(z, (0, 0, 0, longest - z.shape[1])) for z in
                  (run.x / spread, (run.r - middle) / wide, run.dsigma, run.ds)] for run in some]
        x, *others = (torch.cat(column) for column in zip(*given, strict=True))
        y = net(x + noise * torch.randn_like(x), *others)
        return [one[:, :run.x.shape[1]] for one, run in zip(y.split([len(run.x) for run in some]), some, strict=True)]

    for _ in range(config["epochs"]):
        for some in ([runs[int(i)] for i in part] for part in np.array_split(rng.permutation(len(runs)), -(-len(runs) // size))):
            parts = [loss_of(run, y, theta, s, forces) for run, y in zip(some, loads(some, config["noise"]), strict=True)]
            loss = torch.stack([off / there.sqrt() for off, there in parts]).sum() / torch.stack([there for _, there in parts]).sum().sqrt()
            optimiser.zero_grad()
            (loss + 1e-3 * theta.square().sum()).backward()
            nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            optimiser.step()
            rates.step()

    def torque(run: Run) -> Tensor:
        with torch.no_grad():
            return run.torque(run.load(loads([run])[0], theta), theta if not forces else torch.cat([theta[:LINEAR], 0 * theta[LINEAR:]]))

    return torque
