"""Which laws act in some recordings: the gain of each law whose values are each recording's own, added over those in which it gains.

    gain_k = sum_g max(0, (b'(G + RHO^-2)^-1 b - log|RHO^2 G + I|) / 2),     G = X_kg'W X_kg,  b = X_kg'W r_g

r is what a set leaves without the unknown. A pump that runs in five recordings of fourteen moves the mean of all by little, and a wave
with an amplitude for each recording follows it. The baseline is shared by the recordings and takes little of the columns of one.
"""

from collections.abc import Iterator
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.model.sizes import without_unknown
from nnhydro.diagnosis.problem.hypothesis import Key
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import FITTED_EXACTLY, Search

Array = NDArray[np.float64]


def remainder_without_unknown(search: Search, found: ScoredSet) -> Array:
    """Return what the fit of a set without the unknown leaves of the torque, divided by the noise, (n, joints)."""
    whitened, columns = search.whitened, search.view.join(found.chosen)
    fit = without_unknown(whitened, columns)
    left: Array = whitened.y - whitened.Y @ fit.mean[: whitened.p]
    return left if columns is None else left - columns.Xw @ fit.mean[len(whitened.b):]


def _own_gains(X: Array, r: Array) -> Array:
    """Return the gain (laws,) of laws with the columns X (rows, laws, width) beside what is left, r (rows,), none below 0."""
    G, b = np.einsum("nla,nlb->lab", X, X, optimize=True), np.einsum("nla,n->la", X, r)
    M = RHO**2 * G + np.eye(X.shape[2])
    gain = 0.5 * (RHO**2 * (b * np.linalg.solve(M, b[..., None])[..., 0]).sum(axis=1) - np.linalg.slogdet(M)[1])
    made: Array = np.maximum(gain, 0.0)
    return made


def _alike(widths: Array) -> Iterator[tuple[int, int, int]]:
    """Neighbouring laws of one width: the first, one past the last, and the width."""
    start = 0
    for width, same in groupby(widths.tolist()):
        stop = start + len(list(same))
        yield start, stop, width
        start = stop


def gains_by_recording(search: Search, base: ScoredSet) -> Array:
    """Return what each shared law gains beside `base` where its values are each recording's own, (shared laws,)."""
    view, left, gained = search.view, remainder_without_unknown(search, base), []
    groups = [np.flatnonzero(view.whitened.group == g) for g in range(view.library.design.problem.groups)]
    for numbers, X in view.library.runs(view.shared):
        Xw, widths = view.whitened.weigh(X), np.array([view.library.hypotheses[k].width for k in numbers])
        ends = np.concatenate([[0], np.cumsum(widths)])
        for first, stop, width in _alike(widths):
            part = Xw[..., ends[first]:ends[stop]]
            gained.append(sum(_own_gains(part[rows].reshape(-1, stop - first, width), left[rows].ravel()) for rows in groups))
    return np.concatenate(gained) if gained else np.zeros(0)


def laws_of_some_recordings(search: Search, base: ScoredSet, most: int = FITTED_EXACTLY) -> list[int]:
    """Return the laws that gain most beside `base` with values of each recording's own, the best of a key."""
    gains, taken = gains_by_recording(search, base), search.occupied_places(base.chosen)
    best: dict[Key, int] = {}
    for i in np.argsort(-gains).tolist():
        k = int(search.view.shared[i])
        if gains[i] > 0 and search.place(k) not in taken and len(best) < most:
            best.setdefault(search.key(k), k)
    return list(best.values())
