"""The motion of the arm as tensors, row by row in time order: joint angles, rates and accelerations, the base and the water."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import final

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from nnhydro.physics.carried import StepMemory
from nnhydro.recordings.segment import Segment


def tensor(x: ArrayLike) -> Tensor:
    """Return `x` as a float64 tensor with memory of its own."""
    return torch.from_numpy(np.array(x, dtype=np.float64))


def _each_link(x: Tensor) -> Tensor:
    """One vector per row (n, 2) as one for all links (n, 1, 2); one per link (n, links, 2) as it is."""
    return x if x.dim() == 3 else x[:, None, :]


@final
@dataclass(frozen=True, eq=False)
class Water:
    """Water that moves, all along a link alike: a current, or the mean along each link of a wave. World axes X, Y."""

    velocity: Tensor  # (n, 2) m/s where it is the same for all links, else (n, links, 2)
    acceleration: Tensor  # (n, 2) or (n, links, 2) m/s^2, as the link meets it

    def __add__(self, other: "Water") -> "Water":
        """Return the water that moves as both do."""
        return Water(*(_each_link(x) + _each_link(y) for x, y in ((self.velocity, other.velocity),
                                                                  (self.acceleration, other.acceleration))))

    def at_links(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return v_X, v_Y and dv_X/dt, dv_Y/dt, each (n, 1) or (n, links)."""
        (vx, vy), (ax, ay) = (_each_link(x).unbind(-1) for x in (self.velocity, self.acceleration))
        return vx, vy, ax, ay

    @staticmethod
    def join(waters: Sequence["Water | None"], rows: Sequence[int]) -> "Water | None":
        """Return the rows of `waters`, one after the other; one that is not given rests in as many rows as `rows` says."""
        if not any(waters):
            return None
        still = [torch.zeros(n, 1, 2, dtype=torch.float64) for n in rows]
        both = [[zero if water is None else _each_link(getattr(water, name)) for water, zero in zip(waters, still, strict=True)]
                for name in ("velocity", "acceleration")]
        links = max(x.shape[1] for parts in both for x in parts)
        return Water(*(torch.cat([x.expand(-1, links, -1) for x in parts]) for parts in both))

    def rows(self, chosen: slice | Tensor) -> "Water":
        """Return the water in some rows."""
        return Water(self.velocity[chosen], self.acceleration[chosen])


@final
@dataclass(frozen=True, eq=False)
class Base:
    """What joint 1 sits on, where it does more than move along +Y (u0 of the motion): velocity along +X and heading, each (n,)."""

    vx: Tensor  # m/s
    ax: Tensor  # m/s^2
    heading: Tensor  # rad, added to q_1
    rate: Tensor  # rad/s
    acceleration: Tensor  # rad/s^2

    @staticmethod
    def join(bases: Sequence["Base | None"], rows: Sequence[int]) -> "Base | None":
        """Return the rows of `bases`, one after the other; one that is not given moves along +Y alone in as many rows as `rows` says."""
        if not any(bases):
            return None
        still = [torch.zeros(n, dtype=torch.float64) for n in rows]
        return Base(*(torch.cat([zero if base is None else getattr(base, field.name) for base, zero in zip(bases, still, strict=True)])
                      for field in fields(Base)))

    def rows(self, chosen: slice | Tensor) -> "Base":
        """Return the base in some rows."""
        return Base(*(getattr(self, field.name)[chosen] for field in fields(self)))


