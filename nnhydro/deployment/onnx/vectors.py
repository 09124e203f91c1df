"""Nodes and constants of an ONNX graph, and in which vectors the values lie that were computed so far.

What is asked for in one vector is gathered from the shortest vector that holds all of it. Where no vector does, those that hold parts are
joined, each without what nobody asks for soon where that pays: what is joined stays short. The old vectors remain, and are read again by
whoever needs nothing else.
"""

import math
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable, Sequence, Set
from itertools import chain
from typing import Any

import numpy as np

from nnhydro.deployment.onnx.expressions import Row

SOON = 8  # rounds: what is asked for later is left behind
# microseconds of onnxruntime 1.32 on x86-64: a node, an element gathered, added or copied by a joint, a multiplication in a matrix
NODE, ELEMENT, COPIED, TIMES = 0.5, 0.0008, 0.0004, {8: 2.6e-4, 4: 6e-5}


def single(atom: int | None) -> Row:
    """Return the row of an atom alone; None: the constant 1."""
    return ((atom, 1.0),)


class Vectors:
    """Collects nodes and constants; `chunks` are the vectors computed so far, `places` the last one of each value.

    `positions` tells where in every vector a value lies.
    """

    def __init__(self, dtype: Any) -> None:
        import onnx

        self.onnx, self.dtype = onnx, np.dtype(dtype)
        self.nodes: list[Any] = []
        self.constants: dict[tuple[Any, ...], Any] = {}
        self.chunks: list[tuple[str, list[Row]]] = []
        self.places: dict[Row, int] = {}
        self.positions: dict[Row, dict[int, int]] = defaultdict(dict)
        self.uses: dict[Row, list[int]] = defaultdict(list)  # rounds in which a value is asked for
        self.now = 0

    def constant(self, values: Any, dtype: Any = None) -> str:
        """Return the name of an initializer with `values`; equal ones are kept once."""
        array = np.asarray(values, dtype=self.dtype if dtype is None else dtype)
        key = (array.dtype.str, array.shape, array.tobytes())
        if key not in self.constants:
            self.constants[key] = self.onnx.numpy_helper.from_array(array, f"c{len(self.constants)}")
        return str(self.constants[key].name)

    def node(self, op: str, inputs: Sequence[str], outputs: int = 1, **attributes: Any) -> Any:
        """Append a node; returns its output's name, or a list of names."""
        names = [f"v{len(self.nodes)}" if outputs == 1 else f"v{len(self.nodes)}_{k}" for k in range(outputs)]
        self.nodes.append(self.onnx.helper.make_node(op, list(inputs), names, **attributes))
        return names[0] if outputs == 1 else names

    def chunk(self, name: str, rows: Sequence[Row]) -> None:
        """Take the vector `name` as the values of `rows`."""
        for position, row in enumerate(rows):
            self.places.setdefault(row, len(self.chunks))
            self.positions[row].setdefault(len(self.chunks), position)
        self.chunks.append((name, list(rows)))

    def plan(self, wanted: Sequence[Iterable[Row]]) -> None:
        """Note when each value is asked for, given the sums that are operands in each round."""
        made: set[Row] = set()
        for number, rows in enumerate(wanted):
            for row in rows:
                for part in (row, *([] if row in made else [single(k) for k, _ in row])):
                    self.uses[part].append(number)
                made.add(row)

    def due(self, row: Row) -> float:
        """Return the round, from now on, in which a value is asked for next; infinite: never."""
        uses = self.uses.get(row, [])
        return next(iter(uses[bisect_left(uses, self.now):]), math.inf)

    def place(self, row: Row) -> tuple[int, int]:
        """Return the last chunk that holds a value, and where in it."""
        return self.places[row], self.positions[row][self.places[row]]

    def _due_soon(self, c: int, wanted: Set[Row]) -> tuple[str, list[Row]]:
        """The vector of chunk `c` with what it holds, or a shorter one of what is `wanted` or asked for soon where that pays."""
        name, rows = self.chunks[c]
        soon = [row for row in dict.fromkeys(rows) if self.places.get(row) == c and (row in wanted or self.due(row) <= self.now + SOON)]
        if 2 * COPIED * (len(rows) - len(soon)) < NODE + ELEMENT * len(soon):
            return name, rows
        return self._elements(name, [self.positions[row][c] for row in soon]), soon

    def _holding(self, wanted: Sequence[Row]) -> int | None:
        """The shortest chunk that holds all rows."""
        found = [c for c in self.positions[wanted[0]] if all(c in self.positions[row] for row in wanted)]
        return min(found, key=lambda c: len(self.chunks[c][1]), default=None)

    def join(self, rows: Iterable[Row]) -> int:
        """Return the number of a chunk that holds `rows`, all known: one that is there, or a new one, which stands for its parts."""
        wanted = list(rows)
        found = self._holding(wanted)
        if found is None:
            used = sorted({self.places[row] for row in wanted})
            asked = set(wanted)
            names, parts = zip(*(self._due_soon(c, asked) for c in used), strict=True)
            joined, found = list(chain.from_iterable(parts)), len(self.chunks)
            for row in joined:
                self.places.pop(row, None)
            self.chunk(str(self.node("Concat", names, axis=0)), joined)
        return found

    def join_scattered(self, vectors: Iterable[Sequence[Row]]) -> None:
        """Join what those `vectors` are made of that lie in several chunks, so that each can be gathered from one."""
        rows = [row for vector in vectors if self._holding(vector) is None for row in vector]
        if rows:
            self.join(rows)

    def _elements(self, source: str, index: Sequence[int]) -> str:
        return str(self.node("GatherElements", [source, self.constant(index, np.int32)], axis=0))

    def reshape(self, vector: str, shape: Sequence[int]) -> str:
        """Return the tensor in another shape."""
        return str(self.node("Reshape", [vector, self.constant(shape, np.int64)]))

    def gather(self, rows: Iterable[Row], shape: tuple[int, ...]) -> str:
        """Return the values of `rows`, all known, as one tensor of `shape`."""
        wanted = list(rows)
        found = self.join(wanted)
        index = [self.positions[row][found] for row in wanted]
        source, stored = self.chunks[found]
        taken = source if index == list(range(len(stored))) else self._elements(source, index)
        return taken if len(shape) == 1 else self.reshape(taken, shape)
