"""Parts of a campaign: does a member act in some recordings, from or until a time, or in a sector of angles only?

    y = ... + sum_m a_m mask_m (X_k beta_k),     a ~ N(1/2, 1)        m: recordings, or bins of a joint's angle

The values beta_k of what comes and goes are those of the recordings in which it gains: a fit to all would make nothing of them.
Where the amplitudes a_m fall into some near 1 and some near 0, the law with the mask of the former competes with the whole law by the same
score, its prior shared between all parts of its kind; and it must leave the unknown at most LEAVES of what the whole law leaves. So a
part is taken only where the rest of the campaign speaks against the law, not where it is silent. Order in time is known from clocks alone.
A pump that runs in five recordings of fourteen moves the mean of all by little, and a wave with an amplitude for each recording follows it.
Laws are therefore also screened by what they gain with values per recording, over those in which they gain:

    gain_k = sum_g max(0, (b'(G + RHO^-2)^-1 b - log|RHO^2 G + I|) / 2),     G = X_kg'W X_kg,  b = X_kg'W r_g,  r what a set leaves

The baseline is shared by the recordings, and takes little of the columns of one.
Sectors are those of the joint at which an effect sits (a worn tooth, a tight spot): what acts on the whole arm, as weight, knows of none,
and neither does a sensor.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import DETECTED, RHO
from nnhydro.diagnosis.model.evidence import added_evidence
from nnhydro.diagnosis.model.sizes import without_unknown
from nnhydro.diagnosis.problem.activity import BINS, ActivityWindow, Sector
from nnhydro.diagnosis.problem.columns import columns_on
from nnhydro.diagnosis.problem.hypothesis import AnyEffect, Hypothesis, Key
from nnhydro.diagnosis.problem.problem import Stretch
from nnhydro.diagnosis.search.best_fit import remainder_without_unknown
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.linearisation import extend_library
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import FITTED_EXACTLY, GrownSearch, Search
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
IN_THE_DRIVE = 1  # stage of an instrument effect (effects/effect.py)
CLEAR = 0.25  # amplitude over that of the whole law, below which a part is silent; above 1 less this it acts


def _products(search: Search, found: ScoredSet, k: int, parts: Array) -> tuple[Array, Array]:
    """Return Gram matrix (m, m) and products with the torque (m,) of the parts (n, joints, m) of member `k` beside the others.

    The unknown is left out: it could take the place of any part.
    """
    view = search.view
    columns = view.join(found.without(k))
    fit = without_unknown(view.whitened, columns)
    Xw = view.whitened.weigh(parts)
    cross = view.whitened.cross(Xw)
    if columns is not None:
        width = columns.Xw.shape[2]
        cross = np.concatenate([cross, columns.Xw.reshape(-1, width).T @ Xw.reshape(-1, parts.shape[2])])
    flat = Xw.reshape(-1, parts.shape[2])
    C = fit.projection(cross)
    return flat.T @ flat - C.T @ C, flat.T @ view.whitened.y.ravel() - C.T @ fit.half


def _amplitudes(R: Array, c: Array) -> tuple[Array, Array]:
    """Return the amplitudes (m,) of parts with the products `R`, `c`, and their standard deviations."""
    covariance = np.linalg.inv(R + np.eye(len(R)))
    return covariance @ (c + 0.5), np.sqrt(np.diag(covariance))


def _best_run(R: Array, c: Array) -> tuple[int, int]:
    """Return the consecutive parts, first and one past the last, that one amplitude explains best: the largest (m'c)^2 / m'(R + 1)m."""
    runs = [(a, b) for a in range(len(c)) for b in range(a + 1, len(c) + 1)]
    return max(runs, key=lambda ab: c[ab[0]:ab[1]].sum() ** 2 / (R[ab[0]:ab[1], ab[0]:ab[1]].sum() + 1))


def _silent(a: Array, sd: Array) -> NDArray[np.bool_]:
    """Which parts are silent: near 0 and clearly not 1."""
    made: NDArray[np.bool_] = (a + 2 * sd < 1 - CLEAR) & (np.abs(a) < np.maximum(CLEAR, 2 * sd))
    return made


def _of_recordings(search: Search, found: ScoredSet, k: int, u: Array) -> list[ActivityWindow]:
    problem = search.view.library.design.problem
    group = problem.group_of
    used = [g for g in range(problem.groups) if np.any(u[group == g])]
    if len(used) < 3 or len(used) > len(problem.names):
        return []
    parts = np.stack([u * (group == g)[:, None] for g in used], axis=2)
    a, sd = _amplitudes(*_products(search, found, k, parts))
    silent = _silent(a, sd)
    acting = (a - 2 * sd > 0) & ~silent
    if not silent.any() or not acting.any():
        return []
    names = [problem.names[g] for g in used]
    timed = all(stretch.place is not None for stretch in problem.stretches)
    places = [[float(stretch.place.mean()) for stretch in problem.stretches if stretch.group == g and stretch.place is not None]
              for g in used]
    order = np.argsort([np.mean(times) for times in places]) if timed else np.arange(len(used))
    ordered = [names[i] for i in order]
    made = []
    for cut in range(1, len(ordered)) if timed else ():
        made += [ActivityWindow(tuple(ordered[cut:]), since=True), ActivityWindow(tuple(ordered[:cut]), until=True)]
    some = tuple(name for name, quiet in zip(names, silent, strict=True) if not quiet)
    return made if any(set(window.recordings) == set(some) for window in made) else [*made, ActivityWindow(some)]


def _knows_angles(effect: AnyEffect) -> bool:
    """Return whether a sector of its joint's angles may confine the effect: a load or a fault of the drive may, one of a sensor may not."""
    return effect.joint > 0 and (not isinstance(effect, InstrumentEffect) or effect.stage == IN_THE_DRIVE)


def _of_sectors(search: Search, found: ScoredSet, k: int, beta: Array, model: StripTheory) -> list[ActivityWindow]:
    design = search.view.library.design
    problem, h = design.problem, search.view.library.hypotheses[k]
    joint = h.effect.joint - 1
    if not _knows_angles(h.effect) or joint >= problem.arm.n_links:
        return []
    q = np.concatenate([stretch.segment.q[stretch.segment.keep, joint] for stretch in problem.stretches])
    edges = np.quantile(q, np.linspace(0, 1, BINS + 1))
    if not np.all(np.diff(edges) > 1e-3):
        return []
    edges[0], edges[-1] = -np.inf, np.inf

    def in_bins(stretch: Stretch) -> Array:
        """Return the law's torque (n, joints, bins) N m in each bin of the joint's angle."""
        u = columns_on([h], model, stretch) @ beta
        at = np.searchsorted(edges, stretch.segment.q[:, joint], side="right") - 1
        return np.stack([u * (at == b)[:, None] for b in range(BINS)], axis=2)

    first, stop = _best_run(*_products(search, found, k, design.rows(in_bins)))
    if stop - first == BINS:
        return []
    low = float(edges[first]) if first else float(q.min())
    high = float(edges[stop]) if stop < BINS else float(np.nextafter(q.max(), np.inf))
    return [ActivityWindow(sector=Sector(joint + 1, low, high))]


def _recording_gains(X: Array, r: Array) -> Array:
    """Return the gain (laws,) of laws with the columns X (rows, laws, width) beside what is left, r (rows,), none below 0."""
    G, b = np.einsum("nla,nlb->lab", X, X, optimize=True), np.einsum("nla,n->la", X, r)
    made: Array = np.maximum(added_evidence(RHO**2 * G + np.eye(X.shape[2]), b)[1], 0.0)
    return made


def _values_where_it_acts(search: Search, found: ScoredSet, k: int) -> Array:
    """Return the scaled values (width,) of member `k` in the recordings in which they gain: those of the whole campaign without any."""
    view = search.view
    beta: Array = without_unknown(view.whitened, view.join(found.chosen)).mean[found.places(view)[k]]
    X = view.columns(k).Xw
    r = remainder_without_unknown(search, found) + X @ beta
    G, b = np.zeros((len(beta), len(beta))), np.zeros(len(beta))
    for g in range(view.library.design.problem.groups):
        at = view.whitened.group == g
        x, left = X[at].reshape(-1, len(beta)), r[at].ravel()
        if _recording_gains(x[:, None], left)[0] > 0:
            G, b = G + x.T @ x, b + x.T @ left
    return np.asarray(np.linalg.solve(G + np.eye(len(b)) / RHO**2, b), dtype=float) if b.any() else beta


def _alike(widths: Array) -> Iterator[tuple[int, int, int]]:
    """Neighbouring laws of one width: the first, one past the last, and the width."""
    start = 0
    for width, same in groupby(widths.tolist()):
        stop = start + len(list(same))
        yield start, stop, width
        start = stop


def gains_by_recording(search: Search, base: ScoredSet) -> Array:
    """Return what each shared law gains beside `base` if it has values per recording, (shared laws,)."""
    view, left, gained = search.view, remainder_without_unknown(search, base), []
    groups = [np.flatnonzero(view.whitened.group == g) for g in range(view.library.design.problem.groups)]
    for numbers, X in view.library.runs(view.shared):
        Xw, widths = view.whitened.weigh(X), np.array([view.library.hypotheses[k].width for k in numbers])
        ends = np.concatenate([[0], np.cumsum(widths)])
        for first, stop, width in _alike(widths):
            part = Xw[..., ends[first]:ends[stop]]
            gained.append(sum(_recording_gains(part[rows].reshape(-1, stop - first, width), left[rows].ravel()) for rows in groups))
    return np.concatenate(gained) if gained else np.zeros(0)


def laws_of_some_recordings(search: Search, base: ScoredSet, found: ScoredSet, most: int = FITTED_EXACTLY,
                            varying: bool = False) -> list[int]:
    """Return the laws that gain most beside `base` with values per recording, the best of a key, and more than `found` gains.

    `varying`: only of what comes and goes on a sound machine, by its card, and if they gain DETECTED nats more.
    """
    view = search.view
    with_them, alone = (without_unknown(view.whitened, view.join(scored.chosen)).log_evidence for scored in (found, base))
    gains, taken = gains_by_recording(search, base), search.occupied_places(base.chosen)
    best: dict[Key, int] = {}
    for i in np.argsort(-gains).tolist():
        k = int(search.view.shared[i])
        fits = not varying or (view.library.hypotheses[k].effect.varies and gains[i] > with_them - alone + DETECTED)
        if fits and gains[i] > with_them - alone and search.place(k) not in taken and len(best) < most:
            best.setdefault(search.key(k), k)
    return list(best.values())


def _windows(search: Search, found: ScoredSet, k: int, model: StripTheory, sectors: bool) -> list[ActivityWindow]:
    """The parts of the campaign that the amplitudes of member `k` of `found` suggest; `sectors` of angles, too."""
    library = search.view.library
    at = library.at(k)
    scaled = found.fit.mean[found.places(search.view)[k]]
    comes_and_goes = library.hypotheses[k].effect.varies
    windows = _of_recordings(search, found, k, library.columns(k) @ (_values_where_it_acts(search, found, k) if comes_and_goes else scaled))
    return windows if not sectors else windows + _of_sectors(search, found, k, scaled * library.scale[at], model)


def _confine(library: Library, laws: Sequence[int], windows: Sequence[ActivityWindow], model: StripTheory) -> Library:
    """Return `library` with each of `laws` confined to each of `windows`; whole recordings need no new columns."""
    hypotheses, X = [], []
    problem = library.design.problem
    for window in windows:
        acts = np.isin(problem.group_of, [problem.names.index(name) for name in window.recordings])[:, None, None]
        for k in laws:
            h = replace(library.hypotheses[k], activity=window)
            if window.sector is not None and not (_knows_angles(h.effect) and window.sector.joint == h.effect.joint):
                continue
            hypotheses.append(h)
            X.append(library.columns(k) / np.maximum(library.scale[library.at(k)], 1e-300) * acts if window.sector is None
                     else library.design.columns([h], model))
    return library.with_more(Library.of_columns(library.design, hypotheses, np.concatenate(X, axis=2)), library.key_counts)


def _may_be_confined(h: Hypothesis) -> bool:
    return not (h.per_recording or h.activity is not None or h.effect.random_intercept or h.effect.predictable_share < 1)


def _whole(search: Search, found: ScoredSet, k: int) -> ScoredSet:
    """Return `found` with the law of member `k` in the whole campaign."""
    hypotheses = search.view.library.hypotheses
    h, rest = hypotheses[k], found.without(k)
    same = [i for i, other in enumerate(hypotheses)
            if other.activity is None and other.effect == h.effect and other.working_model is h.working_model]
    return search.score((*rest, *same[:1]))


def _with_whole_laws(search: Search, found: ScoredSet, model: StripTheory) -> tuple[Search, list[tuple[int, ScoredSet]]]:
    """Return the search with members confined to some recordings as laws of the whole campaign, too: these, and the set with each.

    Their values were refined where they act; about these, columns may say of a recording what those about none did not.
    """
    library = search.view.library
    confined = [k for k in found.chosen if (window := library.hypotheses[k].activity) is not None and window.sector is None]
    if not confined:
        return search, []
    start = len(library.hypotheses)
    whole = [replace(library.hypotheses[k], activity=None) for k in confined]
    following = extend_library(search, found, whole, model)
    return following, [(start + i, following.score((*found.without(k), start + i))) for i, k in enumerate(confined)]


def in_parts(search: Search, found: ScoredSet, model: StripTheory) -> GrownSearch:
    """Return `found` with laws confined to the part of the campaign in which they act, where the rest speaks against them.

    Members are tried. Where the unknown holds more than chance, so are the laws that gain most beside them and beside nothing. There, and
    where a member has values for each recording, so are `laws_of_some_recordings`, elsewhere those that come and go: what acts in few
    recordings passes for their noise. All others are tried for whole recordings only: a law of the angles passes for many others in a
    sector.
    Laws of which a part cannot be predicted (gaps, clippings) are not tried: where they are silent they may only be late.
    """
    search, whole_laws = _with_whole_laws(search, found, model)
    asked = {(k, found) for k in found.chosen} | set(whole_laws)
    shared = search.score([k for k in found.chosen if not search.view.library.hypotheses[k].per_recording])
    if found.unknown_nats > DETECTED:
        for base in {(), found.chosen}:
            asked |= {(k, search.score((*base, k))) for k in search.screen(base)}
    varying = found.unknown_nats <= DETECTED and shared.chosen == found.chosen
    asked |= {(k, search.score((*shared.chosen, k))) for k in laws_of_some_recordings(search, shared, found, varying=varying)}
    laws = sorted({k for k, _ in asked if _may_be_confined(search.view.library.hypotheses[k])})
    windows = dict.fromkeys(w for k, fitted in sorted(asked, key=lambda pair: (pair[1].chosen, pair[0])) if k in laws
                            for w in _windows(search, fitted, k, model, fitted is found))
    if not windows:
        return GrownSearch(search, found)
    grown = _confine(search.view.library, laws, tuple(windows), model)
    following = Search(WeightedLibrary(search.whitened, grown, before=search.view), found.sizes, search.report, search.settled)
    best = following.climb(following.score(found.chosen))
    for k in best.chosen:
        if following.view.library.hypotheses[k].activity is not None and k in best.chosen:
            whole = _whole(following, best, k)
            if not following.admits(whole, best):
                best = max(whole, following.score(best.without(k)), key=lambda scored: scored.score)
    return GrownSearch(following, best)
