"""A regular wave is a line: other frequencies explain less than half of what it explains.

What other laws leave may follow the motion at all its frequencies. An oscillation with a phase per recording then explains much
of it at any frequency. Two lines can be separated if they differ by two periods in a recording, as the peaks of a tapered spectrum are.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.search.best_fit import best_fit
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.wave_frequencies import LOWEST, durations, explained_energy

FREQUENCY = "frequency"
PERIODS = (-4.0, -3.0, -2.5, -2.0, 2.0, 2.5, 3.0, 4.0)  # periods per recording by which the other frequencies differ from a wave's


def share_elsewhere(search: Search, rest: ScoredSet, k: int) -> float:
    """Return the energy that the law of member `k` explains beside `rest` at another frequency, over that at its own, the largest share.

    It is 0 for a law without a frequency with a phase per recording.
    """
    design, mine = search.view.library.design, search.view.library.hypotheses[k]
    if not mine.per_recording or not (FREQUENCY in mine.spans or mine.lines):
        return 0.0
    others = [law for periods in PERIODS for law in _shift(mine, periods, durations(design), design.problem.edge)]
    energy = explained_energy(search, rest, [mine, *others], design.baseline.at(best_fit(search, rest).z)).sum(axis=1)
    return float(energy[1:].max(initial=0.0) / max(energy[0], 1e-300))


def _shift(law: Hypothesis, periods: float, seconds: Mapping[int, float], edge: float) -> list[Hypothesis]:
    """Return the law with each frequency shifted by `periods` in a recording of `seconds`; none outside the band up to `edge` Hz."""
    if law.lines:
        lines = {g: f + periods / seconds[g] for g, f in law.lines.items()}
        made, others = replace(law, lines=lines), list(lines.values())
    else:
        others = [getattr(law.effect, FREQUENCY)[0] + periods / float(np.median(list(seconds.values())))]
        made = law.with_nonlinear({FREQUENCY: tuple(others)}, {})
    return [made] if min(others) >= LOWEST and max(others) <= edge else []
