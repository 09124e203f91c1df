"""Recordings whose baseline is another: a tank that fills, a zero that was lost, a payload that grew.

    r_g ~ N(0, s W^-1) at s_0   against   r_g ~ N(0, s W^-1 + Y_g Y_g') at s_1:    2 gain_g = n log(s_0 / s_1) + n - Q(s_1) - log|M(s_1)|
    M = I + Y_g'W Y_g / s,   Q = (r'W r - b'M^-1 b / s) / s,   b = Y_g'W r_g,   s_0 = r'W r / n,  s_1 the most probable

Noise may have any size in a recording, but what the baseline's own parameters make of it is none: r is what the best fit leaves, W its
noise up to the size s. The change of parameters is in the spread of what they are known to. What the records of the acceleration
disagree in is each recording's own, and no parameter; nor is a change smaller than what the noise of the motion makes of the torque, which
biases parameters by its share in the motion (Fuller, 1987).
Source: MacKay (1992), Neural Computation 4, eq. 2.7.
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import DETECTED, MATERIAL
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.stepwise import ScoredSet, Search

Array = NDArray[np.float64]
ROUNDS = 10  # of the size of the noise
FEWEST_ROWS = 4.0  # rows a parameter: of fewer the noise has no level of its own


def gain_of_own_parameters(Y: Array, r: Array, further: int = 0) -> tuple[float, Array]:
    """Return the nats by which r (n,) is more probable with a change z (p,) of its parameters, columns Y (n, p), and the change.

    What the last `further` columns gain alone does not count.
    """
    n, p = Y.shape
    alone = max(gain_of_own_parameters(Y[:, p - further:], r)[0], 0.0) if further else 0.0
    g, V = np.linalg.eigh(Y.T @ Y)  # M = V (1 + g / s) V': never singular, however the columns of what rests repeat each other
    g, b, rr = np.maximum(g, 0.0), V.T @ (Y.T @ r), float(r @ r)
    size = none = rr / n
    if not none > 0:
        return 0.0, np.zeros(p)
    for _ in range(ROUNDS):
        Q = (rr - float(b @ (b / (size + g)))) / size
        size *= max(Q / n, 1e-6)
    z = b / (size + g)
    Q = (rr - float(b @ z)) / size
    return (n * float(np.log(none / size)) + n - Q - float(np.log1p(g / size).sum())) / 2 - alone, V @ z


def recordings_of_own_parameters(search: Search, found: ScoredSet) -> tuple[str, ...]:
    """Return the recordings in which the baseline's parameters differ from those of all, beyond what they are known to."""
    fit, design = best_fit(search, found), search.view.library.design
    whitened, problem = fit.whitened, design.problem
    p, joints = whitened.p, whitened.joints
    differ = []
    for g in range(problem.groups):
        rows = problem.group_of == g
        if not p or rows.sum() * joints < FEWEST_ROWS * p or (problem.frequency[rows] < 0).any():
            continue
        gain, z = gain_of_own_parameters(whitened.Y[rows].reshape(-1, p), fit.residual[rows].ravel(), problem.further_columns)
        change = design.Y[rows] @ z
        energy = (change**2).sum(axis=0)
        plain = energy > design.input_variance[rows].sum(axis=0)
        large = design.undriven | (energy >= MATERIAL**2 * (design.tau[rows] ** 2).sum(axis=0))
        if gain - np.log(problem.groups) >= DETECTED and (plain & large).any():
            differ.append(g)
    return tuple(dict.fromkeys(s.name for g in differ for s in problem.stretches if s.group == g))
