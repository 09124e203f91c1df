"""The motion of the arm as tensors: joint angles, rates and accelerations, and the carriage, row by row in time order."""

from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from nnhydro.physics.carried import Carried
from nnhydro.recordings.segment import Segment


def tensor(x: ArrayLike) -> Tensor:
    """Return `x` as a float64 tensor with memory of its own."""
    return torch.from_numpy(np.array(x, dtype=np.float64))


@final
@dataclass(frozen=True, eq=False)
class Motion:
    """n rows of motion of an arm with `links` joints; angles joint-relative, conventions.py for frames and signs.

    In a `steady` motion every row is a run of its own that has lasted long (no order in time, fully developed flow). `wake` is what the
    water behind each strip remembers at each row, where it is known from elsewhere (a controller that steps through time, a question
    of the kind "what if the wake were empty"); without it, it follows from the rows. With `carried` every row is an arm of its own that
    is stepped through time, and all memories are what it carries from the instant before.
    """

    t: Tensor  # (n,) s
    q: Tensor  # (n, links) rad
    qd: Tensor  # (n, links) rad/s
    qdd: Tensor  # (n, links) rad/s^2
    u0: Tensor  # (n,) m/s
    du0: Tensor  # (n,) m/s^2
    steady: bool = False
    wake: Tensor | None = None  # (memories, n, links, strips) m/s, features/wake.py
    carried: Carried | None = None

    def __len__(self) -> int:
        return len(self.t)

    @staticmethod
    def of(segment: Segment) -> "Motion":
        """Return the motion of a segment."""
        return Motion(tensor(segment.t), tensor(segment.q), tensor(segment.qd), tensor(segment.qdd), tensor(segment.u0),
                      tensor(segment.du0), segment.steady)

    @staticmethod
    def at(q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, u0: ArrayLike = 0.0, du0: ArrayLike = 0.0) -> "Motion":
        """Return unrelated states, one a row (`steady`): q, qd, qdd (n, links), u0, du0 (n,) or scalars."""
        q_ = tensor(np.atleast_2d(np.asarray(q, dtype=float)))
        qd_, qdd_ = (tensor(np.broadcast_to(np.asarray(x, dtype=float), q_.shape)) for x in (qd, qdd))
        u0_, du0_ = (tensor(np.broadcast_to(np.asarray(x, dtype=float), q_.shape[:1])) for x in (u0, du0))
        return Motion(torch.arange(len(q_), dtype=torch.float64), q_, qd_, qdd_, u0_, du0_, steady=True)
