"""Models whose torque at a row depends on that row alone: one kernel, traced from the model itself."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.deployment.compiled.engines import EngineColumns, numba_rows, numba_step, numpy_rows, step
from nnhydro.deployment.onnx.expressions import Program, Value
from nnhydro.deployment.onnx.tracing import trace
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion

Array = NDArray[np.float64]
SEED: Final = 0


def one_row(q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor) -> Motion:
    """Return one state as a motion of one row."""
    return Motion(torch.zeros(1, dtype=torch.float64), q[None], qd[None], qdd[None], u0, du0, steady=True)


def example(links: int, *more: int) -> list[Tensor]:
    """Return inputs to trace at: a state in motion, then `more` vectors."""
    random = torch.Generator().manual_seed(SEED)
    return [torch.randn(size, dtype=torch.float64, generator=random) for size in (links, links, links, 1, 1, *more)]


def fields(links: int) -> list[EngineColumns]:
    """Return how the arrays of `flat` are read."""
    return [EngineColumns("q", links), EngineColumns("qd", links), EngineColumns("qdd", links), EngineColumns("u0", 1),
            EngineColumns("du0", 1)]


def flat(motion: Motion) -> list[Array]:
    """Return q, qd, qdd, u0, du0 as one-dimensional contiguous arrays."""
    tensors = (motion.q, motion.qd, motion.qdd, motion.u0, motion.du0)
    return [np.ascontiguousarray(x.detach().numpy(), dtype=np.float64).reshape(-1) for x in tensors]


@final
@dataclass(frozen=True, eq=False)
class Memoryless:
    """A model whose torque at a row depends on that row alone."""

    model: StripTheory
    engine: str

    @cached_property
    def program(self) -> tuple[Program, list[Value]]:
        """The model as scalars."""
        program, (tau,) = trace(lambda *state: (self.model.torque(one_row(*state))[0],), example(self.model.arm.n_links))
        return program, list(tau)

    @cached_property
    def _rows(self) -> Callable[..., None]:
        links = self.model.arm.n_links
        make = numba_rows if self.engine == "numba" else numpy_rows
        return make(*self.program, fields(links), EngineColumns("tau", links))

    def torque(self, motion: Motion) -> Array:
        """Return the sensor torques (n, joints) N m."""
        tau = np.empty(motion.q.shape)
        self._rows(len(motion), *flat(motion), tau.reshape(-1))
        return tau

    @cached_property
    def step(self) -> Callable[..., tuple[float, ...]]:
        """The torques of one state."""
        return (numba_step if self.engine == "numba" else step)(*self.program)
