"""Sums that go as matrices: rows over the same atoms, and matrices whose rows come in pairs, a network and its mirror image."""

from collections import defaultdict
from collections.abc import Iterable

import numpy as np

from nnhydro.deployment.onnx.expressions import Array, Row

Atoms = tuple[int | None, ...]  # None: the constant 1


def row_blocks(rows: Iterable[Row], long: int) -> tuple[dict[tuple[int, int], dict[Atoms, list[Row]]], list[Row]]:
    """Return rows of more than `long` terms over the same atoms by size {(atoms, rows): {atoms: rows}}, small matrices, and all others."""
    by_atoms: dict[Atoms, list[Row]] = defaultdict(list)
    for row in rows:
        by_atoms[tuple(k for k, _ in row)].append(row)
    blocks: dict[tuple[int, int], dict[Atoms, list[Row]]] = defaultdict(dict)
    short = []
    for atoms, alike in by_atoms.items():
        if len(atoms) > long and len(alike) > 1:
            blocks[len(atoms), len(alike)][atoms] = alike
        else:
            short += alike
    return blocks, short


def mirror_pairs(W: Array) -> tuple[list[tuple[int, int]], Array] | None:
    """Return pairs of rows of W (m, k) that differ by one pattern of signs s (k,) only, and s; None where they do not all pair up."""
    by_size: dict[bytes, list[int]] = defaultdict(list)
    for i, row in enumerate(np.abs(W)):
        by_size[row.tobytes()].append(i)
    if any(len(found) != 2 for found in by_size.values()):
        return None
    pairs = [(a, b) for a, b in by_size.values()]
    signs = np.array([np.sign(W[a] * W[b]) for a, b in pairs])
    s = np.where((signs >= 0).all(axis=0), 1.0, -1.0)
    return (pairs, s) if (s < 0).any() and ((signs == s) | (signs == 0)).all() else None
