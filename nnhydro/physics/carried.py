"""What a model remembers from one instant to the next, where it is stepped through time instead of being given a whole run.

Every row is an arm of its own. A law with memory asks for its value by name: at the first instant it starts, later it follows from what
was remembered `dt` seconds ago, and where the memory is held it is taken as it is. All that is remembered depends on angles and rates,
never on accelerations: a mass matrix can be asked at a fixed memory.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import final

import torch
from torch import Tensor

Memory = Mapping[str, Tensor]  # by name, rows first


@final
@dataclass(frozen=True, eq=False)
class StepMemory:
    """`before` is what was remembered `dt` (n,) s ago (None at the first instant), `after` what is remembered now, filled on the way.

    `frozen`: `before` is that of this very instant and stays as it is. Rows that are `fresh` begin anew, whatever stands in `before`.
    """

    dt: Tensor  # (n,) s
    before: Memory | None = None
    frozen: bool = False
    fresh: Tensor | None = None  # (n,) bool
    after: dict[str, Tensor] = field(default_factory=dict)

    def value(self, name: str, start: Callable[[], Tensor], following: Callable[[Tensor], Tensor]) -> Tensor:
        """Return what is remembered now under `name`, rows first."""
        if self.before is None:
            found = start()
        else:
            found = self.before[name] if self.frozen else following(self.before[name])
            if self.fresh is not None:
                found = torch.where(self.fresh.reshape(-1, *(1,) * (found.dim() - 1)), start(), found)
        self.after[name] = found
        return found

    def steps(self, dimensions: int) -> Tensor:
        """Return dt (n, 1, ...) with as many axes as `dimensions`."""
        return self.dt.reshape(-1, *(1,) * (dimensions - 1))
