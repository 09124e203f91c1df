"""Noise of the compared torque at each joint: from repeats where there are any, and never above what a flexible fit leaves.

    s_j^2 = min( repeats,  residual energy of a ridge on baseline and every hypothesis / rows )
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.blocks import Blocks

Array = NDArray[np.float64]
RIDGE = 1e-6  # relative to a column's own energy
LEAST = 1e-6  # of the torque's rms: noise-free campaigns still get a scale


def flexible_noise(blocks: Blocks, prior: Array) -> Array:
    """Return the rms residual (joints,) N m of a ridge on all columns, each joint fitted for itself."""
    G, rows = blocks.G.sum(axis=0), float(blocks.n.sum())
    found = []
    for joint in G:
        A = joint[:-1, :-1]
        penalty = RIDGE * np.diag(A) + 1e-12
        penalty[: len(prior)] += prior * joint[-1, -1] / rows * 1e-2
        theta = np.linalg.solve(A + np.diag(penalty), joint[:-1, -1])
        energy = joint[-1, -1] - 2 * theta @ joint[:-1, -1] + theta @ A @ theta
        found.append(np.sqrt(max(energy, 0.0) / max(rows - len(theta) / 2, 1.0)))
    return np.array(found)


def noise_of(blocks: Blocks, prior: Array, repeats: tuple[float, ...] | None) -> Array:
    """Return the noise (joints,) N m; `repeats` (joints,) N m where motions were repeated."""
    torque = np.sqrt(blocks.G[:, :, -1, -1].sum(axis=0) / blocks.n.sum())
    noise = flexible_noise(blocks, prior)
    if repeats is not None:
        noise = np.minimum(noise, np.array(repeats))
    result: Array = np.maximum(noise, LEAST * np.maximum(torque, 1e-12))
    return result
