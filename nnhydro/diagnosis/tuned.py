"""Does an effect with a phase of its own in every recording have a pitch of its own, or does any wave shave what another effect leaves?

With a phase for every recording a wave takes something of whatever is left, about as much at one pitch as at another. A true one
stands out:

    gain at the value found  >=  1.5 times the gain that a quarter of all values of its nonlinear parameters exceed
"""

from collections.abc import Sequence

import numpy as np

from nnhydro.diagnosis.bank import Candidate, build
from nnhydro.diagnosis.instances import Instance
from nnhydro.diagnosis.race import Race, gains
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.scout import AT_ONCE, MANY
from nnhydro.diagnosis.table import Table
from nnhydro.models.strip_theory import StripTheory

STANDS_OUT = 1.5
USUAL = 0.75  # quantile over the values on the card


def usual(race: Race, table: Table, believed: StripTheory, candidate: Candidate, known: Sequence[Instance]) -> float:
    """Return the gain that a quarter of the values on the card of `candidate` exceed, beside the other chosen ones."""
    beside = [c.instance for c in race.chosen if c is not candidate]
    many, found = [one for one in known if one.key == candidate.key], list[float]()
    for start in range(0, len(many), AT_ONCE):
        bank, blocks = build(table, [*beside, *many[start:start + AT_ONCE]], believed)
        others, tried = bank.candidates[: len(beside)], bank.candidates[len(beside):]
        there = Race(bank, Bench.of(blocks, race.noise, race.bench.prior), race.noise, list(others))
        found += [gain for gain, _ in gains(there, tried)]
    return float(np.quantile(found, USUAL)) if len(many) > MANY else 0.0


def drop_untuned(race: Race, table: Table, believed: StripTheory, known: Sequence[Instance]) -> None:
    """Take the chosen waves away, the weakest first, that gain hardly more than those of other pitch; `known` are all on the cards."""
    while waves := [c for c in race.chosen if c.instance.effect.own_in_every_recording]:
        excess = [race.loss(c) - STANDS_OUT * usual(race, table, believed, c, known) for c in waves]
        race.log += [f"{c.key[0]}: gains {more:.1f} more than a wave of any pitch would" for c, more in zip(waves, excess, strict=True)]
        if min(excess) >= 0:
            return
        race.chosen.remove(waves[int(np.argmin(excess))])
