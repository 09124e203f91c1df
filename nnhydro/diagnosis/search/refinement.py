"""Finer values of what was found: half-way grid values of nonlinear parameters, instruments linearised about their values."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
import torch

from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.problem.hypothesis import Hypothesis, refine_grid
from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.stepwise import Scored, Search
from nnhydro.diagnosis.search.view import WeightedLibrary
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.effects.sensor_view import SensorView
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.physics.transmission import sensed

ROUNDS = 3
LINES, LINES_GRID, PADDING = 4, 2000, 8  # lines that are tried; points of their grid; times as long as a block its padded transform


@final
@dataclass(frozen=True, eq=False)
class Refined:
    """The search in the grown library and the best set there."""

    search: Search
    best: Scored


def scaled_values(view: WeightedLibrary, found: Scored, k: int) -> torch.Tensor:
    """Return the linear values (width,) of hypothesis `k` in its units, within physical bounds; the rms of recordings' own."""
    library = view.library
    at, h = found.places(view)[k], library.hypotheses[k]
    beta = found.fit.mean[at].reshape(-1, h.width)
    value = beta[0] if len(beta) == 1 else np.sqrt((beta**2).mean(axis=0))
    low, high = library.bounds(k)
    return torch.from_numpy(np.clip(value, low, high) * library.scale[library.at(k)])


def extra_starts(hypotheses: Sequence[Hypothesis], problem: Problem, model: StripTheory) -> tuple[Hypothesis, ...]:
    """Return hypotheses linearised about the values from which an instrument's card wants to be tried, too, on the longest stretch."""
    moving = [s for s in problem.stretches if not s.segment.steady]
    if not moving:
        return ()
    longest = max(moving, key=lambda stretch: len(stretch.segment))
    flow = Flow(model.arm, Motion.of(longest.segment))
    view = SensorView(flow, lambda f: sensed(model.loads.torque(f), f.motion.qd, model.arm))
    return tuple(replace(h, effect=start, working_model=model, rough=True) for h in hypotheses if isinstance(h.effect, InstrumentEffect)
                 for start in h.effect.starts(view))


def line_frequencies(design: Design) -> tuple[float, ...]:
    """Return the frequencies, Hz, of the strongest lines in what the baseline alone leaves, at the resolution of the longest stretches.

    Periodograms of all blocks, padded to one length and divided by their means, are summed; a wave of one frequency stands out in all.
    """
    from scipy.signal import find_peaks

    problem = design.problem
    total, grid = np.zeros(LINES_GRID), np.linspace(0.05, problem.edge, LINES_GRID)
    for i, block in enumerate(problem.blocks):
        stretch = problem.stretches[block.stretch]
        if block.steady:
            continue
        x = problem.inverse(block, design.excess[problem.block_of == i])
        padded = PADDING * len(x)
        power = (np.abs(np.fft.rfft((x - x.mean(axis=0)) * np.hanning(len(x))[:, None], padded, axis=0)) ** 2).sum(axis=1)
        total += np.interp(grid, np.fft.rfftfreq(padded, stretch.segment.dt), power / max(float(power.mean()), 1e-300))
    peaks = find_peaks(total)[0]
    return tuple(float(grid[k]) for k in sorted(peaks, key=lambda k: -total[k])[:LINES])


def at_lines(hypotheses: Sequence[Hypothesis], frequencies: Sequence[float]) -> tuple[Hypothesis, ...]:
    """Return the hypotheses that have a frequency of their own once more at each of `frequencies`, Hz, one of each other shape."""
    made: dict[tuple[Any, ...], Hypothesis] = {}
    for h in hypotheses:
        if "frequency" not in h.spans:
            continue
        for f in frequencies:
            shape = (h.key, f, *(getattr(h.effect, name) for name in h.spans if name != "frequency"))
            spans = {**h.spans, "frequency": (0.99 * f, 1.01 * f)}
            changes: dict[str, Any] = {"frequency": (f,)}
            made.setdefault(shape, replace(h, effect=replace(h.effect, **changes), spans=spans))
    return tuple(made.values())


def _finer(view: WeightedLibrary, found: Scored, k: int, model: StripTheory) -> list[Hypothesis]:
    h = view.library.hypotheses[k]
    made = [] if h.rough else list(refine_grid(h)[1:])
    if isinstance(h.effect, InstrumentEffect) and not h.per_recording:
        made.append(h.linearised_at(scaled_values(view, found, k), model))
    return made


def refined(search: Search, best: Scored, model: StripTheory, rounds: int = ROUNDS) -> Refined:
    """Return the best set with finer values of its members, each round half-way between the values around the best."""
    for _ in range(rounds):
        view = search.view
        finer = {k: _finer(view, best, k, model) for k in best.chosen}
        if not any(finer.values()):
            break
        first = len(view.library.hypotheses)
        more = Library.of(view.library.design, [h for hs in finer.values() for h in hs], model)
        counts = view.library.key_counts
        grown = view.library.with_more(more, counts)
        following = Search(WeightedLibrary(view.whitened, grown, before=view), best.sizes, search.report)
        now = following.score(best.chosen)
        start = first
        for k, hs in finer.items():
            options = [tuple(sorted((set(now.chosen) - {k}) | {start + i})) for i in range(len(hs))]
            stays = [] if view.library.hypotheses[k].rough else [now]  # rough columns are for the screening alone
            now = max([*stays, *map(following.score, options)], key=lambda s: s.score)
            start += len(hs)
        improved = now.chosen != best.chosen
        search, best = following, now
        if not improved:
            break
    return Refined(search, best)



def with_finer_singles(search: Search, model: StripTheory, most: int = 1) -> Search:
    """Return the search with finer values of the laws that are best alone: what one law about zero leaves, others would be found for.

    What has a phase of its own in every recording is linear in it, and stays as it is.
    """
    for single in search.singles()[:most]:
        if not any(search.view.library.hypotheses[k].per_recording for k in single.chosen):
            search = refined(search, single, model).search
    return search
