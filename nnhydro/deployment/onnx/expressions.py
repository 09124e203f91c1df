"""A computation as scalars: linear combinations of atoms, each atom a product or a function of such combinations.

    value = bias + sum_k c_k atom_k,      atom = input | kind(value, ...)          kind: mul, div, abs, tanh, max, where, ...

Sums and constant factors never become atoms, equal atoms are made once and constants are folded: what is left is short, and fit to be
regrouped into a few large operations. Numbers without any atom are plain floats.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SPREADING: Final = ("same", "mul", "abs", "sqrt", "pow", "exp", "log", "max", "maxof", "floor", "ceil")  # infinite where an operand is
MANY: Final = 8  # terms: a longer sum is kept before it is multiplied by a number, where sums are kept at all


@final
class Scalar:
    """bias + sum of coefficient times atom; `terms` maps atom numbers to coefficients and is never changed."""

    __slots__ = ("bias", "key", "terms")

    def __init__(self, bias: float, terms: dict[int, float]) -> None:
        self.bias, self.terms = bias, terms
        self.key: tuple[Any, ...] = (bias, *sorted(terms.items()))


Value = float | Scalar
Key = tuple[Any, ...]
Row = tuple[tuple[int | None, float], ...]  # atoms and their coefficients; None: the constant 1


def row_of(x: Value) -> Row:
    """Return the terms of a linear combination, its constant included."""
    if not isinstance(x, Scalar):
        return ((None, float(x)),)
    return ((None, x.bias), *x.key[1:]) if x.bias else x.key[1:]


@final
@dataclass(frozen=True)
class Atom:
    """One product or function; `level` is 0 for inputs, else one more than the highest level it needs."""

    kind: str
    operands: tuple[Value, ...]
    level: int


def _terms(x: Value) -> dict[int, float]:
    return x.terms if isinstance(x, Scalar) else {}


def _bias(x: Value) -> float:
    return x.bias if isinstance(x, Scalar) else x


def scale(x: Value, factor: float) -> Value:
    """Return factor x."""
    if not isinstance(x, Scalar):
        return x * factor
    return 0.0 if factor == 0 else x if factor == 1 else Scalar(x.bias * factor, {k: c * factor for k, c in x.terms.items()})


def combine(parts: list[tuple[float, Value]]) -> Value:
    """Return the sum of factor times value."""
    bias, terms = 0.0, dict[int, float]()
    for factor, x in parts:
        if factor == 0.0:
            continue
        bias += factor * _bias(x)
        for k, c in _terms(x).items():
            terms[k] = terms.get(k, 0.0) + factor * c
    terms = {k: c for k, c in terms.items() if c != 0.0}
    return Scalar(bias, terms) if terms else bias


def add(a: Value, b: Value) -> Value:
    """Return a + b."""
    return combine([(1.0, a), (1.0, b)])


def sub(a: Value, b: Value) -> Value:
    """Return a - b."""
    return combine([(1.0, a), (-1.0, b)])


FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    "same": lambda x: x, "clip": lambda x: np.clip(x, -1.0, 1.0), "unit": lambda x: np.clip(x, 0.0, 1.0),
    "mul": np.multiply, "div": np.divide, "max": np.maximum, "min": np.minimum, "pow": np.power,
    "maxof": lambda *x: np.max(np.stack(np.broadcast_arrays(*x)), axis=0),
    "minof": lambda *x: np.min(np.stack(np.broadcast_arrays(*x)), axis=0),
    "where": lambda c, a, b: np.where(np.asarray(c) > 0.5, a, b),
    "positive": lambda x: (np.asarray(x) > 0).astype(float), "zero": lambda x: (np.asarray(x) == 0).astype(float),
    "abs": np.abs, "sign": np.sign, "sqrt": np.sqrt, "exp": np.exp, "log": np.log, "tanh": np.tanh, "sin": np.sin, "cos": np.cos,
    "tan": np.tan, "atan": np.arctan, "asin": np.arcsin, "acos": np.arccos, "floor": np.floor, "ceil": np.ceil,
    "sigmoid": lambda x: 1 / (1 + np.exp(-np.asarray(x))),
}


@final
@dataclass
class Program:
    """Atoms in an order in which they can be computed; the first `n_inputs` are the inputs.

    A sum of `whole` terms or more is kept as one atom, `same`, where it enters another sum; 0: all sums of sums are written out.
    """

    n_inputs: int
    whole: int = 0
    atoms: list[Atom] = field(default_factory=list)
    _known: dict[Key, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.atoms = [Atom("input", (), 0) for _ in range(self.n_inputs)]

    def input(self, number: int) -> Scalar:
        """Return input `number`."""
        return Scalar(0.0, {number: 1.0})

    def level(self, x: Value) -> int:
        """Return the level at which `x` is known."""
        return max((self.atoms[k].level for k in _terms(x)), default=0)

    def apply(self, kind: str, *operands: Value) -> Value:
        """Return kind(operands) as a new atom, an old one, or a number where all operands are numbers."""
        if not any(isinstance(x, Scalar) for x in operands):
            with np.errstate(all="ignore"):
                return float(FUNCTIONS[kind](*operands))
        key = (kind, *(operand.key if isinstance(operand, Scalar) else operand for operand in operands))
        if key not in self._known:
            self._known[key] = len(self.atoms)
            self.atoms.append(Atom(kind, operands, 1 + max(self.level(x) for x in operands)))
        return Scalar(0.0, {self._known[key]: 1.0})

    def share(self, x: Value, least: int = 0) -> Value:
        """Return `x`, as one atom where it has `least` terms (default `whole`) or more and sums of sums are not written out."""
        return self.apply("same", x) if self.whole and isinstance(x, Scalar) and len(x.terms) >= (least or self.whole) else x

    def _unit(self, x: Scalar) -> tuple[float, Value]:
        """Factor and rest of a single atom with a factor; 1 and `x` of anything else."""
        if len(x.terms) != 1 or x.bias != 0:
            return 1.0, x
        ((k, c),) = x.terms.items()
        return c, Scalar(0.0, {k: 1.0})

    def _root(self, x: Scalar) -> Value | None:
        """The y of x = sqrt(y); None of anything else."""
        number = next(iter(x.terms))
        atom = self.atoms[number] if len(x.terms) == 1 and x.bias == 0 else None
        return atom.operands[0] if atom is not None and atom.kind == "sqrt" else None

    def mul(self, a: Value, b: Value) -> Value:
        """Return a b."""
        if not isinstance(a, Scalar):
            return scale(self.share(b, MANY), a)
        if not isinstance(b, Scalar):
            return scale(self.share(a, MANY), b)
        (ca, ua), (cb, ub) = self._unit(a), self._unit(b)
        assert isinstance(ua, Scalar)
        assert isinstance(ub, Scalar)
        first, second = sorted((ua, ub), key=lambda x: x.key)
        if first.key == second.key and (root := self._root(first)) is not None:
            return scale(root, ca * cb)
        return scale(self.apply("mul", first, second), ca * cb)

    def div(self, a: Value, b: Value) -> Value:
        """Return a / b."""
        if isinstance(b, Scalar):
            return self.apply("div", a, b)
        return scale(a, 1 / b) if b != 0 and math.isfinite(1 / b) else self.apply("div", a, b)

    def unary(self, kind: str, x: Value) -> Value:
        """Return kind(x); a constant factor is drawn out of an absolute value."""
        if kind == "abs" and isinstance(x, Scalar):
            c, unit = self._unit(x)
            return scale(self.apply("abs", unit), abs(c))
        return self.apply(kind, x)

    def power(self, x: Value, exponent: Value) -> Value:
        """Return x^exponent, small whole powers as products."""
        if isinstance(exponent, Scalar):
            return self.apply("exp", self.mul(exponent, self.apply("log", x)))
        if exponent == 0.5:
            return self.apply("sqrt", x)
        if exponent in (1.0, 2.0, 3.0, 4.0):
            square = self.mul(x, x) if exponent > 1 else x
            return {1.0: x, 2.0: square}.get(exponent) or self.mul(square, x if exponent == 3.0 else square)
        return self.apply("div", 1.0, x) if exponent == -1.0 else self.apply("pow", x, exponent)

    def where(self, condition: Value, a: Value, b: Value) -> Value:
        """Return a where `condition` is 1, b where it is 0."""
        if not isinstance(condition, Scalar):
            return a if condition > 0.5 else b
        same = a.key == b.key if isinstance(a, Scalar) and isinstance(b, Scalar) else a is b
        return a if same else self.apply("where", condition, a, b)

    def dependencies(self, outputs: list[Value]) -> set[int]:
        """Return the atoms on which `outputs` depend."""
        found: set[int] = set()
        waiting = [k for x in outputs for k in _terms(x)]
        while waiting:
            k = waiting.pop()
            if k not in found:
                found.add(k)
                waiting += [j for x in self.atoms[k].operands for j in _terms(x)]
        return found

    def evaluate(self, outputs: list[Value], inputs: Array) -> Array:
        """Return the outputs (n, outputs) for the inputs (n, n_inputs): a plain interpreter, for checks."""
        values: dict[int, Array] = {k: inputs[:, k] for k in range(self.n_inputs)}

        def of(x: Value) -> Array:
            return sum((c * values[k] for k, c in _terms(x).items()), start=np.full(len(inputs), _bias(x)))

        with np.errstate(all="ignore"):
            for k in sorted(self.dependencies(outputs) - set(range(self.n_inputs))):
                values[k] = FUNCTIONS[self.atoms[k].kind](*map(of, self.atoms[k].operands))
        return np.column_stack([of(x) for x in outputs])


def as_cells(values: Sequence[Any], shape: tuple[int, ...]) -> NDArray[np.object_]:
    """Return expressions as an array of objects."""
    out = np.empty(len(values), dtype=object)
    out[:] = values
    return out.reshape(shape)


def infinite_atoms(program: Program) -> set[int]:
    """Return the atoms that may be infinite: chosen by a `where` from a constant that is, and what is made of these.

    As the travel of a link that has moved for ever: they enter no matrix with zeros.
    """
    found: set[int] = set()

    def may_be(x: Value, least: float = -np.inf) -> bool:
        return any(c > least and (k in found or (k is None and np.isinf(c))) for k, c in row_of(x))

    for number, atom in enumerate(program.atoms):
        wild = [may_be(x, 0.0 if atom.kind == "exp" else -np.inf) for x in atom.operands]  # exp of minus infinity is 0
        if {"where": any(wild[1:]), "div": any(wild[:1]), "min": all(wild), "minof": all(wild)}.get(
                atom.kind, atom.kind in SPREADING and any(wild)):
            found.add(number)
    return found
