"""Loads of a strip by neurons that nobody trained: what no product of motion and memory is, as a smooth function of the strip's state.

    f = 1/2 rho D V^2 sum_k c_k s_k + rho pi D^2/4 dw sum_k e_k s_k^2,     s = tanh(N u)                               [N/m]

    u      (w, m, a, b)/V and X/sqrt(1 + X^2), X = D dw/(3 V^2): the state, free of dimension, odd in the mirror
    m, a, b   what the strip's water remembers over travel, and swinging (wake.py), V^2 = mean of w^2 and all m^2
    N      COUNT directions, orthogonal by turns, drawn once and stored with the model

Many such neurons with a normal prior on c and e are a Gaussian process over states: nothing but smoothness is said of the law. They
saturate, so that they do not run away beyond the states of the training. The shape of the load hangs on neither speed nor size. Source:
Neal (1996), Bayesian Learning for Neural Networks, ch. 2; random features: Rahimi & Recht (2007); orthogonal ones: Yu et al. (2016).
"""

from functools import cache
from math import ceil

import numpy as np
import torch
from torch import Tensor

from nnhydro.features.strip_law.state import StripView
from nnhydro.features.wake import STILL, TRAVEL, strip_drag, strip_mass

COUNT = 96  # neurons; of 64 the error on held-out recordings was a tenth larger, of 128 the same
LENGTH = 1.5  # of the state: the way over which a load changes
QUICK = 3.0  # D dw/V^2 of a start or stop within a third of a diameter
STATES = 1 + len(TRAVEL) + 2 + 1  # w, m, a and b, dw
SEED = 0


@cache
def directions() -> Tensor:
    """Return N (COUNT, STATES): rows normally distributed, in blocks of STATES that are orthogonal."""
    rng = np.random.default_rng(SEED)
    blocks = []
    for _ in range(ceil(COUNT / STATES)):
        turn = np.linalg.qr(rng.standard_normal((STATES, STATES)))[0]
        blocks.append(turn * np.sqrt(rng.chisquare(STATES, STATES))[:, None])
    return torch.from_numpy(np.concatenate(blocks)[:COUNT] / LENGTH)


def _state(view: StripView, rows: slice, dw: Tensor) -> tuple[Tensor, Tensor]:
    """u (n, links, STATES, s) and V^2 (n, links, s) m^2/s^2."""
    w, m = view.w[rows], [x[rows] for x in view.travelled]
    V2 = torch.stack([x**2 for x in (w, *m)]).mean(dim=0)
    known = V2 + STILL**2
    V, X = known.sqrt(), view.flow.D[:, None] / QUICK * dw / known
    return torch.stack([*(x / V for x in (w, *m, *(x[rows] for x in view.swinging))), X / (1 + X**2).sqrt()], dim=2), V2


def neuron_loads(view: StripView, N: Tensor, rows: slice = slice(None)) -> tuple[Tensor, Tensor, Tensor]:
    """Return s (n, links, k, s), and of a strip 1/2 rho D V^2 ds and rho pi D^2/4 dw ds, (n, links, 1, s) N, that go with s and s^2."""
    flow = view.flow
    dw = flow.M[rows][:, :, None] * view.x + flow.N[rows][:, :, None]
    u, V2 = _state(view, rows, dw)
    return torch.tanh(N @ u), (strip_drag(flow) * V2)[:, :, None], (strip_mass(flow) * dw)[:, :, None]
