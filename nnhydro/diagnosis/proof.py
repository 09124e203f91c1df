"""Proof on recordings that took no part: errors before and after, and the residuals that remain.

Every unit is predicted by parameters fitted to all other units, baseline and findings alike; error = sum |tau - model| / sum |tau|.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Bank, Case, effect_columns
from nnhydro.diagnosis.locate import Residual
from nnhydro.diagnosis.tournament import Candidate, Race
from nnhydro.identification.statistics import columns_and_offset
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Proof:
    """Errors on left-out units before and after, per finding left out, and the residuals of the baseline."""

    before: float
    after: float
    without: dict[tuple[str, int], float]  # error with all findings but one, by its key
    residuals: list[Residual]
    torque: float  # mean |tau| over joints and rows, N m


def _states(segment: Segment) -> dict[str, Array]:
    """State variables by their column name, for the region where the residual lies."""
    named: dict[str, Array] = {}
    for j in range(segment.n_links):
        named |= {f"q{j + 1}_rad": segment.q[:, j], f"dq{j + 1}_rad_s": segment.qd[:, j], f"ddq{j + 1}_rad_s2": segment.qdd[:, j]}
    if segment.u0.any():
        named["u0_m_s"] = segment.u0
    return named


def left_out_parameters(race: Race, chosen: Sequence[Candidate]) -> Array:
    """Return parameters (units, q) of baseline and `chosen`, each fitted to all other units."""
    columns = np.array(sorted({k for c in chosen for k in c.columns}), dtype=np.int64)
    take = race.bench.index(columns)
    H = race.bench.G[:, :, take[:, None], take[None, :]].sum(axis=1)
    g = race.bench.G[:, :, take, -1].sum(axis=1)
    penalty = np.concatenate([race.bench.prior, np.zeros(len(columns))]) + 1e-8 * np.diag(H.sum(axis=0)) + 1e-12
    A = H.sum(axis=0)[None] - H + np.diag(penalty)
    result: Array = np.linalg.solve(A, (g.sum(axis=0) - g)[..., None])[..., 0]
    return result


def prove(race: Race, bank: Bank, case: Case, believed: StripTheory) -> Proof:
    """Return errors on left-out units of the baseline, of the corrected model, and of it without each finding."""
    model, before = case.model, case.before
    sets: dict[tuple[str, int] | str, list[Candidate]] = {"before": [], "after": list(race.chosen)}
    sets |= {c.key: [d for d in race.chosen if d is not c] for c in race.chosen}
    thetas = {name: left_out_parameters(race, chosen) for name, chosen in sets.items()}
    order = sorted(race.chosen, key=lambda c: c.columns)
    effects = [bank.effects[bank.candidates.index(c)] for c in order]
    where = {k: i for i, k in enumerate(k for c in order for k in c.columns)}
    sums, torque, rows, residuals, number = dict.fromkeys(sets, 0.0), 0.0, 0, [], 0
    for unit in case.all_units:
        used = False
        for k, segment in enumerate(unit.segments()):
            if segment.tau is None or not segment.keep.any() or number >= len(thetas["before"]):
                continue
            used = True
            Y, c0 = columns_and_offset(model.loads, segment, model.arm)
            X = effect_columns(effects, believed, segment, case.places.get((unit.name, k)))
            y, keep = segment.tau - c0 - Y @ before.mean, segment.keep
            for name, chosen in sets.items():
                theta = thetas[name][number]
                mine = [where[c] for c in sorted(k for d in chosen for k in d.columns)]
                r = (y - (Y @ before.F) @ theta[: race.bench.p] - X[..., mine] @ theta[race.bench.p:])[keep]
                sums[name] += float(np.abs(r).sum())
                if name == "before":
                    states = {s: x[keep] for s, x in _states(segment).items()}
                    residuals.append(Residual(unit.name, r, states, 0.0 if segment.steady else segment.dt))
            torque += float(np.abs(segment.tau[keep]).sum())
            rows += int(keep.sum()) * segment.n_links
        number += used
    errors = {name: total / max(torque, 1e-300) for name, total in sums.items()}
    without = {name: error for name, error in errors.items() if isinstance(name, tuple)}
    return Proof(errors["before"], errors["after"], without, residuals, torque / max(rows, 1))
