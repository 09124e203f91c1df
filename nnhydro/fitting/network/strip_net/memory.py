"""The states of all strips over time, and their gradient: one step of the tape, as a tape of small steps takes most of the time.

    h_t = a_t h_before + z_t,    a = keep T^2,   z = (1 - keep) T d,   keep = exp(-rate dsigma),   T = exp(i half)

as in models/learned/strip_net.py. With g the slope of the loss over h, which runs backward by g_before += conj(a) g:

    p = conj(g) T d,   q = conj(T^2 h_before) g:      d/dkeep = Re q - Re p,   d/dhalf = 2 keep Im q - (1 - keep) Im p,
                                                      d/dd = (1 - keep) conj(T) g
"""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.fitting.network.strip_net.rows import Together

Array = NDArray[Any]


def _complex(re: Array, im: Array) -> Array:
    found = np.empty(re.shape, np.result_type(re.dtype, np.complex64))
    found.real, found.imag = re, im
    return found


def _drive(middle: Array, k: int) -> Array:
    """What drives the states (m, s, 2 k): of those that swing complex, of places real."""
    swings, places = _complex(middle[..., 2 * k:3 * k], middle[..., 3 * k:4 * k]), middle[..., 4 * k:]
    return np.concatenate([swings, places.astype(swings.dtype)], axis=-1)


class Memory(torch.autograd.Function):
    """States (m, s, 2 k), real and imaginary part, of rows that lie `Together`."""

    @staticmethod
    def forward(ctx: Any, both: Tensor, half: Tensor, dsigma: Tensor, re: Tensor, im: Tensor, rows: Together) -> tuple[Tensor, Tensor]:
        """Return h: rates and d are `both` (m, s, 5 k) in mid step, the turn is 2 `half` (m, s, 2 k), the way dsigma (m, s, 1).

        re and im are those of h in the rows in which the flow has lasted.
        """
        x, turn, way = both.numpy(), half.numpy(), dsigma.numpy()
        middle = x[rows.before]
        middle += x
        middle *= 0.5
        keep, T = np.exp(-middle[..., :turn.shape[-1]] * way), _complex(np.cos(turn), np.sin(turn))
        turned, a = T * _drive(middle, turn.shape[-1] // 2), T * T
        a *= keep
        h = turned - keep * turned
        a[rows.lasting], h[rows.lasting] = 0.0, _complex(re.numpy(), im.numpy())
        for before, now in rows.steps():
            h[now] += a[now] * h[before]
        ctx.saved = way, keep, T, turned, a, h, rows
        return torch.from_numpy(h.real.copy()), torch.from_numpy(h.imag.copy())

    @staticmethod
    def backward(ctx: Any, re: Tensor, im: Tensor) -> tuple[Tensor | None, ...]:
        """Return the gradients over `both`, `half` and the states of lasting flow."""
        way, keep, T, turned, a, h, rows = ctx.saved
        k, g, rest = T.shape[-1] // 2, _complex(re.numpy(), im.numpy()), 1 - keep
        stays = np.conjugate(a)
        for before, now in reversed(rows.steps()):
            g[before] += stays[now] * g[now]
        begun = g[rows.lasting]
        g[rows.lasting] = 0.0
        p = np.conjugate(g) * turned
        back = np.conjugate(T) * g
        q = back * np.conjugate(T * h[rows.before])
        q[:rows.ends[0]] = 0.0
        half = 2 * keep * q.imag - rest * p.imag
        rate = way * keep * (p.real - q.real)
        d = rest * back
        both = 0.5 * np.concatenate([rate, d.real[..., :k], d.imag[..., :k], d.real[..., k:]], axis=-1)
        later, first = both[rows.ends[0]:].copy(), rows.before[rows.ends[0]:]
        both[first] += later
        along, turn, begun_re, begun_im = (torch.from_numpy(x) for x in (both, half, begun.real.copy(), begun.imag.copy()))
        return along, turn, None, begun_re, begun_im, None
