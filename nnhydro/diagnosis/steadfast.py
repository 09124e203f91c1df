"""A verdict must survive the cut-off moved by 30 % to either side: what appears at one filter alone is made by the filter.

The chosen effects are fitted again at the moved cut-offs, columns and torque through the same filter, and each is asked what it gains.
A wave whose pitch lies above the lower one is asked at the higher one only.
"""

from collections.abc import Sequence

import numpy as np

from nnhydro.diagnosis.bank import Candidate, build
from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.race import Race
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.table import Table
from nnhydro.models.strip_theory import StripTheory


def kept_shares(case: Case, race: Race, believed: StripTheory, chosen: Sequence[Candidate]) -> list[list[float]]:
    """Return for each of `chosen` the share of its gain in left-out score that it keeps at each moved cut-off."""
    here = {c.key: race.loss(c) for c in chosen}
    shares: list[list[float]] = [[] for _ in chosen]
    for moved in case.moved if chosen else ():
        bank, blocks = build(Table(moved), [c.instance for c in chosen], believed)
        noise = race.noise * float(np.sqrt(moved.passed_hz / case.passed_hz))
        there = Race(bank, Bench.of(blocks, noise, race.bench.prior), noise, list(bank.candidates))
        for share, c, one in zip(shares, chosen, bank.candidates, strict=True):
            share.append(there.loss(one) / max(here[c.key], 1e-12))
    return shares


def drop_made_by_filter(case: Case, race: Race, believed: StripTheory) -> None:
    """Take the chosen candidates away, the weakest first, that gain nothing at a moved cut-off."""
    while race.chosen:
        kept = kept_shares(case, race, believed, race.chosen)
        shares = [(max if c.instance.effect.own_in_every_recording else min)(share, default=1.0)
                  for c, share in zip(race.chosen, kept, strict=True)]
        race.log += [f"{c.key[0]} joint {c.key[1]}: keeps {share:.2f} of its gain with the cut-off moved"
                     for c, share in zip(race.chosen, shares, strict=True)]
        weakest = int(np.argmin(shares))
        if shares[weakest] > 0:
            return
        race.chosen.pop(weakest)
