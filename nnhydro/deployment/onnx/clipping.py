"""Bounds in one operation instead of two: min(max(x, -h), h) = h clip(x/h), min(max(x, 0), h) = h unit(x/h).

clip holds its argument between -1 and 1, unit between 0 and 1; the factors enter the sums around them. Other pairs of bounds are left as
they are: shifted to the middle, a small x would lose its digits.
"""

import math
from collections.abc import Sequence

from nnhydro.deployment.onnx.expressions import Atom, Program, Scalar, Value, scale


def _bounds(program: Program, atom: Atom) -> tuple[str, float, Value] | None:
    """Kind, bound h and x of an atom that holds x between -h or 0 and h; None of any other atom."""
    inner, h = atom.operands if atom.kind == "min" else (0.0, 0.0)
    if not isinstance(inner, Scalar) or isinstance(h, Scalar) or inner.bias or list(inner.terms.values()) != [1.0] or not 0 < h < math.inf:
        return None
    below = program.atoms[next(iter(inner.terms))]
    if below.kind != "max" or not isinstance(below.operands[0], Scalar) or below.operands[1] not in (0.0, -h):
        return None
    return "unit" if below.operands[1] == 0 else "clip", h, below.operands[0]


def with_clips(program: Program, outputs: Sequence[Value]) -> tuple[Program, list[Value]]:
    """Return the same program with bounds in one operation where they can be; atoms keep their numbers."""
    factors: dict[int, float] = {}
    made = Program(program.n_inputs, program.whole)

    def of(x: Value) -> Value:
        if not isinstance(x, Scalar):
            return x
        return Scalar(x.bias, {k: c * factors.get(k, 1.0) for k, c in x.terms.items()})

    for number, atom in enumerate(program.atoms[program.n_inputs:], program.n_inputs):
        found = _bounds(program, atom)
        kind, operands = (atom.kind, tuple(map(of, atom.operands))) if found is None else (found[0], (scale(of(found[2]), 1 / found[1]),))
        if found is not None:
            factors[number] = found[1]
        made.atoms.append(Atom(kind, operands, 1 + max(map(made.level, operands))))
    return made, [of(x) for x in outputs]
