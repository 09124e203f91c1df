"""What only one side of a choice needs, as the state in which a run begins: it is computed only where that side is chosen."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, final

from nnhydro.deployment.onnx.expressions import Program, Row, Value, row_of

WORTH: Final = 32  # atoms: a choice that saves fewer is not worth a branch


@final
@dataclass(frozen=True)
class Choice:
    """A condition, true above 1/2, and the atoms and sums that are needed only where it holds."""

    condition: Row
    atoms: frozenset[int] = frozenset()
    rows: frozenset[Row] = frozenset()


def _ancestors(program: Program, outputs: Iterable[Value], condition: Row | None = None) -> set[int]:
    """The atoms on which `outputs` depend where `condition` does not hold; None: whatever holds."""
    found: set[int] = set()
    waiting = [k for x in outputs for k, _ in row_of(x) if k is not None]
    while waiting:
        k = waiting.pop()
        if k not in found:
            found.add(k)
            atom = program.atoms[k]
            chosen = atom.operands[2:] if atom.kind == "where" and row_of(atom.operands[0]) == condition else atom.operands
            waiting += [j for x in chosen for j, _ in row_of(x) if j is not None]
    return found


def best_choice(program: Program, outputs: Sequence[Value]) -> Choice | None:
    """Return the condition on which most atoms hang and what is needed only where it holds; None where that is not worth a branch."""
    needed = _ancestors(program, outputs)
    chosen = [program.atoms[k].operands[0] for k in needed if program.atoms[k].kind == "where"]
    if not chosen:
        return None
    condition = Counter(map(row_of, chosen)).most_common(1)[0][0]
    atoms = needed - _ancestors(program, outputs, condition) - _ancestors(program, [x for x in chosen if row_of(x) == condition])
    always = {row_of(x) for k in needed - atoms for x in program.atoms[k].operands}.union(map(row_of, outputs))
    rows = {row_of(x) for k in atoms for x in program.atoms[k].operands} - always
    return Choice(condition, frozenset(atoms), frozenset(rows)) if len(atoms) >= WORTH else None
