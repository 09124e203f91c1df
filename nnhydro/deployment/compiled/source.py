"""A program of scalars written out as Python statements, for whichever engine runs them.

    x9 = cos(x0 + x1)
    x10 = x2*x2
    ...

What the statements call (`cos`, `larger`, `chosen`, ...) is the engine's affair (engines.py); comparisons stand in the text where the
engine computes one number at a time, because a call costs Python more than the comparison.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, final

from nnhydro.deployment.onnx.expressions import Program, Scalar, Value

INLINE: Final[Mapping[str, str]] = {
    "mul": "{0}*{1}", "div": "{0}/{1}", "max": "{0} if {0} > {1} else {1}", "min": "{0} if {0} < {1} else {1}",
    "where": "{1} if {0} > 0.5 else {2}", "positive": "1.0 if {0} > 0.0 else 0.0", "zero": "1.0 if {0} == 0.0 else 0.0",
    "sign": "1.0 if {0} > 0.0 else (-1.0 if {0} < 0.0 else 0.0)"}
ARRAYS: Final[Mapping[str, str]] = {
    "mul": "{0}*{1}", "div": "{0}/{1}", "max": "larger({0}, {1})", "min": "smaller({0}, {1})", "where": "chosen({0} > 0.5, {1}, {2})",
    "positive": "1.0*({0} > 0.0)", "zero": "1.0*({0} == 0.0)", "sign": "sign({0})"}
FUNCTIONS: Final = ("abs", "sqrt", "exp", "log", "tanh", "sin", "cos", "tan", "atan", "asin", "acos", "floor", "ceil", "pow")


def _number(x: float) -> str:
    return f"float({str(x)!r})" if x != x or abs(x) == float("inf") else repr(x)


def _term(factor: float, name: str) -> str:
    return name if factor == 1.0 else f"-{name}" if factor == -1.0 else f"{_number(factor)}*{name}"


@final
@dataclass(frozen=True)
class Writer:
    """Writes `program` in the `forms` of an engine; `inputs` says how each input is read."""

    program: Program
    forms: Mapping[str, str]
    inputs: Sequence[str]

    def _sum(self, x: Value, named: Mapping[object, str]) -> str:
        """The text of a linear combination, in brackets where it is more than a name."""
        if not isinstance(x, Scalar):
            return _number(x)
        if x.key in named:
            return named[x.key]
        parts = [_term(c, f"x{k}") for k, c in sorted(x.terms.items())] + ([_number(x.bias)] if x.bias else [])
        return parts[0] if parts == ["x" + parts[0][1:]] else f"({' + '.join(parts)})"

    def _atom(self, k: int, named: Mapping[object, str]) -> str:
        """The source text of one operation of the traced program."""
        atom = self.program.atoms[k]
        operands = [self._sum(x, named) for x in atom.operands]
        if atom.kind in self.forms:
            return self.forms[atom.kind].format(*operands)
        if atom.kind in ("maxof", "minof"):
            text = operands[0]
            for operand in operands[1:]:
                text = f"({self.forms[atom.kind.removesuffix('of')].format(text, operand)})"
            return text
        if atom.kind == "sigmoid":
            return f"1.0/(1.0 + exp(-{operands[0]}))"
        return f"{atom.kind}({', '.join(operands)})"

    def _named_sums(self, needed: Sequence[int], outputs: Sequence[Value]) -> dict[object, Scalar]:
        """The sums that are worth a name of their own: used more than once, or repeated by the form they enter."""
        repeats = {kind: {i for i in range(3) if form.count(f"{{{i}}}") > 1} for kind, form in self.forms.items()}
        sums = {scalar.key: scalar for scalar in outputs if isinstance(scalar, Scalar)}
        uses = Counter(scalar.key for scalar in outputs if isinstance(scalar, Scalar))
        for k in needed:
            atom = self.program.atoms[k]
            for i, scalar in enumerate(atom.operands):
                if isinstance(scalar, Scalar):
                    sums[scalar.key] = scalar
                    uses[scalar.key] += 2 if i in repeats.get(atom.kind.removesuffix("of"), ()) or atom.kind in ("maxof", "minof") else 1
        single = {key for key, scalar in sums.items() if len(scalar.terms) == 1 and not scalar.bias and set(scalar.terms.values()) == {1.0}}
        return {key: x for key, x in sums.items() if uses[key] > 1 and key not in single}

    def statements(self, outputs: Sequence[Value]) -> tuple[list[str], list[str]]:
        """Return the statements, in an order in which they can be computed, and the text of each output."""
        needed = sorted(self.program.dependencies(list(outputs)))
        waiting, named, lines = self._named_sums(needed, outputs), dict[object, str](), list[str]()
        last = {key: max(scalar.terms) for key, scalar in waiting.items()}  # the atom after which a sum is known
        for k in needed:
            lines.append(f"x{k} = {self.inputs[k] if k < self.program.n_inputs else self._atom(k, named)}")
            for key in [key for key, at in last.items() if at == k]:
                lines.append(f"s{len(named)} = {self._sum(waiting[key], named)}")
                named[key] = f"s{len(named)}"
                del last[key]
        return lines, [self._sum(x, named) for x in outputs]
