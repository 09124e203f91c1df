"""Steps of matrices along their momentum made orthogonal: all directions of a matrix learn as fast.

    m <- BETA m + (1 - BETA) g,   u = UV' of (BETA m + (1 - BETA) g) = USV',   W <- (1 - rate decay) W - rate sqrt(max(1, rows/columns)) u

UV' comes from five steps of an odd polynomial, which leave singular values between 0.7 and 1.2 (Newton & Schulz).
Source: Jordan et al. (2024), Muon: an optimizer for hidden layers in neural networks, https://kellerjordan.github.io/posts/muon.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

BETA = 0.9
LINEAR, CUBIC, QUINTIC = 3.4445, -4.7750, 2.0315
ROUNDS = 5


def orthogonal(g: Tensor) -> Tensor:
    """Return UV', about, of g = USV' (rows, columns); 0 of 0."""
    wide = g if g.shape[0] <= g.shape[1] else g.T
    x = wide / (wide.norm() + torch.finfo(g.dtype).tiny)
    for _ in range(ROUNDS):
        a = x @ x.T
        x = LINEAR * x + (CUBIC * a + QUINTIC * a @ a) @ x
    found: Tensor = x if g.shape[0] <= g.shape[1] else x.T
    return found


class Muon:
    """The momenta of matrices."""

    def __init__(self, matrices: Sequence[Tensor]) -> None:
        self._momenta = [torch.zeros_like(matrix) for matrix in matrices]

    def step(self, matrices: Sequence[Tensor], gradients: Sequence[Tensor], rate: float, decay: float) -> None:
        """Move every matrix, in place, against its gradient."""
        for w, g, m in zip(matrices, gradients, self._momenta, strict=True):
            m.lerp_(g, 1 - BETA)
            along = orthogonal(torch.lerp(g, m, BETA))
            w.data.mul_(1 - rate * decay).sub_(along, alpha=rate * max(1.0, w.shape[0] / w.shape[1]) ** 0.5)
