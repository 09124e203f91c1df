"""The proof on recordings that took no part: errors before and after, and the residuals that remain.

Every unit is predicted by parameters fitted to all other units, baseline and findings alike; error = sum |tau - model| / sum |tau|. Values
that are each recording's own (a phase, an offset) are taken, block by block, from the other blocks of that recording. Where a campaign
holds more recordings than were studied, the errors are those of all the others, which no step of the search has seen. No prediction looks
at the torque that was measured.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate, build
from nnhydro.diagnosis.blocks import PARTS, parts_of
from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.instances import Key
from nnhydro.diagnosis.locate import Residual
from nnhydro.diagnosis.race import Race, columns_of, own_of
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.table import Table
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]
Name = Key | str


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
    recordings: int  # on which the errors were counted


@final
@dataclass(frozen=True, eq=False)
class LeftOut:
    """A set's parameters: `theta` (units, q) each fitted to all other units, `own` (blocks, o) each from the other blocks of its unit."""

    theta: Array
    own: Array
    columns: list[int]
    own_columns: list[int]

    @staticmethod
    def of(bench: Bench, chosen: Sequence[Candidate], theta: Array | None = None) -> "LeftOut":
        """Return the parameters of baseline and `chosen`; `theta` (q,) where they are given, as for units that no fit has seen."""
        columns, own = columns_of(chosen), own_of(chosen)
        take, beside = bench.index(columns), bench.p + own
        by_unit = bench.left_out(take, beside)[1] if theta is None else np.tile(theta, (len(bench.by_unit[1]), 1))
        values = bench.own_values(take, beside, by_unit) if len(own) else np.zeros((len(bench.blocks.n), 0))
        return LeftOut(by_unit, values, columns.tolist(), own.tolist())

    def predicted(self, Y: Array, X: Array, where: dict[int, int], unit: int, blocks: range) -> Array:
        """Return the torque (n, joints) of one piece whose blocks are `blocks`; `where` tells which of X (n, joints, K) a column is."""
        p = Y.shape[2]
        tau: Array = Y @ self.theta[unit, :p] + X[..., [where[k] for k in self.columns]] @ self.theta[unit, p:]
        if self.own_columns:
            own = X[..., [where[k] for k in self.own_columns]]
            for block, part in zip(blocks, parts_of(len(Y), PARTS if len(blocks) > 1 else 1), strict=True):
                tau[part] += own[part] @ self.own[block]
        return tau


@final
@dataclass(eq=False)
class Errors:
    """Sums over rows and joints: |tau - model| by set, |tau|, their number; residuals of the sets called "before" and "after"."""

    wrong: dict[Name, float] = field(default_factory=dict)
    torque: float = 0.0
    rows: int = 0
    units: set[str] = field(default_factory=set)
    left: dict[str, list[Residual]] = field(default_factory=lambda: {"before": [], "after": []})

    def add(self, table: Table, believed: StripTheory, chosen: Sequence[Candidate], bench: Bench, sets: Mapping[Name, LeftOut]) -> None:
        """Add all pieces of a table."""
        where: dict[int, int] = {}
        for c in chosen:
            for k in sorted((*c.columns, *c.own)):
                where[k] = len(where)
        block = 0
        for piece, full in table.rows([c.instance for c in chosen], believed):
            p, count = piece.Y.shape[2], len(parts_of(len(piece.y), PARTS if piece.dt else 1))
            name, unit = table.case.all_units[piece.number].name, int(bench.blocks.unit[block])
            for key, one in sets.items():
                r = piece.y - one.predicted(piece.Y, full[..., p:-1], where, unit, range(block, block + count))
                self.wrong[key] = self.wrong.get(key, 0.0) + float(np.abs(r).sum())
                if isinstance(key, str):
                    self.left[key].append(Residual(name, r, piece.state, piece.dt))
            self.units.add(name)
            block, self.torque, self.rows = block + count, self.torque + float(np.abs(piece.tau).sum()), self.rows + piece.y.size

    def proof(self) -> Proof:
        """Return the errors as a proof."""
        errors = {name: total / max(self.torque, 1e-300) for name, total in self.wrong.items()}
        return Proof(errors["before"], errors["after"], {name: e for name, e in errors.items() if isinstance(name, tuple)},
                     self.left["before"], self.left["after"], self.torque / max(self.rows, 1), len(self.units))


def _sets(race: Race) -> dict[Name, list[Candidate]]:
    """The sets whose errors are told: the baseline, all findings, and all but one."""
    return {"before": [], "after": race.kept()} | {c.key: race.kept(without=[c]) for c in race.chosen}


def prove(race: Race, table: Table, believed: StripTheory) -> Proof:
    """Return errors on left-out units of the baseline, of the corrected model, and of it without each finding."""
    errors = Errors()
    errors.add(table, believed, race.chosen, race.bench, {name: LeftOut.of(race.bench, kept) for name, kept in _sets(race).items()})
    return errors.proof()


def foretold(race: Race, case: Case, believed: StripTheory, proof: Proof) -> Proof:
    """Return `proof` with the errors of predictions, where a finding has looked at the measured torque; what remains is as it was."""
    if not any(c.instance.effect.reads_torque for c in race.chosen):
        return proof
    blind = prove(race, Table(case, foretold=True), believed)
    return replace(proof, after=blind.after, without=blind.without)


def prove_fresh(race: Race, believed: StripTheory, fresh: Iterable[Case], proof: Proof) -> Proof:
    """Return `proof` with the errors on the `fresh` recordings, of which the search has seen none; as it is where there are none."""
    chosen, errors = sorted(race.chosen, key=lambda c: min((*c.columns, *c.own))), Errors()  # columns of both banks in one order
    kept = _sets(race)
    fits = {name: race.bench.scored(columns_of(one), own_of(one)).theta for name, one in kept.items()}
    for case in fresh:
        table = Table(case, foretold=True)
        if not table.pieces:
            continue
        bank, blocks = build(table, [c.instance for c in chosen], believed)
        bench, here = Bench.of(blocks, race.noise, race.bench.prior), dict(zip((c.key for c in chosen), bank.candidates, strict=True))
        sets = {name: LeftOut.of(bench, [here[c.key].holding(c.held) for c in one], fits[name]) for name, one in kept.items()}
        errors.add(table, believed, bank.candidates, bench, sets)
        errors.left = {"before": [], "after": []}
    if not errors.rows:
        return proof
    seen = errors.proof()
    return replace(proof, before=seen.before, after=seen.after, without=seen.without, recordings=seen.recordings)
