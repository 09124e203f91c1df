"""The linear part of a network, solved before its training: penalised least squares on the odd features, one solution a member.

    minimise  sum over rows of sum_j [ W_j (x K_j - y_j) ]^2 / s_j^2  +  lambda tr |K|^2
    y_j = b atanh( target_j / (S_j b) ),   W_j = S_j (1 - (target_j / (S_j b))^2)

y is the output before the bound, W what an error of it costs in torque, s_j the rms target. A member solves on the rows that it trains
on and takes the lambda that does best on the recordings that it watches. One pass over the rows: memory is that of the normal matrices.
Even features cannot change the sign with the mirror and stay out. Source: ours.
"""

from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.identification.training_rows import Rows

CHUNK = 8192  # rows at a time
NEAR_BOUND = 0.95  # targets closer to the bound than that tell nothing of y
PENALTIES = tuple(10.0**-k for k in range(8))  # of the mean diagonal of the normal matrix
UNWATCHED = 1e-3  # where no recording can be watched


@final
@dataclass
class _Sums:
    """Normal equations of E members: H (E, joints, k, k), g (E, joints, k), c (E, joints), rows (E,)."""

    H: Tensor
    g: Tensor
    c: Tensor
    n: Tensor

    @staticmethod
    def zero(members: int, joints: int, k: int) -> "_Sums":
        shape = (members, joints)
        return _Sums(*(torch.zeros(size, dtype=torch.float64) for size in ((*shape, k, k), (*shape, k), shape, (members,))))

    def add(self, member: int, A: Tensor, z: Tensor) -> None:
        """Add weighted rows A (joints, m, k) with right-hand sides z (joints, m) to one member's sums."""
        self.H[member] += A.transpose(1, 2) @ A
        self.g[member] += (A.transpose(1, 2) @ z[..., None])[..., 0]
        self.c[member] += (z**2).sum(dim=1)
        self.n[member] += A.shape[1]

    def error(self, member: int, K: Tensor) -> float:
        """Sum of squares left by K (joints, k) over these rows."""
        left = self.c[member] - 2 * (self.g[member] * K).sum(dim=1) + torch.einsum("jp,jpq,jq->j", K, self.H[member], K)
        return float(left.sum())


def _weighted(rows: Rows, part: slice, odd: Tensor, bound: float, s: Tensor) -> tuple[Tensor, Tensor]:
    """Rows A (joints, m, k) and right-hand sides z (joints, m) of a chunk."""
    S = rows.scale[part].double()
    f = (rows.target[part].double() / (S * bound)).clamp(-NEAR_BOUND, NEAR_BOUND)
    W = S * (1 - f**2) / s
    return W.T[..., None] * rows.x[part][:, odd].double(), (W * bound * torch.atanh(f)).T


def _sums(rows: Rows, watch: Tensor, odd: Tensor, bound: float, s: Tensor) -> tuple[_Sums, _Sums]:
    """Sums over all rows (one member) and over those that each member watches; `watch` (members, n) bool."""
    joints, k = rows.target.shape[1], int(odd.sum())
    everything, watched = _Sums.zero(1, joints, k), _Sums.zero(len(watch), joints, k)
    for start in range(0, len(rows.x), CHUNK):
        part = slice(start, start + CHUNK)
        A, z = _weighted(rows, part, odd, bound, s)
        everything.add(0, A, z)
        for member, mask in enumerate(watch[:, part]):
            watched.add(member, A[:, mask], z[:, mask])
    return everything, watched


def _solved(H: Tensor, g: Tensor, penalty: float) -> Tensor:
    """Return K (joints, k) for the normal equations H (joints, k, k), g (joints, k)."""
    size = torch.diagonal(H, dim1=1, dim2=2).mean(dim=1).clamp(min=1e-12)
    K: Tensor = torch.linalg.solve(H + penalty * size[:, None, None] * torch.eye(H.shape[1], dtype=H.dtype), g[..., None])
    return K[..., 0]


def linear_start(rows: Rows, watched: Tensor, bound: float) -> Tensor:
    """Return the linear parts (members, features, joints), zero for even features; `watched` (members, units) bool."""
    odd = rows.parity < 0
    members, joints = len(watched), rows.target.shape[1]
    skip = torch.zeros(members, rows.x.shape[1], joints)
    if not bool(odd.any()):
        return skip
    s = rows.target.double().pow(2).mean(dim=0).sqrt() + 1e-9
    whole, seen = _sums(rows, watched[:, rows.unit], odd, bound, s)
    for member in range(members):
        H, g = whole.H[0] - seen.H[member], whole.g[0] - seen.g[member]
        found = {penalty: _solved(H, g, penalty) for penalty in (PENALTIES if float(seen.n[member]) > 0 else (UNWATCHED,))}
        best = min(found, key=lambda penalty: seen.error(member, found[penalty]))
        skip[member, odd] = found[best].T.float()
    return skip
