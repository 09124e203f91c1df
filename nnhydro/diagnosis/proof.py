"""The proof on recordings that took no part: errors before and after, and the residuals that remain.

Every unit is predicted by parameters fitted to all other units, baseline and findings alike; error = sum |tau - model| / sum |tau|. Values
that are each recording's own (a phase, an offset) are taken, block by block, from the other blocks of that recording.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.blocks import PARTS, parts_of
from nnhydro.diagnosis.instances import Key
from nnhydro.diagnosis.locate import Residual
from nnhydro.diagnosis.race import Race, columns_of, own_of
from nnhydro.diagnosis.table import Table
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Proof:
    """Errors on left-out units before and after, per finding left out, and the residuals of baseline and corrected model."""

    before: float
    after: float
    without: dict[Key, float]  # error with all findings but one, by its key
    residuals: list[Residual]
    remains: list[Residual]
    torque: float  # mean |tau| over joints and rows, N m


@final
@dataclass(frozen=True, eq=False)
class LeftOut:
    """A set's parameters: `theta` (units, q) each fitted to all other units, `own` (blocks, o) each from the other blocks of its unit."""

    theta: Array
    own: Array
    columns: list[int]
    own_columns: list[int]

    @staticmethod
    def of(race: Race, chosen: Sequence[Candidate]) -> "LeftOut":
        """Return the parameters of baseline and `chosen`."""
        columns, own = columns_of(chosen), own_of(chosen)
        take, beside = race.bench.index(columns), race.bench.p + own
        theta = race.bench.left_out(take, beside)[1]
        values = race.bench.own_values(take, beside, theta) if len(own) else np.zeros((len(race.bench.blocks.n), 0))
        return LeftOut(theta, values, columns.tolist(), own.tolist())

    def predicted(self, Y: Array, X: Array, where: dict[int, int], unit: int, blocks: range) -> Array:
        """Return the torque (n, joints) of one piece whose blocks are `blocks`; `where` tells which of X (n, joints, K) a column is."""
        p = Y.shape[2]
        tau: Array = Y @ self.theta[unit, :p] + X[..., [where[k] for k in self.columns]] @ self.theta[unit, p:]
        if self.own_columns:
            own = X[..., [where[k] for k in self.own_columns]]
            for block, part in zip(blocks, parts_of(len(Y), PARTS if len(blocks) > 1 else 1), strict=True):
                tau[part] += own[part] @ self.own[block]
        return tau


def prove(race: Race, table: Table, believed: StripTheory) -> Proof:
    """Return errors on left-out units of the baseline, of the corrected model, and of it without each finding."""
    chosen = list(race.chosen)
    sets: dict[Key | str, LeftOut] = {"before": LeftOut.of(race, []), "after": LeftOut.of(race, chosen)}
    sets |= {c.key: LeftOut.of(race, [d for d in chosen if d is not c]) for c in chosen}
    where: dict[int, int] = {}
    for c in chosen:
        for k in sorted((*c.columns, *c.own)):
            where[k] = len(where)
    wrong, torque, rows, block, unit = dict.fromkeys(sets, 0.0), 0.0, 0, 0, race.bench.blocks.unit
    left: dict[str, list[Residual]] = {"before": [], "after": []}
    for piece, full in table.rows([c.instance for c in chosen], believed):
        p, count = piece.Y.shape[2], len(parts_of(len(piece.y), PARTS if piece.dt else 1))
        for name, one in sets.items():
            r = piece.y - one.predicted(piece.Y, full[..., p:-1], where, int(unit[block]), range(block, block + count))
            wrong[name] += float(np.abs(r).sum())
            if isinstance(name, str):
                left[name].append(Residual(table.case.all_units[piece.number].name, r, piece.state, piece.dt))
        block, torque, rows = block + count, torque + float(np.abs(piece.tau).sum()), rows + piece.y.size
    errors = {name: total / max(torque, 1e-300) for name, total in wrong.items()}
    return Proof(errors["before"], errors["after"], {name: e for name, e in errors.items() if isinstance(name, tuple)},
                 left["before"], left["after"], torque / max(rows, 1))
