"""Recordings whose baseline parameters differ: a tank that fills, a zero that was lost, a payload that grew.

    r_g ~ N(0, s W^-1) at s_0   against   r_g ~ N(0, s W^-1 + Y_g Y_g') at s_1:    2 gain_g = n log(s_0 / s_1) + n - Q(s_1) - log|M(s_1)|
    M = I + Y_g'W Y_g / s,   Q = (r'W r - b'M^-1 b / s) / s,   b = Y_g'W r_g,   s_0 = r'W r / n,  s_1 the most probable

r is the residual of the best fit in recording g, W the inverse of its noise up to the size s, which may differ between recordings. A
change of parameters has the prior spread of these parameters. Two changes are not counted: disagreement between records of acceleration,
and a change smaller than the noise of the motion makes of the torque. That noise biases parameters by its share in the motion (Fuller,
1987). A law with values for each recording, such as the phase of a wave, is compared with the same change at the noise of the search.
Source: MacKay (1992), Neural Computation 4, eq. 2.7.
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import DETECTED, MATERIAL
from nnhydro.diagnosis.search.best_fit import best_fit, remainder_without_unknown
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search

Array = NDArray[np.float64]
ROUNDS = 10  # iterations of a recording's noise variance
FEWEST_ROWS = 4.0  # rows per parameter that a noise variance of one recording takes


def gain_of_changed_parameters(Y: Array, r: Array, further: int = 0) -> tuple[float, Array]:
    """Return the nats by which r (n,) is more probable with a change z (p,) of its parameters, columns Y (n, p), and the change.

    What the last `further` columns gain alone does not count.
    """
    n, p = Y.shape
    alone = max(gain_of_changed_parameters(Y[:, p - further:], r)[0], 0.0) if further else 0.0
    g, V, b = _diagonalise(Y, r)
    rr = float(r @ r)
    size = none = rr / n
    if not none > 0:
        return 0.0, np.zeros(p)
    for _ in range(ROUNDS):
        Q = (rr - float(b @ (b / (size + g)))) / size
        size *= max(Q / n, 1e-6)
    z = b / (size + g)
    Q = (rr - float(b @ z)) / size
    return (n * float(np.log(none / size)) + n - Q - float(np.log1p(g / size).sum())) / 2 - alone, V @ z


def _diagonalise(Y: Array, r: Array) -> tuple[Array, Array, Array]:
    """Return g, V, b with Y'Y = V g V' and b = V'Y'r. 1 + g / s is never singular: columns of an arm at rest repeat each other."""
    U, root, V = np.linalg.svd(Y, full_matrices=False)
    root[root <= len(Y) * np.finfo(float).eps * root.max(initial=0.0)] = 0.0
    return root**2, V.T, root * (U.T @ r)


def _enough(search: Search, group: int) -> bool:
    """Return whether recording `group` has the rows that a level of its noise takes."""
    whitened, problem = search.whitened, search.view.library.design.problem
    rows = problem.group_of == group
    return bool(whitened.p and rows.sum() * whitened.joints >= FEWEST_ROWS * whitened.p and not (problem.frequency[rows] < 0).any())


def _gain_at_noise(Y: Array, r: Array) -> float:
    """Return the nats by which r (n,) is more probable with a change of its parameters, columns Y (n, p), at noise of unit variance.

        (b'(G + 1)^-1 b - log|G + 1|) / 2,     G = Y'Y, b = Y'r
    """
    g, _, b = _diagonalise(Y, r)
    return (float(b @ (b / (1 + g))) - float(np.log1p(g).sum())) / 2


def nats_of_parameters_per_recording(search: Search, found: ScoredSet) -> float:
    """Return the nats that mass, drag and added mass gain beside a set where each recording has its own, in place of the unknown."""
    whitened, left, total = search.whitened, remainder_without_unknown(search, found), -found.unknown_nats
    problem, per_arm = search.view.library.design.problem, whitened.p - search.view.library.design.problem.further_columns
    for g in range(problem.groups):
        if _enough(search, g):
            rows = problem.group_of == g
            Y, r = whitened.Y[rows].reshape(-1, whitened.p), left[rows].ravel()
            total += max(_gain_at_noise(Y, r) - max(_gain_at_noise(Y[:, per_arm:], r), 0.0), 0.0)
    return total


def recordings_with_changed_parameters(search: Search, found: ScoredSet) -> tuple[str, ...]:
    """Return the recordings in which the baseline's parameters differ from those of all, beyond what they are known to."""
    fit, design = best_fit(search, found), search.view.library.design
    problem, differ = design.problem, []
    for g in range(problem.groups):
        if not _enough(search, g):
            continue
        rows = problem.group_of == g
        gain, z = gain_of_changed_parameters(fit.whitened.Y[rows].reshape(-1, fit.whitened.p), fit.residual[rows].ravel(),
                                         problem.further_columns)
        change = design.Y[rows] @ z
        energy = (change**2).sum(axis=0)
        plain = energy > design.input_variance[rows].sum(axis=0)
        large = design.undriven | (energy >= MATERIAL**2 * (design.tau[rows] ** 2).sum(axis=0))
        if gain - np.log(problem.groups) >= DETECTED and (plain & large).any():
            differ.append(g)
    return tuple(dict.fromkeys(stretch.name for g in differ for stretch in problem.stretches if stretch.group == g))
