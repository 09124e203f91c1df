"""The moment within a recording at which an effect begins or ends, and the sector of a joint's angles in which it acts: on single rows.

    moment   median of exp(sum of e over the rows after t / 6),      e = sum_j (r^2 - (r - x beta)^2) / 2 sigma_j^2
    sector   argmax_[a, b)  (sum x'r)' (sum x'x)^-1 (sum x'r) over rows with a <= q < b,  r and x less the refit of all else

Source: Page (1954), Biometrika 41, for the moment; the scan over sectors is ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import column
from nnhydro.diagnosis.instances import Instance
from nnhydro.diagnosis.locks import SOFT
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.spell import Sector
from nnhydro.diagnosis.table import Piece, Table
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
PARTS, NARROW = 60, 5  # quantiles of an angle between which sectors are tried, and how many of them the narrowest holds
LEAST_ROWS = 3  # of a recording before and after a moment in it


@final
@dataclass(frozen=True, eq=False)
class Rows:
    """One piece: columns x (n, joints, K) of candidates, r (n, joints) of what the fit without them leaves, both over the noise."""

    piece: Piece
    x: Array
    r: Array


def projected(table: Table, believed: StripTheory, tried: Sequence[Instance], others: Sequence[Instance], bench: Bench,
              noise: Array) -> list[Rows]:
    """Return the rows of all pieces with baseline and `others` taken out of torque and columns; `bench` holds [Y, others, tried]."""
    take = np.arange(bench.p + sum(o.width for o in others))
    mine = np.arange(len(take), len(take) + sum(o.width for o in tried))
    total = bench.total
    A = total[np.ix_(take, take)] + np.diag(bench.penalty(take))
    solved = np.linalg.solve(A, total[np.ix_(take, [*mine, total.shape[0] - 1])])
    made = []
    for piece, full in table.rows([*others, *tried], believed):
        left = full[..., [*mine, full.shape[2] - 1]] - full[..., take] @ solved
        made.append(Rows(piece, left[..., :-1] / noise[:, None], left[..., -1] / noise))
    return made


def left_by(table: Table, believed: StripTheory, tried: Instance, others: Sequence[Instance], theta: Array, noise: Array) -> list[Rows]:
    """Return the rows of all pieces less the baseline and `others` with the values `theta` (p + others,)."""
    made = []
    for piece, full in table.rows([*others, tried], believed):
        rest = full[..., -1] - full[..., :len(theta)] @ theta
        made.append(Rows(piece, full[..., len(theta):-1] / noise[:, None], rest / noise))
    return made


def moment(rows: Sequence[Rows], beta: Array, recordings: Sequence[str], begins: bool) -> tuple[float, float, str, float] | None:
    """Return (gain over none, place, recording, s) of the likely moment in the two `recordings` between which the spell begins or ends.

    None where the best lies between recordings, or too near to the end of one to be told from it.
    """
    near = sorted((one for one in rows if one.piece.recording in recordings and one.piece.place is not None),
                  key=lambda one: float(np.asarray(one.piece.place)[0]))
    if not near:
        return None
    change = [one.x @ beta for one in near]
    gained = np.concatenate([(one.r**2 - (one.r - c) ** 2).sum(axis=1) / 2 for one, c in zip(near, change, strict=True)])
    place, t = (np.concatenate([np.asarray(getattr(one.piece, name)) for one in near]) for name in ("place", "t"))
    names = np.concatenate([np.full(len(one.r), one.piece.recording) for one in near])
    passed = np.concatenate([[0.0], np.cumsum(gained)])
    size = passed[-1] - passed if begins else passed  # of a spell that begins, or ends, before row k
    ends = [0, *(np.flatnonzero(names[1:] != names[:-1]) + 1).tolist(), len(names)]
    likely = np.exp((size - size.max()) / SOFT)
    k = int(np.searchsorted(np.cumsum(likely) / likely.sum(), 0.5))  # the middle, where an arm at rest tells no moments apart
    if min(abs(k - end) for end in ends) < LEAST_ROWS:
        return None
    return (float(size.max() - size[ends].max()), float(place[k - 1] + place[k]) / 2, str(names[k]), float(t[k - 1] + t[k]) / 2)


def _scan(H: Array, g: Array) -> tuple[float, float, int, int]:
    """Return (gain, gain over the whole, first, one past the last) of the best run of parts; H (parts, w, w), g (parts, w)."""
    P, w = g.shape
    Hs, gs = np.zeros((P + 1, w, w)), np.zeros((P + 1, w))
    np.cumsum(H, axis=0, out=Hs[1:])
    np.cumsum(g, axis=0, out=gs[1:])
    a, b = np.triu_indices(P + 1, NARROW)
    ridge = (1e-6 * np.trace(Hs[-1]) / w + 1e-12) * np.eye(w)  # columns may be 0 throughout
    gg = gs[b] - gs[a]
    gains = 0.5 * (gg * np.linalg.solve(Hs[b] - Hs[a] + ridge, gg[..., None])[..., 0]).sum(axis=1)
    whole = float(gains[(a == 0) & (b == P)][0])
    best = int(np.argmax(gains))
    return float(gains[best]), float(gains[best]) - whole, int(a[best]), int(b[best])


def sector(rows: Sequence[Rows], joint: int, columns: NDArray[np.int64]) -> tuple[float, float, Sector] | None:
    """Return (gain, gain over acting everywhere, sector) of the angles of `joint` (from 1) to which `columns` of x are best confined."""
    q = np.concatenate([one.piece.state[column("q", joint)] for one in rows])
    edges = np.unique(np.quantile(q, np.linspace(0, 1, PARTS + 1)))
    if len(edges) < PARTS // 2:
        return None
    which, w = np.clip(np.searchsorted(edges, q, side="right") - 1, 0, len(edges) - 2), len(columns)
    x, r = np.concatenate([one.x[..., columns] for one in rows]), np.concatenate([one.r for one in rows])
    products = np.einsum("njk,njl->nkl", x, np.concatenate([x, r[..., None]], axis=2))
    sums = np.zeros((len(edges) - 1, w, w + 1))
    np.add.at(sums, which, products)
    gain, over, a, b = _scan(sums[..., :-1], sums[..., -1])
    low, high = (None if end in (0, len(edges) - 1) else float(edges[end]) for end in (a, b))
    return gain, over, Sector(joint, low, high)
