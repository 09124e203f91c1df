"""Hypotheses with many values of their nonlinear parameters are tried alone first; only their best values enter the bank."""

from collections.abc import Callable, Sequence

from nnhydro.diagnosis.bank import build
from nnhydro.diagnosis.instances import Instance, Key
from nnhydro.diagnosis.locks import turns
from nnhydro.diagnosis.race import UNPHYSICAL, Race, gains
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.table import Table
from nnhydro.models.strip_theory import StripTheory

MANY = 8  # values: those with more are scouted
BEST = 4  # values of each that go on
BEST_TURNING = 2  # and of those that act in a part of the campaign
AT_ONCE = 24  # instances a pass: their Gram matrix stays small


def scouted(table: Table, many: Sequence[Instance], race: Race, believed: StripTheory,
            count: Callable[[Race], None] = lambda tried: None) -> tuple[Instance, ...]:
    """Return the best values of each key of `many` beside what `race` has chosen; `count` is shown every race in which some were tried."""
    scores: dict[Key, list[tuple[float, float, Instance]]] = {}
    beside = [c.instance for c in race.chosen]
    for piece in table.pieces:
        table.compute(piece, many, believed)
    for start in range(0, len(many), AT_ONCE):
        chunk = many[start:start + AT_ONCE]
        bank, blocks = build(table, [*beside, *chunk], believed)
        alone = Race(bank, Bench.of(blocks, race.noise, race.bench.prior), race.noise, list(bank.candidates[: len(beside)]))
        reach = turns(alone, range(int(blocks.unit.max()) + 1))
        for gain, candidate in gains(alone, bank.candidates[len(beside):]):
            if gain > -UNPHYSICAL / 2:
                turned = max((float(reach[k]) for k in candidate.columns), default=0.0)
                scores.setdefault(candidate.key, []).append((gain, turned, candidate.instance))
        count(alone)
    best = [one for found in scores.values() for one in (*sorted(found, key=lambda s: -s[0])[:BEST],
                                                         *sorted(found, key=lambda s: -s[1])[:BEST_TURNING])]
    return tuple({id(one): one for _, _, one in best}.values())
