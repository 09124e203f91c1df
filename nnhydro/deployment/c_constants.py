"""The constants of a C program as static arrays: weights, and places of what is read."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import NDArray


@final
@dataclass
class ConstantTables:
    """Collects static const arrays as C text, `tables`; `kinds` tells the C type of each by its name."""

    number: Callable[[float], str]  # how a number is written in C
    prefix: str  # of all names
    tables: list[str] = field(default_factory=list)
    kinds: dict[str, str] = field(default_factory=dict)
    _known: dict[tuple[str, bytes], str] = field(default_factory=dict)

    def table(self, values: Sequence[float] | NDArray[np.float64], whole: bool) -> str:
        """Return the name of a table of integers (`whole`) or reals; equal ones are kept once."""
        array = np.asarray(values, dtype=np.int64 if whole else np.float64).ravel()
        key = ("i" if whole else "r", array.tobytes())
        if key not in self._known:
            name = f"{self.prefix}{key[0]}{len(self._known)}"
            kind = "unsigned short" if whole and (not len(array) or array.max() < 65536) else "int" if whole else "real"
            text = ",".join(str(int(x)) if whole else self.number(float(x)) for x in array)
            self.tables.append(f"static const {kind} {name}[{len(array)}] = {{{text}}};")
            self._known[key], self.kinds[name] = name, kind
        return self._known[key]

    def weights(self, k: int, factors: Sequence[float], width: int, place: str) -> tuple[tuple[str, str], str]:
        """Return a loop's parameter for weights, with what is given for it, and a weight in the loop: of all, of a run, or of each `place`.

        Run r holds `width` of the `factors`; they are those of the loop's operand `k`.
        """
        if len(set(factors)) == 1:
            return (f"real c{k}", self.number(factors[0])), f"c{k}"
        by_run = width > 1 and all(len(set(factors[i:i + width])) == 1 for i in range(0, len(factors), width))
        table = self.table(factors[::width] if by_run else factors, False)
        return (f"const real *RESTRICT c{k}", table), f"c{k}[{'r' if by_run else place}]"
