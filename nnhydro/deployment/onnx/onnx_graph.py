"""A program as an ONNX graph of few large operations.

Every round of the schedule (schedule.py) becomes: its operands, all linear combinations of what is known, and one operation a kind. Where
the matrix is small, one product gives all operands at once; where it is not, long sums over the same atoms go as matrices of their own, the
others as gathered terms, weighed and added. A node costs about 0.3 microseconds however small it is: few nodes mean speed. What may be
infinite (the travel of a link that has moved for ever) enters no matrix with zeros: 0 times infinity is no number.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence, Set
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.deployment.onnx.expressions import Program, Row, Value, row_of
from nnhydro.deployment.onnx.schedule import rounds

OPS = {"mul": "Mul", "div": "Div", "max": "Max", "min": "Min", "pow": "Pow", "abs": "Abs", "sign": "Sign", "sqrt": "Sqrt", "exp": "Exp",
       "log": "Log", "tanh": "Tanh", "sin": "Sin", "cos": "Cos", "tan": "Tan", "atan": "Atan", "asin": "Asin", "acos": "Acos",
       "floor": "Floor", "ceil": "Ceil", "sigmoid": "Sigmoid", "maxof": "ReduceMax", "minof": "ReduceMin"}
TESTS = {"positive": "Greater", "zero": "Equal"}
SPREADING = ("same", "mul", "abs", "sqrt", "pow", "exp", "log", "max", "maxof", "floor", "ceil")  # infinite where an operand is
LONG = 12  # terms: longer sums go as a matrix, with others over the same atoms
# microseconds of onnxruntime 1.31 on one x86-64 core, to choose between equal ways: a node, a gathered or added element, a multiplication
NODE, ELEMENT, TIMES = 0.3, 0.0008, {8: 2.2e-4, 4: 4e-5}
Place = tuple[int, int]  # chunk and position in it
Atoms = tuple[int | None, ...]  # None: the constant 1


def _blocks(rows: Iterable[Row]) -> tuple[dict[tuple[int, int], dict[Atoms, list[Row]]], list[Row]]:
    """Long rows over the same atoms by size {(atoms, rows): {atoms: rows}}, to be computed as small matrices, and all other rows."""
    by_atoms: dict[Atoms, list[Row]] = defaultdict(list)
    for row in rows:
        by_atoms[tuple(k for k, _ in row)].append(row)
    blocks: dict[tuple[int, int], dict[Atoms, list[Row]]] = defaultdict(dict)
    short = []
    for atoms, own in by_atoms.items():
        if len(atoms) > LONG and len(own) > 1:
            blocks[len(atoms), len(own)][atoms] = own
        else:
            short += own
    return blocks, short


def infinite_atoms(program: Program) -> set[int]:
    """Return the atoms that may be infinite: chosen by a `where` from a constant that is, and what is made of these."""
    found: set[int] = set()

    def may_be(x: Value, least: float = -np.inf) -> bool:
        return any(c > least and (k in found or (k is None and np.isinf(c))) for k, c in row_of(x))

    for number, atom in enumerate(program.atoms):
        wild = [may_be(x, 0.0 if atom.kind == "exp" else -np.inf) for x in atom.operands]  # exp of minus infinity is 0
        if {"where": any(wild[1:]), "div": any(wild[:1]), "min": all(wild), "minof": all(wild)}.get(
                atom.kind, atom.kind in SPREADING and any(wild)):
            found.add(number)
    return found


@final
class Graph:
    """Collects nodes and constants; `chunks` are the vectors computed so far and `places` tells where in them each value lies."""

    def __init__(self, dtype: Any, infinite: Set[int] = frozenset()) -> None:
        import onnx

        self.onnx, self.dtype, self.infinite = onnx, np.dtype(dtype), infinite
        self.nodes: list[Any] = []
        self.constants: dict[tuple[Any, ...], Any] = {}
        self.chunks: list[tuple[str, int]] = []
        self.places: dict[Row, Place] = {}
        self.moved: dict[int, Place] = {}

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
            self.places.setdefault(row, (len(self.chunks), position))
        self.chunks.append((name, len(rows)))

    def _home(self, place: Place) -> Place:
        """Where a value lies now that its chunk may be part of a longer one."""
        chunk, position = place
        while chunk in self.moved:
            chunk, offset = self.moved[chunk]
            position += offset
        return chunk, position

    def _merge_chunks(self, used: Sequence[int]) -> str:
        """Join chunks to one, which stands for them from now on: a joint pays for each of its parts."""
        name, offset = self.node("Concat", [self.chunks[c][0] for c in used], axis=0), 0
        for c in used:
            self.moved[c] = (len(self.chunks), offset)
            offset += self.chunks[c][1]
        self.chunks.append((name, offset))
        return str(name)

    def gather(self, rows: Iterable[Row], shape: tuple[int, ...]) -> str:
        """Return the values of `rows`, all known, as one tensor of `shape`."""
        places = [self._home(self.places[row]) for row in rows]
        used = sorted({chunk for chunk, _ in places})
        start = dict(zip(used, np.cumsum([0, *(self.chunks[c][1] for c in used)]), strict=False))
        index = np.array([start[c] + p for c, p in places], dtype=np.int64).reshape(shape)
        total = sum(self.chunks[c][1] for c in used)
        source = self.chunks[used[0]][0] if len(used) == 1 else self._merge_chunks(used)
        if len(shape) == 1 and len(index) == total and (index == np.arange(total)).all():
            return source
        taken = str(self.node("GatherElements", [source, self.constant(index.ravel(), np.int64)], axis=0))
        return taken if len(shape) == 1 else str(self.node("Reshape", [taken, self.constant(shape, np.int64)]))

    def combine(self, wanted: Iterable[Row]) -> None:
        """Compute every linear combination in `wanted` that is not there yet."""
        blocks, short = _blocks(dict.fromkeys(row for row in wanted if row not in self.places))
        for (k, m), full in blocks.items():
            self._product(list(full), list(full.values()), k, m)
        wild = [row for row in short if self._wild(row)]
        few, many = ([row for row in short if (len(row) > 4) == long and not self._wild(row)] for long in (False, True))
        for rows in (few, many):
            self._sums(rows)
        self._sums(wild, whole=False)

    def _wild(self, row: Row) -> bool:
        return any(k in self.infinite for k, _ in row)

    def _product(self, atoms: list[Atoms], rows: list[list[Row]], k: int, m: int) -> None:
        """Rows over the same atoms by one matrix product, blocks of one shape (k atoms, m rows) together."""
        g = len(atoms)
        source = self.gather((((a, 1.0),) for group in atoms for a in group), (g, 1, k))
        W = np.array([[[c for _, c in row] for row in group] for group in rows]).transpose(0, 2, 1)
        product = self.node("MatMul", [source, self.constant(W)])
        self.chunk(self.node("Reshape", [product, self.constant([g * m], np.int64)]), [row for group in rows for row in group])

    def _dense_cost(self, atoms: int, rows: int) -> float:
        return 2 * NODE + ELEMENT * atoms + TIMES[self.dtype.itemsize] * atoms * rows

    def _dense(self, rows: Sequence[Row]) -> str:
        """Rows of any terms by one matrix, zeros included; returns the vector of their values."""
        atoms = sorted({k for row in rows for k, _ in row}, key=lambda k: self._home(self.places[((k, 1.0),)]))
        at = {k: i for i, k in enumerate(atoms)}
        W = np.zeros((len(atoms), len(rows)))
        for column, row in enumerate(rows):
            for k, c in row:
                W[at[k], column] += c
        return str(self.node("MatMul", [self.gather((((k, 1.0),) for k in atoms), (len(atoms),)), self.constant(W)]))

    def _sums(self, rows: list[Row], whole: bool = True) -> None:
        """Rows of few terms: by one matrix (`whole`), or each term gathered, weighed and added."""
        if not rows:
            return
        width, atoms = max(map(len, rows)), len({k for row in rows for k, _ in row})
        if whole and width > 1 and self._dense_cost(atoms, len(rows)) < 3.5 * NODE + 2 * ELEMENT * width * len(rows):
            self.chunk(self._dense(rows), rows)
            return
        padded = [(*row, *(((None, 0.0),) * (width - len(row)))) for row in rows]
        source = self.gather((((a, 1.0),) for row in padded for a, _ in row), (len(rows), width) if width > 1 else (len(rows),))
        weights = np.array([[c for _, c in row] for row in padded])
        product = self.node("Mul", [source, self.constant(weights if width > 1 else weights[:, 0])])
        self.chunk(product if width == 1 else self.node("ReduceSum", [product, self.constant([1], np.int64)], keepdims=0), rows)

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
            sizes = [len(plain[kind]) for kind, _ in slots]
            whole = self._operands([operands[k][number] for kind, number in slots for k in plain[kind]])
            parts = [whole] if len(sizes) == 1 else self.node("Split", [whole, self.constant(sizes, np.int64)], len(sizes), axis=0)
            vectors: dict[str, list[str]] = defaultdict(list)
            for (kind, _), part in zip(slots, parts, strict=True):
                vectors[kind].append(part)
            for kind, atoms in plain.items():
                self.chunk(self._operation(kind, vectors[kind]), [((k, 1.0),) for k in atoms])

    def _operands(self, rows: list[Row]) -> str:
        """Return the values of `rows` as one vector: by one matrix, or new sums first and then all gathered."""
        fresh = dict.fromkeys(row for row in rows if row not in self.places)
        atoms = len({k for row in rows for k, _ in row})
        blocks, short = _blocks(fresh)
        products = sum(4 * NODE + len(full) * (ELEMENT + TIMES[self.dtype.itemsize] * m) * k for (k, m), full in blocks.items())
        staged = (4 * NODE + ELEMENT * (len(rows) + sum(map(len, short))) + products + min(2.0, self._dense_cost(atoms, len(fresh))))
        if fresh and self._dense_cost(atoms, len(rows)) < staged and not any(map(self._wild, rows)):
            return self._dense(rows)
        self.combine(rows)
        return self.gather(rows, (len(rows),))

    def _operation(self, kind: str, parts: list[str]) -> str:
        """Add the nodes of one operation and return the name of its result."""
        if kind in TESTS:
            truth = self.node(TESTS[kind], [parts[0], self.constant(0.0)])
            return str(self.node("Cast", [truth], to=self.onnx.helper.np_dtype_to_tensor_dtype(self.dtype)))
        if kind == "where":
            truth = self.node("Greater", [parts[0], self.constant(0.5)])
            return str(self.node("Where", [truth, *parts[1:]]))
        return str(self.node(OPS[kind], parts))


def onnx_model(program: Program, inputs: dict[str, tuple[int, ...]], outputs: dict[str, NDArray[np.object_]], dtype: Any, opset: int,
               metadata: dict[str, str]) -> Any:
    """Return the ONNX model of a program; `inputs` {name: shape} in the order of its inputs, `outputs` {name: expressions}.

    Inputs on which no output depends are left out. The file format is that of opset `opset`; numbers have the type `dtype`.
    """
    graph = Graph(dtype, infinite_atoms(program))
    helper, number = graph.onnx.helper, 0
    kind = helper.np_dtype_to_tensor_dtype(graph.dtype)
    flat = [x for values in outputs.values() for x in values.ravel()]
    needed, declared = program.dependencies(flat), []
    graph.chunk(graph.constant([1.0]), [((None, 1.0),)])
    for name, shape in inputs.items():
        size = int(np.prod(shape))
        if needed & set(range(number, number + size)):
            declared.append(helper.make_tensor_value_info(name, kind, shape))
            vector = name if len(shape) == 1 else graph.node("Reshape", [name, graph.constant([size], np.int64)])
            graph.chunk(vector, [((k, 1.0),) for k in range(number, number + size)])
        number += size
    for kinds in rounds(program, flat):
        graph.round(program, kinds)
    graph.combine(row_of(x) for x in flat)
    for name, values in outputs.items():
        vector = graph.gather([row_of(x) for x in values.ravel()], (values.size,))
        graph.nodes.append(helper.make_node("Reshape", [vector, graph.constant(values.shape, np.int64)], [name]))
    made = helper.make_graph(graph.nodes, "step", declared, [helper.make_tensor_value_info(name, kind, values.shape)
                                                             for name, values in outputs.items()], list(graph.constants.values()))
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", opset)], producer_name="nnhydro", ir_version=10)
    helper.set_model_props(model, metadata)
    graph.onnx.checker.check_model(model)
    return model
