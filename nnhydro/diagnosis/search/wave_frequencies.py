"""Waves at the lines of the torque: of one frequency in all recordings, or of another in each; across links that are held, too."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.linearisation import extend_library
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import GrownSearch, Search
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.filtering.periodogram import hann_power

Array = NDArray[np.float64]
FIXED = 0.999  # length of the mean unit vector along a link of fixed heading: its angle scatters by less than 0.05 rad
LINES, LINES_GRID, PADDING = 4, 2000, 8  # lines that are tried; frequencies of their grid; length of the zero-padded transform in blocks
LOWEST = 0.05  # Hz: lowest frequency of a line
ROUNDS, STEPS = 6, (-2.0, -1.0, 0.0, 1.0, 2.0)  # iterations of a line; its first steps in periods per recording


def _periodogram(design: Design, i: int, x: Array | None = None) -> tuple[Array, Array]:
    """Return frequencies (m,) Hz and the padded periodogram (m,), mean 1, of `x` (samples, c) in block `i`: what the baseline leaves."""
    problem, block = design.problem, design.problem.blocks[i]
    x = problem.inverse(block, design.excess[problem.block_of == i]) if x is None else x
    f, each = hann_power(x - x.mean(axis=0), problem.stretches[block.stretch].segment.dt, points=PADDING * len(x))
    power = each.sum(axis=1)
    density: Array = power / max(float(power.mean()), 1e-300)
    return f, density


def line_frequencies(design: Design) -> tuple[float, ...]:
    """Return the frequencies, Hz, of the strongest lines in what the baseline alone leaves, at the resolution of the longest stretches.

    The periodograms of all blocks are summed: a wave of one frequency stands out in all.
    """
    from scipy.signal import find_peaks

    grid = np.linspace(LOWEST, design.problem.edge, LINES_GRID)
    moving = [i for i, block in enumerate(design.problem.blocks) if not block.steady]
    total = sum((np.interp(grid, *_periodogram(design, i)) for i in moving), np.zeros(LINES_GRID))
    peaks = find_peaks(total)[0]
    return tuple(float(grid[k]) for k in sorted(peaks, key=lambda k: -total[k])[:LINES])


def _strongest(f: Array, power: Array, edge: float) -> tuple[float, float]:
    """Return the power and the frequency, Hz, of the strongest line below `edge`, at the vertex of the parabola through the logarithms."""
    inside = np.flatnonzero((f >= LOWEST) & (f < edge))[1:-1]
    if len(inside) == 0:
        return 0.0, 0.0
    k = int(inside[np.argmax(power[inside])])
    before, at, after = np.log(np.maximum(power[k - 1:k + 2], 1e-300))
    vertex = f[k] + (f[1] - f[0]) * float(np.clip((after - before) / max(2 * (2 * at - before - after), 1e-12), -0.5, 0.5))
    return float(power[k]), float(vertex)


def lines_per_recording(design: Design) -> dict[int, float]:
    """Return the frequency, Hz, of the strongest line of every recording by its number, of a wave that is another in each.

    None where the lines cannot be separated, or where that of most recordings is the strongest line of their own motion: what follows the
    motion is no wave.
    """
    problem, found, width = design.problem, dict[int, tuple[float, float, bool]](), 0.0
    for i, block in enumerate(problem.blocks):
        if block.steady:
            continue
        stretch, samples = problem.stretches[block.stretch], block.stop - block.start
        power, line = _strongest(*_periodogram(design, i), problem.edge)
        s = stretch.segment
        rates = np.column_stack([s.qd, s.u0])[block.start:block.stop]
        _, swing = _strongest(*_periodogram(design, i, rates), problem.edge)
        width = max(width, 1 / (s.dt * samples))
        follows = abs(line - swing) * s.dt * samples < 1
        if power > 0:
            found[stretch.group] = max(found.get(stretch.group, (0.0, 0.0, False)), (power * samples, line, follows))
    lines = {g: line for g, (_, line, _) in found.items()}
    most = 2 * sum(follows for _, _, follows in found.values()) > len(found)
    return lines if lines and not most and max(lines.values()) - min(lines.values()) > width else {}


def durations(design: Design) -> dict[int, float]:
    """Return how long each recording is, s, by its number."""
    stretches = design.problem.stretches
    return {g: sum(len(stretch.segment) * stretch.segment.dt for stretch in stretches if stretch.group == g)
            for g in range(design.problem.groups)}


def _in_directions(law: Hypothesis, headings: Sequence[float]) -> tuple[Hypothesis, ...]:
    """Return `law`, and where it has a direction also in the directions `headings`, rad, known to a quarter of a half turn."""
    turned = [law.with_nonlinear({"direction": (x,)}, {"direction": (x - np.pi / 4, x + np.pi / 4)}) for x in headings
              if "direction" in law.spans]
    return law, *turned


def at_lines(hypotheses: Sequence[Hypothesis], frequencies: Sequence[float], headings: Sequence[float] = ()) -> tuple[Hypothesis, ...]:
    """Return the hypotheses with a frequency and a phase of each recording once more at each of `frequencies`, Hz, one of each other shape.

    What has a direction is tried in the directions `headings`, rad, too.
    """
    made: dict[tuple[Any, ...], Hypothesis] = {}
    for hypothesis in hypotheses:
        if "frequency" not in hypothesis.spans or not hypothesis.per_recording:
            continue
        for f in frequencies:
            line = hypothesis.with_nonlinear({"frequency": (f,)}, {"frequency": (0.99 * f, 1.01 * f)})
            for new in _in_directions(line, headings):
                made.setdefault((hypothesis.key, *(getattr(new.effect, name) for name in hypothesis.spans)), new)
    return tuple(made.values())


def across_fixed_links(design: Design) -> tuple[float, ...]:
    """Return the direction, rad from +X, across each link that is held at one angle in all recordings."""
    moving = [stretch.segment for stretch in design.problem.stretches if not stretch.segment.steady]
    angles = [segment.q[segment.keep] for segment in moving] or [np.zeros((0, design.problem.arm.n_links))]
    phi = np.cumsum(np.concatenate(angles), axis=1)
    mean = np.exp(1j * phi).mean(axis=0) if len(phi) else np.zeros(0)
    return tuple(float(np.angle(1j * direction)) for direction in mean if abs(direction) > FIXED)


def at_lines_per_recording(hypotheses: Sequence[Hypothesis], design: Design, headings: Sequence[float] = ()) -> tuple[Hypothesis, ...]:
    """Return the hypotheses that have a frequency, and values, of each recording's own once more at the line of each, in all directions."""
    lines, duration = lines_per_recording(design), durations(design)
    if not lines:
        return ()
    log_tried = float(sum(np.log(max(design.problem.edge * duration[g], 1.0)) for g in lines))
    made: dict[tuple[Any, ...], Hypothesis] = {}
    for hypothesis in hypotheses:
        if "frequency" not in hypothesis.spans or not hypothesis.per_recording:
            continue
        spans = {name: span for name, span in hypothesis.spans.items() if name != "frequency"}
        mean: dict[str, Any] = {"frequency": (float(np.mean(list(lines.values()))),)}
        start = replace(hypothesis, effect=replace(hypothesis.effect, **mean), spans=spans, lines=lines, log_tried=log_tried)
        for new in _in_directions(start, headings):
            made.setdefault((hypothesis.key, *(getattr(new.effect, name) for name in spans)), new)
    return tuple(made.values())


