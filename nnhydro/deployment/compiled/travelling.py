"""Models with coefficients over the travel: kinematics, then the strips with their memory, then all else and the way to the sensors.

First and last are kernels traced from the model; the strips are physics/travel/kernel.py. Blocks of rows pass through the three while they
lie in the cache. Needs numba.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, final

import numpy as np
from numpy.typing import NDArray
from torch import Tensor, stack

from nnhydro.deployment.compiled.engines import EngineColumns, Function, numba_rows
from nnhydro.deployment.compiled.memoryless import example, fields, flat, one_row
from nnhydro.deployment.compiled.travel_loads import TravelLoads
from nnhydro.deployment.onnx.tracing import trace
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion
from nnhydro.physics.transmission import sensor_torque
from nnhydro.physics.travel.term import TravelTerm

Array = NDArray[np.float64]
BLOCK: Final = 4096  # rows: 460 KiB for two links
KINEMATICS: Final = 5  # A, B, M, N, phi


@final
@dataclass(eq=False)
class Blocks:
    """The motion of a run block by block: `kinematics` (links, 5, 1 + rows) and `times`; column 0 is the row before the block."""

    motion: Motion
    kernel: Function
    kinematics: Array = field(init=False)
    times: Array = field(init=False)

    def __post_init__(self) -> None:
        self.links = self.motion.q.shape[1]
        self.t, self.flat = self.motion.t.numpy(), flat(self.motion)
        self.kinematics = np.empty((self.links, KINEMATICS, BLOCK + 1))
        self.times = np.empty(BLOCK + 1)

    def rows(self, start: int, stop: int) -> list[Array]:
        """Return the motion of some rows as the kernels take it."""
        return [x[start * width:stop * width] for x, width in zip(self.flat, (self.links, self.links, self.links, 1, 1), strict=True)]

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """Yield first row and end of each block once it is filled; before the first row stands that row itself."""
        for start in range(0, len(self.t), BLOCK):
            stop = min(start + BLOCK, len(self.t))
            count = stop - start
            self.kinematics[..., 0] = self.kinematics[..., BLOCK]
            self.kernel(count, *self.rows(start, stop), self.kinematics.reshape(-1)[1:])
            if start == 0:
                self.kinematics[..., 0] = self.kinematics[..., 1]
            self.times[0], self.times[1:count + 1] = self.t[max(start - 1, 0)], self.t[start:stop]
            yield start, stop


@final
@dataclass(frozen=True, eq=False)
class TravelKernels:
    """Kernels for `model`, some of whose terms are travel terms."""

    model: StripTheory

    @cached_property
    def _travel(self) -> TravelLoads:
        return TravelLoads(self.model.arm, [term for term in self.model.loads.terms.values() if isinstance(term, TravelTerm)])

    @cached_property
    def _kinematics(self) -> Function:
        """Kernel of A, B, M, N, phi of each link."""
        links = self.model.arm.n_links

        def flow(*state: Tensor) -> tuple[Tensor, ...]:
            f = Flow(self.model.arm, one_row(*state))
            return (stack([f.A[0], f.B[0], f.M[0], f.N[0], f.phi[0]], dim=1),)

        program, (made,) = trace(flow, example(links))
        return numba_rows(program, list(made.ravel()), fields(links), EngineColumns("made", made.size, BLOCK + 1))

    @cached_property
    def _rest(self) -> Function:
        """Kernel of the sensor torques, given force and moment of the travelling strips on each link."""
        arm = self.model.arm
        rest = Loads({name: term for name, term in self.model.loads.terms.items() if not isinstance(term, TravelTerm)})

        def torque(q: Tensor, qd: Tensor, qdd: Tensor, u0: Tensor, du0: Tensor, strips: Tensor) -> tuple[Tensor, ...]:
            """Return the torques (joints,) N m of one instant, the strips' forces N and moments N m being given."""
            flow = Flow(arm, one_row(q, qd, qdd, u0, du0))
            force, moment = strips[None, 0::2], strips[None, 1::2]
            return (sensor_torque(rest.torque(flow) + flow.normal_columns(force, moment).sum(-1), qd[None], arm)[0],)

        program, (tau,) = trace(torque, example(arm.n_links, 2 * arm.n_links))
        return numba_rows(program, list(tau), [*fields(arm.n_links), EngineColumns("strips", 2 * arm.n_links, BLOCK + 1)],
                          EngineColumns("tau", arm.n_links))

    def _memory(self, motion: Motion) -> Array:
        """What the strips remember in the first row (links, s, 7); their greatest speeds are looked up only where one moves in it."""
        from nnhydro.physics.travel.kernel import fastest

        blocks, x = Blocks(motion, self._kinematics), self._travel.x

        def peak() -> Array:
            """Return the largest normal speed of every strip over the whole run, m/s."""
            found = np.zeros(x.shape)
            for start, stop in blocks:
                fastest(blocks.kinematics[..., :stop - start + 1], x, found)
            return found

        next(iter(blocks), None)
        return self._travel.memory(blocks.t, blocks.kinematics[:, :1, 0] * x + blocks.kinematics[:, 1:2, 0], peak)

    def torque(self, motion: Motion) -> Array:
        """Return the sensor torques (n, joints) N m of one run in time order, or of steady rows."""
        from nnhydro.physics.travel.kernel import strip_loads

        tau = np.empty(motion.q.shape)
        if not len(motion):
            return tau
        travel, blocks, memory = self._travel, Blocks(motion, self._kinematics), self._memory(motion)
        strips = np.empty((self.model.arm.n_links, 2, BLOCK + 1))
        for start, stop in blocks:
            strip_loads(blocks.times[:stop - start + 1], blocks.kinematics, travel.x, self.model.arm.D, travel.constants, *travel.curves,
                        *travel.rule, motion.steady, memory, strips)
            self._rest(stop - start, *blocks.rows(start, stop), strips.reshape(-1)[1:], tau[start:stop].reshape(-1))
        return tau
