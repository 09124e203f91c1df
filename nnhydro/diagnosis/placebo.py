"""Placebo and whiteness: the same term on the wrong recordings must gain nothing, and what remains should look like noise.

    placebo    gain in left-out score of a finding whose columns are taken from other recordings
    whiteness  share of the lags 1 to 20 at which the remaining residual is correlated beyond the 95 % bound
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate, build
from nnhydro.diagnosis.locate import Residual
from nnhydro.diagnosis.race import Race
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.table import Piece, Table
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
SHUFFLES = 9
LAGS = 20


def _shuffled(table: Table, candidate: Candidate, believed: StripTheory, shift: int) -> dict[int, Array]:
    """The candidate's columns on every piece (by its id), taken from the piece `shift` further on, stretched to its length."""
    pieces = [piece for piece in table.pieces if piece.dt]
    made = {}
    for k, piece in enumerate(pieces):
        X = table.columns(pieces[(k + shift) % len(pieces)], [candidate.instance], believed)
        made[id(piece)] = X[np.linspace(0, len(X) - 1, len(piece.y)).round().astype(int)]
    return made


def placebo(race: Race, table: Table, believed: StripTheory, asked: Candidate) -> tuple[float, float]:
    """Return the gain of the chosen candidate `asked` in left-out score and the largest gain of its placebos."""
    others = [c.instance for c in race.chosen if c is not asked]
    gain = race.total(without=[asked]) - race.total()
    moving = sum(piece.dt > 0 for piece in table.pieces)
    plain = race.bench.p
    best = -np.inf
    for shift in range(1, min(SHUFFLES, moving - 1) + 1):
        wrong = _shuffled(table, asked, believed, shift)

        def beside(piece: Piece, wrong: dict[int, Array] = wrong) -> Array:
            return wrong[id(piece)] if id(piece) in wrong else np.zeros((*piece.y.shape, asked.instance.width))

        scores = []
        for extra in (None, beside):
            bank, blocks = build(table, others, believed, extra)
            prior = np.concatenate([race.bench.prior, np.zeros(blocks.p - plain)])
            scores.append(Race(bank, Bench.of(blocks, race.noise, prior), race.noise, list(bank.candidates)).total())
        best = max(best, scores[0] - scores[1])
    return gain, float(best)


def whiteness(remains: list[Residual], joint: int) -> float:
    """Return the share of lags at which the residual of `joint` (from 0) is correlated beyond the 95 % bound; 0.05 is what noise shows.

    The bound is Bartlett's with the correlations seen up to that lag, pooled over recordings; rows are those of the comparison.
    """
    sums, rows = np.zeros(LAGS + 1), 0
    for part in (part for part in remains if part.dt > 0 and len(part.r) > 2 * LAGS):
        x = part.r[:, joint] - part.r[:, joint].mean()
        sums += [float(x[: len(x) - k] @ x[k:]) for k in range(LAGS + 1)]
        rows += len(x)
    if not rows or sums[0] <= 0:
        return 0.0
    r = sums[1:] / sums[0]
    bound = 1.96 * np.sqrt((1 + 2 * np.concatenate([[0.0], np.cumsum(r[:-1] ** 2)])) / rows)
    return float((np.abs(r) > bound).mean())
