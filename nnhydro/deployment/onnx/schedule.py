"""When each atom of a program is computed: in as few rounds as it takes, with as few kinds of operation a round as possible.

A round computes all its atoms at once, one operation a kind. A kind whose atoms can all wait does wait, so that later they go together.
"""

from collections.abc import Mapping, Sequence

from nnhydro.deployment.onnx.expressions import Program, Scalar, Value


def _sources(program: Program, k: int) -> set[int]:
    return {j for operand in program.atoms[k].operands if isinstance(operand, Scalar) for j in operand.terms}


def _deadlines(program: Program, sources: Mapping[int, set[int]]) -> dict[int, int]:
    """Last round in which each atom may be computed without making the whole longer; `sources` of each, {atom: atoms}."""
    last = max((program.atoms[k].level for k in sources), default=0)
    found = dict.fromkeys(sources, last)
    for k in sorted(sources, reverse=True):
        for j in sources[k] & found.keys():
            found[j] = min(found[j], found[k] - 1)
    return found


def rounds(program: Program, outputs: Sequence[Value]) -> list[dict[str, list[int]]]:
    """Return the atoms of each round by kind; inputs stand in none."""
    waiting = sorted(k for k in program.dependencies(list(outputs)) if program.atoms[k].kind != "input")
    sources = {k: _sources(program, k) for k in waiting}
    deadline = _deadlines(program, sources)
    done = set(range(program.n_inputs))
    made: list[dict[str, list[int]]] = []
    while waiting:
        ready: dict[str, list[int]] = {}
        for k in waiting:
            if sources[k] <= done:
                ready.setdefault(program.atoms[k].kind, []).append(k)
        urgent = {kind: atoms for kind, atoms in ready.items() if any(deadline[k] <= len(made) + 1 for k in atoms)} or ready
        made.append(urgent)
        taken = {k for atoms in urgent.values() for k in atoms}
        done |= taken
        waiting = [k for k in waiting if k not in taken]
    return made
