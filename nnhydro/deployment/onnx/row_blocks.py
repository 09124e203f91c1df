"""Which sums go together: rows over the same atoms, pairs of rows of a network and its mirror image, rows of about the same length."""

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from nnhydro.deployment.onnx.expressions import Array, Program, Row, Value, row_of

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


def alike_in_length(rows: Sequence[Row], group_time: float, term_time: float) -> list[list[Row]]:
    """Return the rows, the shortest first, in the groups that take least time: each `group_time`, and `term_time` a term.

    The shorter rows of a group are filled up to its longest.
    """
    by_length: dict[int, list[Row]] = defaultdict(list)
    for row in rows:
        by_length[len(row)].append(row)
    best: list[tuple[float, list[list[Row]]]] = [(0.0, [])]  # time, and groups, of the shortest rows
    lengths = sorted(by_length)
    for end, longest in enumerate(lengths, 1):
        ways = []
        for start in range(end):
            group = [row for length in lengths[start:end] for row in by_length[length]]
            ways.append((best[start][0] + group_time + term_time * longest * len(group), [*best[start][1], group]))
        best.append(min(ways, key=lambda way: way[0]))
    return best[-1][1]


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


def alike_rows(program: Program, outputs: Sequence[Value], long: int) -> dict[Atoms, list[Row]]:
    """Return every row of more than `long` terms of the program by its atoms: over the same atoms they are one matrix."""
    found: dict[Atoms, dict[Row, None]] = defaultdict(dict)
    needed = [x for k in sorted(program.dependencies(list(outputs))) for x in program.atoms[k].operands]
    for row in map(row_of, [*needed, *outputs]):
        if len(row) > long:
            found[tuple(k for k, _ in row)][row] = None
    return {atoms: list(rows) for atoms, rows in found.items()}
