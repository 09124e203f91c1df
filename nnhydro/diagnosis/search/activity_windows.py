"""Parts of a campaign: does a member act in some recordings, from or until a time, or in a sector of angles only?

    y = ... + sum_m a_m mask_m (X_k beta_k),     a ~ N(1/2, 1)        m: recordings, or bins of a joint's angle

Where the amplitudes a_m fall into some near 1 and some near 0, the law with the mask of the former competes with the whole law by the same
score; a part is taken only where the rest of the campaign speaks against the law, not where it is silent. Order in time is known from
clocks alone.
"""

from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.problem.activity import ActivityWindow, Sector
from nnhydro.diagnosis.problem.design import columns_on
from nnhydro.diagnosis.problem.problem import Stretch
from nnhydro.diagnosis.search.library import Library, View
from nnhydro.diagnosis.search.stepwise import Scored, Search
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
BINS = 8  # of a joint's angle
CLEAR = 0.25  # amplitude, of the whole law's, below which a part is silent; above 1 less this it acts


@final
@dataclass(frozen=True, eq=False)
class Windowed:
    """The search in the grown library and the best set there."""

    search: Search
    best: Scored


def _amplitudes(search: Search, found: Scored, k: int, parts: Array) -> tuple[Array, Array]:
    """Return the amplitudes (m,) of the parts (n, joints, m) of member `k` beside the others, and their standard deviations."""
    from scipy.linalg import solve_triangular

    rest = search.score(tuple(x for x in found.chosen if x != k))
    view = search.view
    columns = view.joined(rest.chosen)
    Xw = view.whitened.weighted(parts)
    cross = view.whitened.cross(parts)
    if columns is not None:
        width = columns.Xw.shape[2]
        cross = np.concatenate([cross, columns.Xw.reshape(-1, width).T @ Xw.reshape(-1, parts.shape[2])])
    flat = Xw.reshape(-1, parts.shape[2])
    C = solve_triangular(rest.fit.chol, cross * rest.fit.scale[:, None], lower=True, check_finite=False)
    R = flat.T @ flat - C.T @ C + np.eye(parts.shape[2])
    c = flat.T @ view.whitened.y.ravel() - C.T @ rest.fit.half
    covariance = np.linalg.inv(R)
    return covariance @ (c + 0.5), np.sqrt(np.diag(covariance))


def _silent(a: Array, sd: Array) -> NDArray[np.bool_]:
    """Which parts are silent: near 0 and clearly not 1."""
    made: NDArray[np.bool_] = (a + 2 * sd < 1 - CLEAR) & (np.abs(a) < np.maximum(CLEAR, 2 * sd))
    return made


def _of_recordings(search: Search, found: Scored, k: int, u: Array) -> list[ActivityWindow]:
    problem = search.view.library.design.problem
    group = problem.group_of
    used = [g for g in range(problem.groups) if np.any(u[group == g])]
    if len(used) < 3 or len(used) > len(problem.names):
        return []
    parts = np.stack([u * (group == g)[:, None] for g in used], axis=2)
    a, sd = _amplitudes(search, found, k, parts)
    silent = _silent(a, sd)
    acting = (a - 2 * sd > 0) & ~silent
    if not silent.any() or not acting.any():
        return []
    names = [problem.names[g] for g in used]
    timed = all(s.place is not None for s in problem.stretches)
    places = [[float(s.place.mean()) for s in problem.stretches if s.group == g and s.place is not None] for g in used]
    order = np.argsort([np.mean(one) for one in places]) if timed else np.arange(len(used))
    ordered = [names[i] for i in order]
    made = [ActivityWindow(tuple(n for n, quiet in zip(names, silent, strict=True) if not quiet))]
    if timed:
        for cut in range(1, len(ordered)):
            made += [ActivityWindow(tuple(ordered[cut:]), since=True), ActivityWindow(tuple(ordered[:cut]), until=True)]
    return made


def _of_sectors(search: Search, found: Scored, k: int, beta: Array, model: StripTheory) -> list[ActivityWindow]:
    design = search.view.library.design
    problem, h = design.problem, search.view.library.hypotheses[k]
    made = []
    for joint in range(problem.arm.n_links):
        q = np.concatenate([s.segment.q[s.segment.keep, joint] for s in problem.stretches])
        edges = np.quantile(q, np.linspace(0, 1, BINS + 1))
        if not np.all(np.diff(edges) > 1e-3):
            continue
        edges[0], edges[-1] = -np.inf, np.inf

        def binned(stretch: Stretch, joint: int = joint, edges: Array = edges) -> Array:
            u = columns_on([h], model, stretch) @ beta
            at = np.searchsorted(edges, stretch.segment.q[:, joint], side="right") - 1
            return np.stack([u * (at == b)[:, None] for b in range(BINS)], axis=2)

        a, sd = _amplitudes(search, found, k, design.rows(binned))
        acting = ~_silent(a, sd)
        if acting.all() or not acting.any():
            continue
        first, last = int(np.flatnonzero(acting)[0]), int(np.flatnonzero(acting)[-1])
        low = float(edges[first]) if first else float(q.min())
        high = float(edges[last + 1]) if last < BINS - 1 else float(q.max())
        made.append(ActivityWindow(sector=Sector(joint + 1, low, high)))
    return made


def in_parts(search: Search, found: Scored, model: StripTheory) -> Windowed:
    """Return `found` with members confined to the part of the campaign in which they act, where the rest speaks against them.

    Laws of which a part cannot be predicted (gaps, clippings) are not asked: where they are silent they may only be late.
    """
    for k in found.chosen:
        library = search.view.library
        h = library.hypotheses[k]
        if h.per_recording or h.activity is not None or h.effect.offset_of_its_own or h.effect.predictable_share < 1:
            continue
        at = found.places(search.view)[k]
        scaled = found.fit.mean[at]
        u = library.X[..., library.at(k)] @ scaled
        windows = _of_recordings(search, found, k, u) + _of_sectors(search, found, k, scaled * library.scale[library.at(k)], model)
        if not windows:
            continue
        more = Library.of(library.design, [replace(h, activity=w) for w in windows], model)
        first = len(library.hypotheses)
        view = View(search.whitened, library.with_more(more, library.key_counts), before=search.view)
        following = Search(view, found.sizes, search.report)
        now = following.score(found.chosen)
        rest = tuple(x for x in found.chosen if x != k)
        best = max((following.score((*rest, first + i)) for i in range(len(windows))), key=lambda s: s.score)
        if best.score - np.log(len(windows)) > now.score + LEAST_GAIN:
            search, found = following, best
    return Windowed(search, found)

