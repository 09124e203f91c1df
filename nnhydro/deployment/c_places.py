"""Where in one vector the values of a program lie: a place is used again once nobody asks any more for what lies there.

Few places mean that values are still in the processor's first cache when they are read.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import final

from nnhydro.deployment.onnx.expressions import Program, Row, Value, row_of


def last_uses(program: Program, planned: Sequence[dict[str, list[int]]], outputs: Sequence[Value]) -> dict[Row, int]:
    """Return the last of the `planned` rounds that reads each value; the outputs are read after all of them."""
    last: dict[Row, int] = {}
    asked = [[row_of(x) for atoms in kinds.values() for k in atoms for x in program.atoms[k].operands] for kinds in planned]
    for number, rows in enumerate([*asked, [row_of(x) for x in outputs]]):
        for row in rows:
            last.update(dict.fromkeys((row, *(((k, 1.0),) for k, _ in row)), number))
    for kinds in reversed(planned):
        for k in kinds.get("same", []):  # lies where its operand lies
            operand = row_of(program.atoms[k].operands[0])
            last[operand] = max(last[operand], last.get(((k, 1.0),), 0))
    return last


@final
@dataclass
class Places:
    """The blocks of a vector that are in use, each until a round; `size` is how long the vector must be.

    Place 0 is never used again: compilers warn of a function that is given the vector and, to write to, the vector's beginning.
    """

    last: dict[Row, int]
    at: dict[Row, int] = field(default_factory=dict)
    now: int = 0
    size: int = 0
    free: list[tuple[int, int]] = field(default_factory=list)  # first place and length, in order
    used: list[tuple[int, int, int, list[Row]]] = field(default_factory=list)  # until which round, first place, length, what lies there

    def block(self, n: int, until: int, rows: Sequence[Row] = ()) -> int:
        """Return the first of `n` places side by side that are free, taken until the round `until` is over."""
        fits = next((i for i, (_, length) in enumerate(self.free) if length >= n), None)
        if fits is None:
            first, self.size = self.size, self.size + n
        else:
            first, length = self.free.pop(fits)
            if length > n:
                self.free.insert(fits, (first + n, length - n))
        self.used.append((until, first, n, list(rows)))
        return first

    def take(self, rows: Sequence[Row]) -> int:
        """Return the first of the places that `rows` get, until they are read for the last time."""
        fresh = [row for row in dict.fromkeys(rows) if row not in self.at]
        first = self.block(len(rows), max((self.last.get(row, self.now) for row in rows), default=self.now), fresh)
        for k, row in enumerate(rows):
            self.at.setdefault(row, first + k)
        return first

    def end_round(self) -> None:
        """Free what nobody reads any more."""
        over = [block for block in self.used if block[0] <= self.now]
        self.used = [block for block in self.used if block[0] > self.now]
        for row in (row for *_, rows in over for row in rows):
            del self.at[row]
        self.free = _join([*self.free, *((max(first, 1), n - (first == 0)) for _, first, n, _ in over)])
        self.now += 1


def _join(blocks: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the same places, neighbours as one."""
    found: list[tuple[int, int]] = []
    for first, n in sorted(blocks):
        if found and sum(found[-1]) == first:
            found[-1] = (found[-1][0], found[-1][1] + n)
        elif n:
            found.append((first, n))
    return found
