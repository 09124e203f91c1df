"""A matrix whose rows come in pairs that differ in the signs of some columns only: a network and its mirror image."""

from collections import defaultdict

import numpy as np

from nnhydro.deployment.onnx.expressions import Array


def mirror_pairs(W: Array) -> tuple[list[tuple[int, int]], Array] | None:
    """Pairs of rows of W (m, k) that differ by one pattern of signs s (k,) only, and s; None where they do not all pair up."""
    by_size: dict[bytes, list[int]] = defaultdict(list)
    for i, row in enumerate(np.abs(W)):
        by_size[row.tobytes()].append(i)
    if any(len(found) != 2 for found in by_size.values()):
        return None
    pairs = [(a, b) for a, b in by_size.values()]
    signs = np.array([np.sign(W[a] * W[b]) for a, b in pairs])
    s = np.where((signs >= 0).all(axis=0), 1.0, -1.0)
    return (pairs, s) if (s < 0).any() and ((signs == s) | (signs == 0)).all() else None
