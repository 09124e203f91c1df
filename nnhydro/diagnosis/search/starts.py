"""Laws that are tried beside those of the grids: instruments about other values, waves at the lines of the torque and across held links."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.effects.sensor_view import SensorView
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.physics.transmission import sensor_torque

HELD = 0.999  # length of the mean unit vector along a link whose angle scatters by less than 0.05 rad
LINES, LINES_GRID, PADDING = 4, 2000, 8  # lines that are tried; points of their grid; times as long as a block its padded transform


def extra_starts(hypotheses: Sequence[Hypothesis], problem: Problem, model: StripTheory) -> tuple[Hypothesis, ...]:
    """Return hypotheses linearised about the values from which an instrument's card wants to be tried, too, on the longest stretch."""
    moving = [s for s in problem.stretches if not s.segment.steady]
    if not moving:
        return ()
    longest = max(moving, key=lambda stretch: len(stretch.segment))
    flow = Flow(model.arm, Motion.of(longest.segment))
    view = SensorView(flow, lambda f: sensor_torque(model.loads.torque(f), f.motion.qd, model.arm))
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


def at_lines(hypotheses: Sequence[Hypothesis], frequencies: Sequence[float], headings: Sequence[float] = ()) -> tuple[Hypothesis, ...]:
    """Return the hypotheses that have a frequency of their own once more at each of `frequencies`, Hz, one of each other shape.

    What has a direction is tried in the directions `headings`, rad, too.
    """
    made: dict[tuple[Any, ...], Hypothesis] = {}
    for h in hypotheses:
        if "frequency" not in h.spans:
            continue
        for f in frequencies:
            line = h.with_nonlinear({"frequency": (f,)}, {"frequency": (0.99 * f, 1.01 * f)})
            turned = [line.with_nonlinear({"direction": (x,)}, {"direction": (x - np.pi / 4, x + np.pi / 4)}) for x in headings
                      if "direction" in h.spans]
            for new in (line, *turned):
                made.setdefault((h.key, *(getattr(new.effect, name) for name in h.spans)), new)
    return tuple(made.values())


def across_held_links(design: Design) -> tuple[float, ...]:
    """Return the direction, rad from +X, across each link that is held at one angle in all recordings."""
    phi = np.cumsum(np.concatenate([s.segment.q[s.segment.keep] for s in design.problem.stretches if not s.segment.steady] or
                                   [np.zeros((0, design.problem.arm.n_links))]), axis=1)
    mean = np.exp(1j * phi).mean(axis=0) if len(phi) else np.zeros(0)
    return tuple(float(np.angle(1j * direction)) for direction in mean if abs(direction) > HELD)
