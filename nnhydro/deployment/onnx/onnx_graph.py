"""A program as an ONNX graph of few large operations.

Every round of the schedule (schedule.py) becomes: its operands, all linear combinations of what is known, and one operation a kind. Where
the matrix is small, one product gives all operands at once; where it is not, long sums over the same atoms go as matrices of their own, the
others as gathered terms, weighed and added, those of about the same length together. A long sum that contains another one takes it as one
term. A node costs some 0.4 microseconds however small it is, an element that is gathered or joined a thousandth of one: few nodes, and
little that is copied, mean speed (vectors.py). What may be infinite (the travel of a link that has moved for ever) enters no matrix with
zeros: 0 times infinity is no number.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence, Set
from itertools import islice
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.deployment.onnx.clipping import with_clips
from nnhydro.deployment.onnx.expressions import Array, Program, Row, as_cells, infinite_atoms, row_of
from nnhydro.deployment.onnx.row_blocks import Atoms, alike_in_length, mirror_pairs, row_blocks
from nnhydro.deployment.onnx.schedule import rounds
from nnhydro.deployment.onnx.vectors import ELEMENT, NODE, TIMES, Vectors, single

OPS = {"mul": "Mul", "div": "Div", "max": "Max", "min": "Min", "pow": "Pow", "abs": "Abs", "sign": "Sign", "sqrt": "Sqrt", "exp": "Exp",
       "log": "Log", "tanh": "Tanh", "sin": "Sin", "cos": "Cos", "tan": "Tan", "atan": "Atan", "asin": "Asin", "acos": "Acos",
       "floor": "Floor", "ceil": "Ceil", "sigmoid": "Sigmoid", "maxof": "ReduceMax", "minof": "ReduceMin"}
TESTS = {"positive": "Greater", "zero": "Equal"}
CLIPS = {"clip": (-1.0, 1.0), "unit": (0.0, 1.0)}
Parts = list[tuple[Row, float]]  # known sums, atoms among them, and their coefficients
LONG = 4  # terms: longer sums over the same atoms may go as a matrix


def _ratios(row: Row) -> tuple[float, ...]:
    return tuple(c / row[0][1] for _, c in row)


def _cost_by_term(rows: Sequence[Parts]) -> float:
    return 3.5 * NODE + 2 * ELEMENT * max(map(len, rows)) * len(rows)


@final
class Graph(Vectors):
    """The graph of a program; `infinite` atoms enter no matrix."""

    def __init__(self, dtype: Any, infinite: Set[int] = frozenset()) -> None:
        super().__init__(dtype)
        self.infinite = infinite
        self.long: dict[Atoms, dict[tuple[float, ...], Row]] = defaultdict(dict)  # long sums of products by atoms and ratios of terms

    def combine(self, wanted: Iterable[Row]) -> None:
        """Compute every linear combination in `wanted` that is not there yet."""
        blocks, short = self._blocks(dict.fromkeys(row for row in wanted if row not in self.places))
        for (k, m), full in blocks.items():
            self._product(list(full), list(full.values()), k, m)
        wild = [row for row in short if self._wild(row)]
        for rows in self._by_length(short):
            self._sums(rows)
        self._sums(wild, whole=False)

    def _by_length(self, short: Sequence[Row]) -> list[list[Row]]:
        return alike_in_length([row for row in short if not self._wild(row)], 3.5 * NODE, 2 * ELEMENT)

    def _short_cost(self, short: Sequence[Row]) -> float:
        wild = [row for row in short if self._wild(row)]
        costs = [min(self._dense_cost(rows), _cost_by_term(list(map(self._parts, rows)))) for rows in self._by_length(short)]
        return sum(costs) + (_cost_by_term(list(map(self._parts, wild))) if wild else 0.0)

    def _blocks(self, rows: Iterable[Row]) -> tuple[dict[tuple[int, int], dict[Atoms, list[Row]]], list[Row]]:
        """Rows over the same atoms, by size, that take less time as matrices than term by term; and all others."""
        blocks, short = row_blocks(rows, LONG)
        dear = {size for size, full in blocks.items() if self._products_cost(*size, len(full)) > 2 * ELEMENT * math.prod(size) * len(full)}
        short += [row for size in dear for alike in blocks[size].values() for row in alike]
        return {size: full for size, full in blocks.items() if size not in dear}, short

    def _products_cost(self, k: int, m: int, count: int) -> float:
        return 4 * NODE + count * (ELEMENT + TIMES[self.dtype.itemsize] * m) * k

    def _wild(self, row: Row) -> bool:
        return any(k in self.infinite for k, _ in row)

    def _product(self, atoms: list[Atoms], rows: list[list[Row]], k: int, m: int) -> None:
        """Rows over the same atoms by one matrix product, blocks of one shape (k atoms, m rows) together, equal matrices once."""
        g = len(atoms)
        W = np.array([[[c for _, c in row] for row in group] for group in rows]).transpose(0, 2, 1)
        alike: dict[bytes, list[int]] = defaultdict(list)
        for number in range(g):
            alike[W[number].tobytes()].append(number)
        order = [number for group in alike.values() for number in group]
        each = g // len(alike) if len({len(group) for group in alike.values()}) == 1 else 1
        order = order if each > 1 else list(range(g))
        paired = mirror_pairs(W[0].T) if g == 1 else None
        if paired is not None:
            self._mirror(atoms[0], rows[0], W[0], *paired)
            return
        shape = (each, k) if each == g else (g // each, each, k)
        source = self.gather((single(a) for number in order for a in atoms[number]), shape)
        matrices = W[order[0]] if each == g else W[order[::each]]
        product = self.node("MatMul", [source, self.constant(matrices)])
        self.chunk(self.reshape(product, [g * m]), [row for number in order for row in rows[number]])
        for number in order:
            self.long[atoms[number]].update({_ratios(row): row for row in rows[number]})

    def _mirror(self, atoms: Atoms, rows: list[Row], W: Array, pairs: list[tuple[int, int]], signs: Array) -> None:
        """Rows in pairs that differ in the signs of some atoms only: one matrix, of the atoms and of the atoms with these signs."""
        both = self.gather((single(a) for a in (*atoms, *atoms)), (2, len(atoms)))
        signed = self.node("Mul", [both, self.constant(np.stack([np.ones_like(signs), signs]))])
        product = self.node("MatMul", [signed, self.constant(W[:, [a for a, _ in pairs]])])
        self.chunk(self.reshape(product, [len(rows)]), [rows[pair[side]] for side in (0, 1) for pair in pairs])

    def _dense_cost(self, rows: Sequence[Row]) -> float:
        atoms = len({k for row in rows for k, _ in row})
        return 2 * NODE + ELEMENT * atoms + TIMES[self.dtype.itemsize] * atoms * len(rows)

    def _dense(self, rows: Sequence[Row]) -> str:
        """Rows of any terms by one matrix, zeros included; returns the vector of their values."""
        atoms = sorted({k for row in rows for k, _ in row}, key=lambda k: self.place(single(k)))
        at = {k: i for i, k in enumerate(atoms)}
        W = np.zeros((len(atoms), len(rows)))
        for column, row in enumerate(rows):
            for k, c in row:
                W[at[k], column] += c
        return str(self.node("MatMul", [self.gather(map(single, atoms), (len(atoms),)), self.constant(W)]))

    def _sums(self, rows: list[Row], whole: bool = True) -> None:
        """Rows of few terms: by one matrix (`whole`), or each term gathered, weighed and added."""
        if not rows:
            return
        parts = list(map(self._parts, rows))
        in_one = whole and max(map(len, rows)) > 1 and self._dense_cost(rows) < _cost_by_term(parts)
        self.chunk(self._dense(rows) if in_one else self._sum_by_term(parts), rows)

    def _parts(self, row: Row) -> Parts:
        """The terms of a row: atoms, or a sum that is there already and the atoms that it lacks."""
        terms = dict(row)
        for atoms in self.long if len(row) > LONG else ():
            if len(atoms) < len(row) and terms.keys() >= set(atoms):
                inner = tuple((k, terms[k]) for k in atoms)
                if (known := self.long[atoms].get(_ratios(inner))) is not None:
                    return [(known, inner[0][1] / known[0][1]), *((single(k), c) for k, c in row if k not in set(atoms))]
        return [(single(k), c) for k, c in row]

    def _sum_by_term(self, rows: Sequence[Parts]) -> str:
        """Rows of any terms, filled up to the longest: each term gathered, weighed and added; returns the vector of their values."""
        width = max(map(len, rows))
        padded = [[*row, *([(single(None), 0.0)] * (width - len(row)))] for row in rows]
        weights = np.array([[c for _, c in row] for row in padded])
        shape = weights.shape if width > 1 else (len(rows),)
        source = self.gather((key for row in padded for key, _ in row), shape)
        product = str(self.node("Mul", [source, self.constant(weights.reshape(shape))]))
        return product if width == 1 else str(self.node("ReduceSum", [product, self.constant([1], np.int64)], keepdims=0))

    def output(self, name: str, values: NDArray[np.object_]) -> None:
        """Compute the output `name`."""
        rows = [row_of(x) for x in values.ravel()]
        self.combine(rows)
        vector = self.gather(rows, (values.size,))
        self.nodes.append(self.onnx.helper.make_node("Reshape", [vector, self.constant(values.shape, np.int64)], [name]))

    def round(self, program: Program, kinds: dict[str, list[int]]) -> None:
        """Compute the atoms `kinds` {kind: atoms}."""
        operands = {k: [row_of(x) for x in program.atoms[k].operands] for atoms in kinds.values() for k in atoms}
        extreme = [k for kind in ("maxof", "minof") for k in kinds.get(kind, [])]
        self.combine(row for k in extreme for row in operands[k])
        for k in extreme:
            source = self.gather(operands[k], (len(operands[k]),))
            self.chunk(self.node(OPS[program.atoms[k].kind], [source, self.constant([0], np.int64)], keepdims=1), [((k, 1.0),)])
        plain = {kind: atoms for kind, atoms in kinds.items() if kind not in ("maxof", "minof")}
        slots = [(kind, number) for kind, atoms in plain.items() for number in range(len(operands[atoms[0]]))]
        if slots:
            parts = self._operands([[operands[k][number] for k in plain[kind]] for kind, number in slots])
            vectors: dict[str, list[str]] = defaultdict(list)
            for (kind, _), part in zip(slots, parts, strict=True):
                vectors[kind].append(part)
            for kind, atoms in plain.items():
                self.chunk(self.operation(kind, vectors[kind]), [((k, 1.0),) for k in atoms])

    def _operands(self, vectors: list[list[Row]]) -> list[str]:
        """Return vectors of the values of rows, constants as they are; equal rows throughout are one number."""
        short = [rows[:1] if len(set(rows)) == 1 else rows for rows in vectors]
        numbers = [all(k is None for row in rows for k, _ in row) for rows in short]
        computed = iter(self._vectors_of([rows for rows, number in zip(short, numbers, strict=True) if not number]))
        return [self.constant([row[0][1] for row in rows]) if number else next(computed)
                for rows, number in zip(short, numbers, strict=True)]

    def _vectors_of(self, vectors: list[list[Row]]) -> list[str]:
        """Vectors of the values of rows: by one matrix, all term by term, or new sums first and then each gathered."""
        rows = [row for vector in vectors for row in vector]
        fresh = dict.fromkeys(row for row in rows if row not in self.places)
        there = all(self.due(single(k)) < math.inf for row in rows for k, _ in row)  # of sums known already they may be gone
        blocks, _ = self._blocks(fresh)
        if fresh and there and not blocks:
            parts = list(map(self._parts, rows))
            dense = math.inf if any(map(self._wild, rows)) else self._dense_cost(rows)
            cut = NODE * (len(vectors) > 1)
            at_once = cut + min(dense, _cost_by_term(parts))
            if at_once < self._short_cost(list(fresh)) + NODE * (1 + len(vectors)) + ELEMENT * len(rows):
                whole = self._dense(rows) if cut + dense == at_once else self._sum_by_term(parts)
                self.chunk(whole, rows)
                return self._cut(whole, list(map(len, vectors)))
        self.combine(rows)
        self.join_scattered(vectors)
        return [self.gather(vector, (len(vector),)) for vector in vectors]

    def _cut(self, whole: str, sizes: list[int]) -> list[str]:
        return [whole] if len(sizes) == 1 else self.node("Split", [whole, self.constant(sizes, np.int64)], len(sizes), axis=0)

    def operation(self, kind: str, parts: Sequence[str]) -> str:
        """Add the nodes of one operation and return the name of its result."""
        if kind in TESTS:
            truth = self.node(TESTS[kind], [parts[0], self.constant(0.0)])
            return str(self.node("Cast", [truth], to=self.onnx.helper.np_dtype_to_tensor_dtype(self.dtype)))
        if kind in CLIPS:
            return str(self.node("Clip", [parts[0], *map(self.constant, CLIPS[kind])]))
        if kind == "where":
            truth = self.node("Greater", [parts[0], self.constant(0.5)])
            return str(self.node("Where", [truth, *parts[1:]]))
        return str(self.node(OPS[kind], parts))


def onnx_model(program: Program, inputs: dict[str, tuple[int, ...]], outputs: dict[str, NDArray[np.object_]], dtype: Any, opset: int,
               metadata: dict[str, str]) -> Any:
    """Return the ONNX model of a program; `inputs` {name: shape} in the order of its inputs, `outputs` {name: expressions}.

    Inputs on which no output depends are left out. The file format is that of opset `opset`; numbers have the type `dtype`.
    """
    program, flat = with_clips(program, [x for values in outputs.values() for x in values.ravel()])
    remaining = iter(flat)
    outputs = {name: as_cells(list(islice(remaining, values.size)), values.shape) for name, values in outputs.items()}
    graph = Graph(dtype, infinite_atoms(program))
    helper, number = graph.onnx.helper, 0
    kind = helper.np_dtype_to_tensor_dtype(graph.dtype)
    needed, declared = program.dependencies(flat), []
    graph.chunk(graph.constant([1.0]), [((None, 1.0),)])
    for name, shape in inputs.items():
        size = int(np.prod(shape))
        if needed & set(range(number, number + size)):
            declared.append(helper.make_tensor_value_info(name, kind, shape))
            vector = name if len(shape) == 1 else graph.node("Reshape", [name, graph.constant([size], np.int64)])
            graph.chunk(vector, [((k, 1.0),) for k in range(number, number + size)])
        number += size
    planned = rounds(program, flat)
    done = {k: number for number, kinds in enumerate(planned) for atoms in kinds.values() for k in atoms}
    due = {name: 1 + max((done.get(k, -1) for x in values.ravel() for k, _ in row_of(x) if k is not None), default=-1)
           for name, values in outputs.items()}  # an output is made as soon as it can be, so that nothing waits for it
    wanted = [[row_of(x) for atoms in kinds.values() for k in atoms for x in program.atoms[k].operands] for kinds in [*planned, {}]]
    for name, number_due in due.items():
        wanted[number_due] += map(row_of, outputs[name].ravel())
    graph.plan(wanted)
    for graph.now, kinds in enumerate([*planned, {}]):
        for name in (name for name, number_due in due.items() if number_due == graph.now):
            graph.output(name, outputs[name])
        graph.round(program, kinds)
    made = helper.make_graph(graph.nodes, "step", declared, [helper.make_tensor_value_info(name, kind, values.shape)
                                                             for name, values in outputs.items()], list(graph.constants.values()))
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", opset)], producer_name="nnhydro", ir_version=10)
    helper.set_model_props(model, metadata)
    graph.onnx.checker.check_model(model)
    return model
