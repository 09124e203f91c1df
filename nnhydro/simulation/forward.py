"""Forward dynamics under a controller: fixed steps of the classical Runge-Kutta method, torque held between controller instants.

    qdd = M^-1 (tau - h),  tau constant from one controller instant to the next

All motions are stepped side by side as one batch: the cost is that of the longest.
Source: Kutta (1901); the zero-order hold is that of a digital controller.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from torch import Tensor

from nnhydro.dynamics.inertia import runge_kutta_step
from nnhydro.errors import ConfigError, require
from nnhydro.physics.carried import Memory
from nnhydro.physics.motion import tensor
from nnhydro.physics.threads import one_thread
from nnhydro.simulation.motions.motion_kind import Reference, State
from nnhydro.simulation.plant import Plant
from nnhydro.simulation.run import MAX_ROWS, Run, grid
from nnhydro.simulation.torque_law import TorqueLaw

RUNAWAY = 1e3  # rad/s: no arm gets there


@final
@dataclass(frozen=True, eq=False)
class _Commands:
    """The references of m motions on the half-step grid, as tensors with time first."""

    q: Tensor  # (2 n - 1, m, joints)
    qd: Tensor
    qdd: Tensor
    u0: Tensor  # (2 n - 1, m)
    du0: Tensor

    @staticmethod
    def of(references: Mapping[str, Reference], t: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> "_Commands":
        states = [reference.at(np.minimum(t, reference.duration)) for reference in references.values()]
        return _Commands(*(torch.stack([tensor(state[k]) for state in states], dim=1) for k in range(5)))


def _step(plant: Plant, c: _Commands, row: int, h: float, q: Tensor, qd: Tensor, tau: Tensor,
          memory: Memory) -> tuple[Tensor, Tensor, Tensor]:
    """One Runge-Kutta step from row `row` of the half-step grid: q, qd after `h` s, and qdd at its beginning."""

    def acceleration(half: int, q: Tensor, qd: Tensor, _near: Tensor | None) -> Tensor:
        t = torch.full((len(q),), (row + half) * h / 2, dtype=torch.float64)
        return plant.acceleration(tau, t, q, qd, c.u0[row + half], c.du0[row + half], memory, half * h / 2)

    return runge_kutta_step(acceleration, q, qd, h)


def _require_tame(qd: Tensor, t: float, names: list[str]) -> None:
    if not bool((qd.abs() < RUNAWAY).all()):
        wild = names[int((~(qd.abs() < RUNAWAY)).any(dim=1).nonzero()[0])]
        raise ConfigError(f"motion {wild!r}: the arm runs away at t = {t:.3g} s: lower controller.kp and kd, or raise substeps and "
                          "controller.rate_hz")


@one_thread()
def run_controlled(references: Mapping[str, Reference], plant: Plant, law: TorqueLaw, rate_hz: float, hold: int) -> list[Run]:
    """Return one run a reference: `plant` under `law`, which acts every `hold` steps of 1/`rate_hz` s.

    Each begins in its reference's own state. Raises ConfigError where the arm has no inertia or runs away.
    """
    grids = {name: grid(reference, rate_hz) for name, reference in references.items()}
    n, h, names = max(len(t) for t in grids.values()), 1.0 / rate_hz, list(references)
    require(n * len(names) < MAX_ROWS, f"the {len(names)} motions under a controller take {n} steps each, too many: shorten them or lower "
            "sample_rate_hz or substeps")
    c = _Commands.of(references, np.arange(2 * n - 1) * h / 2)
    q, qd = c.q[0], c.qd[0]
    plant.require_inertia(torch.zeros(len(names), dtype=torch.float64), q, c.u0[0])
    memory, seen = plant.begin(q, qd, c.u0[0]), law.begin(q, qd)
    out = [torch.empty(n, *q.shape, dtype=torch.float64) for _ in range(4)]  # q, qd, qdd, tau
    tau = torch.zeros_like(q)
    for k in range(n):
        row = 2 * min(k, n - 2)  # the last instant takes its acceleration from a step that is not used
        if k % hold == 0:
            tau = law.torque(seen, (c.q[2 * k], c.qd[2 * k], c.qdd[2 * k]), q, qd, c.u0[2 * k], c.du0[2 * k])
        _require_tame(qd, k * h, names)
        after = _step(plant, c, row, h, q, qd, tau, memory)
        for series, value in zip(out, (q, qd, after[2], tau), strict=True):
            series[k] = value
        q, qd = after[0], after[1]
        memory = plant.following(memory, q, qd, c.u0[min(2 * k + 2, 2 * n - 2)], h)
    made = []
    for i, (name, t) in enumerate(grids.items()):
        q_i, qd_i, qdd_i, tau_i = (x[:len(t), i].numpy().copy() for x in out)
        speed, slope = (x[: 2 * len(t) : 2, i].numpy().copy() for x in (c.u0, c.du0))
        made.append(Run(name, rate_hz, State(q_i, qd_i, qdd_i, speed, slope), tau_i))
    return made