@final
@dataclass(frozen=True, eq=False)
class Motion:
    """n rows of motion of an arm with `links` joints; angles joint-relative, conventions.py for frames and signs.

    In a `steady` motion every row is a run of its own that has lasted long (no order in time, fully developed flow). `wake` is what the
    water behind each strip remembers at each row, where it is known already (a stretch of a run); without it, it follows from the rows.
    With `carried` every row is an arm of its own that is stepped through time, and all memories are what it carries from the instant
    before.
    """

    t: Tensor  # (n,) s
    q: Tensor  # (n, links) rad
    qd: Tensor  # (n, links) rad/s
    qdd: Tensor  # (n, links) rad/s^2
    u0: Tensor  # (n,) m/s
    du0: Tensor  # (n,) m/s^2
    steady: bool = False
    wake: Tensor | None = None  # (memories, n, links, strips) m/s, features/wake.py
    carried: StepMemory | None = None
    base: Base | None = None  # None: joint 1 moves along +Y alone
    current: Water | None = None  # the water's own motion, as it was measured; None: at rest

    def __len__(self) -> int:
        return len(self.t)

    @staticmethod
    def of(segment: Segment) -> "Motion":
        """Return the motion of a segment."""
        return Motion(tensor(segment.t), tensor(segment.q), tensor(segment.qd), tensor(segment.qdd), tensor(segment.u0),
                      tensor(segment.du0), segment.steady, base=_base_of(segment), current=_current_of(segment))

    @property
    def surrounded(self) -> bool:
        """Whether base or water move in a way that q, qd, qdd, u0, du0 do not hold."""
        return self.base is not None or self.current is not None

    def rows(self, chosen: slice | Tensor) -> "Motion":
        """Return some rows, in order."""
        return replace(self, t=self.t[chosen], q=self.q[chosen], qd=self.qd[chosen], qdd=self.qdd[chosen], u0=self.u0[chosen],
                       du0=self.du0[chosen], wake=None if self.wake is None else self.wake[:, chosen],
                       base=None if self.base is None else self.base.rows(chosen),
                       current=None if self.current is None else self.current.rows(chosen))

    @staticmethod
    def join(motions: Sequence["Motion"]) -> "Motion":
        """Return the rows of `motions`, one after the other: in time order no longer, and without what the water remembers."""
        def cat(name: str) -> Tensor:
            """Return a quantity of all rows."""
            return torch.cat([getattr(motion, name) for motion in motions])

        rows = [len(motion) for motion in motions]
        return Motion(cat("t"), cat("q"), cat("qd"), cat("qdd"), cat("u0"), cat("du0"), motions[0].steady,
                      base=Base.join([motion.base for motion in motions], rows),
                      current=Water.join([motion.current for motion in motions], rows))

    @staticmethod
    def at(q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, u0: ArrayLike = 0.0, du0: ArrayLike = 0.0) -> "Motion":
        """Return unrelated states, one per row (`steady`): q, qd, qdd (n, links), u0, du0 (n,) or scalars."""
        q_ = tensor(np.atleast_2d(np.asarray(q, dtype=float)))
        qd_, qdd_ = (tensor(np.broadcast_to(np.asarray(x, dtype=float), q_.shape)) for x in (qd, qdd))
        u0_, du0_ = (tensor(np.broadcast_to(np.asarray(x, dtype=float), q_.shape[:1])) for x in (u0, du0))
        return Motion(torch.arange(len(q_), dtype=torch.float64), q_, qd_, qdd_, u0_, du0_, steady=True)


def _base_of(segment: Segment) -> Base | None:
    """The motion of the base in a segment; None where it moves along +Y at most."""
    if segment.base is None and segment.heading is None:
        return None
    still = torch.zeros(len(segment), dtype=torch.float64)
    heading = still if segment.heading is None else tensor(segment.heading)
    if segment.base is None or segment.dbase is None:
        return Base(still, still, heading, still, still)
    (vx, rate), (ax, acceleration) = (tensor(x).unbind(-1) for x in (segment.base, segment.dbase))
    return Base(vx, ax, heading, rate, acceleration)


def _current_of(segment: Segment) -> Water | None:
    if segment.current is None or segment.dcurrent is None:
        return None
    return Water(tensor(segment.current), tensor(segment.dcurrent))


def trial_runs(links: int, rows: int = 60) -> list[Motion]:
    """Return two runs of `rows` instants with reversals: the arm from rest, and under a carriage that was moving before."""
    t = torch.linspace(0.0, 3.0, rows, dtype=torch.float64)
    w, a = torch.arange(1, links + 1) + 1.5, 0.8 / torch.arange(1, links + 1)
    phase = w * t[:, None]
    q, qd, qdd = a * (1 - torch.cos(phase)), a * w * torch.sin(phase), a * w**2 * torch.cos(phase)
    still = torch.zeros_like(t)
    return [Motion(t, q, qd, qdd, still, still), Motion(t, q, qd, qdd, 0.4 + 0.1 * torch.sin(2 * t), 0.2 * torch.cos(2 * t))]
