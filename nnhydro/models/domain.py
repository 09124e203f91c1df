"""What a model was trained on, and how far a new motion lies outside of it.

    x = (A_i, B_i, M_i, N_i, u_x,i of every link; sin, cos of the angles between links, and of phi_i where the arm has weight) / spread
    d(x) = distance to the nearest of POINTS rows of the training, drawn so that they lie as far apart as they can
    outside(x) = 1 - d_0 / d(x) where d > d_0, else 0                                            0 to 1, a row

d_0 is the distance that 99 of 100 rows of a recording keep to all other recordings: each is held out in turn, so that a new motion of the
same kind is inside. Source: nearest-neighbour novelty, from general knowledge; x are the dimensional inputs of Rivera (1995), section 3.1.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit
from nnhydro.recordings.surroundings import moving_surroundings

Array = NDArray[np.float64]
DOMAIN = "domain"
POINTS, ROWS, GROUPS = 200, 400, 12  # rows kept; rows of a recording looked at; recordings held out in turn
INSIDE = 0.99  # share of held-out rows that count as inside
DIGITS = 5


def inputs(motion: Motion, arm: Arm) -> Array:
    """Return the inputs x (n, k) of a motion before they are divided by their spread."""
    flow = Flow(arm, motion)
    parts = [flow.A, flow.B, flow.M, flow.N, flow.u_x, torch.sin(motion.q[:, 1:]), torch.cos(motion.q[:, 1:])]
    if arm.gravity_m_s2 > 0 and not arm.sliding:
        parts += [torch.sin(flow.phi), torch.cos(flow.phi)]
    return torch.cat(parts, dim=1).numpy()


def _nearest(x: Array, points: Array) -> Array:
    """Distance (n,) of each row to the nearest point."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points).query(x)[0], dtype=float)


def _spread_out(x: Array, count: int) -> Array:
    """`count` rows of `x` that lie as far apart as they can: each next one is the farthest from all before."""
    def square_distance(point: Array) -> Array:
        """Return |x - point|^2 (n,)."""
        away = x - point
        made: Array = np.einsum("nk,nk->n", away, away)
        return made

    chosen = [int(np.argmin(square_distance(x.mean(axis=0))))]
    far = square_distance(x[chosen[0]])
    while len(chosen) < min(count, len(x)) and far.max() > 0:
        chosen.append(int(np.argmax(far)))
        far = np.minimum(far, square_distance(x[chosen[-1]]))
    return x[chosen]


@final
@dataclass(frozen=True, eq=False)
class Domain:
    """The region of a training: points (m, k) in inputs over their spread (k,), the distance d_0 that still counts as inside.

    `surroundings` names what moved besides the joints and a base along +Y.
    """

    spread: Array
    points: Array
    reach: float
    surroundings: tuple[str, ...] = ()

    def outside(self, motion: Motion, arm: Arm) -> Array:
        """Return how far outside each row lies, (n,) from 0 to 1."""
        far = _nearest(inputs(motion, arm) / self.spread, self.points)
        result: Array = np.where(far > self.reach, 1 - self.reach / np.maximum(far, 1e-300), 0.0)
        return result

    def states(self, arm: Arm) -> Motion:
        """Return the points as states of `arm`: each gives the same inputs x, in water and on a carriage without acceleration of theirs."""
        n = arm.n_links
        x = self.points * self.spread
        A, B, M, N, u_x = (x[:, k * n:(k + 1) * n] for k in range(5))
        if arm.sliding:
            return Motion.at(np.zeros_like(B), B, N)
        sines, cosines = x[:, 5 * n:6 * n - 1], x[:, 6 * n - 1:7 * n - 2]
        first = np.arctan2(u_x[:, :1], B[:, :1])
        if arm.gravity_m_s2 > 0:
            first = np.arctan2(x[:, 7 * n - 2:7 * n - 1], x[:, 8 * n - 2:8 * n - 1])
        speed = B[:, 0] * np.cos(first[:, 0]) + u_x[:, 0] * np.sin(first[:, 0])
        qd, qdd = (np.diff(absolute, axis=1, prepend=0.0) for absolute in (A, M))
        return Motion.at(np.hstack([first, np.arctan2(sines, cosines)]), qd, qdd, speed)

    def document(self) -> dict[str, Any]:
        """Return the region as model files store it."""
        def round_to(x: Array) -> Any:
            return np.vectorize(lambda value: float(f"{value:.{DIGITS}g}"))(x).tolist()

        return {"spread": round_to(self.spread), "points": round_to(self.points), "reach": float(f"{self.reach:.{DIGITS}g}"),
                "surroundings": list(self.surroundings)}

    @staticmethod
    def parse(document: Any) -> "Domain | None":
        """Return the region that `document()` stored; None where there is none that fits together."""
        try:
            found = Domain(np.array(document["spread"], dtype=float), np.array(document["points"], dtype=float), float(document["reach"]),
                           tuple(map(str, document.get("surroundings", ()))))
        except (TypeError, KeyError, ValueError):
            return None
        return found if found.points.ndim == 2 and found.points.shape[1:] == found.spread.shape and len(found.points) else None


def _rows(segments: Iterable[Segment], arm: Arm) -> Array:
    """Inputs of some rows of a unit, evenly spread over it."""
    parts = [inputs(Motion.of(segment), arm)[segment.keep] for segment in segments if segment.keep.any()]
    x: Array = np.concatenate(parts) if parts else np.zeros((0, 1))
    some: Array = x[np.linspace(0, len(x) - 1, min(ROWS, len(x))).astype(int)]
    return some


def _held_out(groups: Sequence[Array]) -> Array:
    """Distances of the rows of each group to all other groups, each held out in turn."""
    chosen = groups[::max(1, -(-len(groups) // GROUPS))]
    found = []
    for group in chosen:
        others = np.concatenate([elsewhere for elsewhere in groups if elsewhere is not group])
        found.append(_nearest(group, _spread_out(others, POINTS)))
    distances: Array = np.concatenate(found)
    return distances


def domain_of(chosen: Iterable[Unit], arm: Arm) -> Domain | None:
    """Return the region that the units `chosen` cover; None where they hold no rows."""
    groups, surroundings = [], set[str]()
    for unit in chosen:
        segments = unit.segments()
        groups.append(_rows(segments, arm if unit.arm is None else unit.arm))
        surroundings |= moving_surroundings(segments)
    groups = [x for x in groups if len(x) > 1]
    if not groups:
        return None
    every = np.concatenate(groups)
    spread = np.maximum(every.std(axis=0), 1e-3 * np.maximum(np.abs(every).max(axis=0), 1e-6))
    groups = [x / spread for x in groups]
    if len(groups) == 1:
        groups = list(np.array_split(groups[0], 2))
    far = _held_out(groups)
    reach = max(float(np.quantile(far, INSIDE)), 1e-6)
    return Domain(spread, _spread_out(every / spread, POINTS), reach, tuple(sorted(surroundings)))
