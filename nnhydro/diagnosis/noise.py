"""Noise of the compared torque at each joint: from repeats where there are any, and never above what a flexible fit leaves.

    s_j^2 = min( repeats,  residual energy of a ridge on baseline and every hypothesis / rows )

Where an effect may act in a part of the campaign only, both are too large: then what the ridge leaves of the quieter recordings counts.
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.blocks import Blocks

Array = NDArray[np.float64]
RIDGE = 1e-6  # relative to a column's own energy
QUIET = 0.25  # share of recordings that are quieter
LEAST = 1e-6  # of the torque's rms: noise-free campaigns still get a scale


def _ridge(joint: Array, rows: float, prior: Array) -> Array:
    """The values (P,) of all columns of one joint's Gram matrix."""
    A = joint[:-1, :-1]
    penalty = RIDGE * np.diag(A) + 1e-12
    penalty[: len(prior)] += prior * joint[-1, -1] / rows * 1e-2
    return np.asarray(np.linalg.solve(A + np.diag(penalty), joint[:-1, -1]), np.float64)


def _left(G: Array, theta: Array) -> Array:
    """Energy (n,) that `theta` leaves of the torque in Gram matrices (n, P + 1, P + 1)."""
    result: Array = np.maximum(G[:, -1, -1] - 2 * G[:, :-1, -1] @ theta + np.einsum("p,npq,q->n", theta, G[:, :-1, :-1], theta), 0.0)
    return result


def flexible_noise(blocks: Blocks, prior: Array) -> Array:
    """Return the rms residual (joints,) N m of a ridge on all columns, each joint fitted for itself."""
    G, rows = blocks.G.sum(axis=0), float(blocks.n.sum())
    thetas = [_ridge(joint, rows, prior) for joint in G]
    energy = [_left(joint[None], theta)[0] for joint, theta in zip(G, thetas, strict=True)]
    result: Array = np.sqrt(np.array(energy, np.float64) / max(rows - len(thetas[0]) / 2, 1.0))
    return result


def quiet_noise(blocks: Blocks, prior: Array) -> Array:
    """Return the rms residual (joints,) of the same ridge in the quieter recordings: the lower quartile over recordings."""
    G, n = blocks.by_unit()
    rows = float(n.sum())
    thetas = [_ridge(joint, rows, prior) for joint in G.sum(axis=0)]
    share = rows / max(rows - len(thetas[0]) / 2, 1.0)
    return np.array([np.sqrt(np.quantile(_left(G[:, j], theta) / n, QUIET) * share) for j, theta in enumerate(thetas)])


def noise_of(blocks: Blocks, prior: Array, repeats: tuple[float, ...] | None) -> Array:
    """Return the noise (joints,) N m; `repeats` (joints,) N m where motions were repeated."""
    torque = np.sqrt(blocks.G[:, :, -1, -1].sum(axis=0) / blocks.n.sum())
    noise = flexible_noise(blocks, prior)
    if repeats is not None:
        noise = np.minimum(noise, np.array(repeats))
    result: Array = np.maximum(noise, LEAST * np.maximum(torque, 1e-12))
    return result