def explained_energy(search: Search, rest: ScoredSet, laws: Sequence[Hypothesis], model: StripTheory) -> Array:
    """Return the energy (laws, groups) that each of `laws` explains of what the best fit of `rest` leaves in each recording.

    Beside the model errors in the noise of the evidence, small changes of a line hardly count: the sharp peak is that of the energy.
    """
    fit, design = best_fit(search, rest), search.view.library.design
    level = np.sqrt((fit.whitened.sw**2).mean(axis=0))  # a joint that has more noise counts less
    left, made = fit.residual / fit.whitened.sw * level, np.zeros((len(laws), design.problem.groups))
    X, ends = design.columns(laws, model) * level[:, None], np.cumsum([law.width for law in laws])[:-1]
    for g in range(design.problem.groups):
        rows = design.problem.group_of == g
        r = left[rows].ravel()
        for number, part in enumerate(np.split(X[rows].reshape(len(r), -1), ends, axis=1)):
            made[number, g] = float(r @ part @ np.linalg.lstsq(part, r)[0])
    return made


def lines_at_peak(search: Search, best: ScoredSet, model: StripTheory) -> GrownSearch:
    """Return `best` with the line f_g, Hz, of every recording g where its wave explains most of what the others leave.

        f_g = argmax_f r_g'X_g (X_g'X_g)^-1 X_g'r_g,     X_g columns of the wave at f, r_g what the best fit of the others leaves
    """
    design = search.view.library.design
    duration = durations(design)
    for k in best.chosen:
        h = search.view.library.hypotheses[k]
        if not h.lines or h.values_by_recording:
            continue
        others = best.without(k)
        for number in range(ROUNDS):
            tried = [replace(h, lines={g: max(f + way / (duration[g] * 2**number), LOWEST) for g, f in h.lines.items()}) for way in STEPS]
            energy = explained_energy(search, search.score(others), tried, model)
            h = replace(h, lines={g: tried[int(np.argmax(energy[:, g]))].lines[g] for g in h.lines})
        start = len(search.view.library.hypotheses)
        search = extend_library(search, best, [h], model)
        finer = search.score((*others, start))
        best = finer if finer.score > search.score(best.chosen).score else search.score(best.chosen)
    return GrownSearch(search, best)
