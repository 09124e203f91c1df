"""What a campaign can reveal: for each effect the smallest size that these motions and this noise would show, before anyone looks for it.

    visible share = ||S^-1/2 (I - P_Y) x|| / ||S^-1/2 x||,     size = lambda / ||S^-1/2 (I - P_Y) x||

P_Y projects off the baseline, whose parameters are held by their prior; lambda is the strength that opens the locks of the diagnosis four
times in five. Each linear parameter is taken alone; an amplitude whose phase is each recording's own is a mean over phases.
Source: power of a test by its noncentrality, Kay (1998), Fundamentals of Statistical Signal Processing II; the locks are those of `locks`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.case import Case, opened
from nnhydro.diagnosis.instances import Instance, instances
from nnhydro.diagnosis.locks import MISMATCH_TESTS, P_BLOCK, statistics
from nnhydro.diagnosis.naming import torque_peaks
from nnhydro.diagnosis.race import Race, price, race_of
from nnhydro.diagnosis.scout import AT_ONCE, MANY
from nnhydro.diagnosis.strength import Price, Where, smallest_own_strength, smallest_strength
from nnhydro.diagnosis.table import Table
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Reveal:
    """One parameter of one hypothesis: the smallest size that would be found, and what hides it."""

    instance: Instance
    parameter: str
    unit: str
    size: float | None  # None: no size within physical bounds would be found
    visible: float  # share of the torque that a refit of the baseline leaves
    strength: float | None  # lambda at that size
    shape: dict[str, float]  # nonlinear parameters at which the size holds
    direction: Array  # (width,) of the linear values, for a size of 1
    found_of: tuple[int, int]  # values of the nonlinear parameters at which some size is found, and all that were tried
    rival: str | None = None  # effect whose torque is most alike beside the baseline
    likeness: float = 0.0

    def document(self) -> dict[str, Any]:
        """Return the row for `nnhydro power --json`."""
        effect = self.instance.effect
        return {"effect": effect.id, "family": effect.family, "joint": effect.joint or None, "parameter": self.parameter,
                "unit": self.unit, "smallest_size": self.size, "visible_share": self.visible, "lambda": self.strength, "at": self.shape,
                "nearest": self.rival, "likeness": self.likeness}


@final
@dataclass(frozen=True, eq=False)
class Power:
    """What can be revealed, with the noise (joints,) N m and the number of recordings or groups of steady runs that say so."""

    case: Case
    noise: Array
    rows: list[Reveal]

    def document(self) -> dict[str, Any]:
        """Return what `nnhydro power --json` prints."""
        return {"schema": "nnhydro/power/1", "baseline": self.case.reference.name, "recordings": len(self.case.all_units),
                "noise_Nm": self.noise.tolist(), "chance": 0.8, "effects": [row.document() for row in self.rows]}


def visible_energies(race: Race) -> tuple[Array, Array]:
    """Return the energy (blocks, joints, K) that the baseline's refit leaves of each column, and the whole energy (K,), in noise units."""
    bench = race.bench
    take, every = np.arange(bench.p), np.arange(bench.p, bench.p + bench.blocks.K)
    A = bench.total[np.ix_(take, take)] + np.diag(bench.penalty(take))
    B = np.linalg.solve(A, bench.total[np.ix_(take, every)])
    G = bench.blocks.G
    cross = np.einsum("bjpk,pk->bjk", G[:, :, : bench.p, bench.p:-1], B)
    own = np.einsum("bjpq,pk,qk->bjk", G[:, :, : bench.p, : bench.p], B, B, optimize=True)
    whole = np.diagonal(G, axis1=2, axis2=3)[:, :, bench.p:-1]
    return np.maximum(whole - 2 * cross + own, 0.0), np.diag(bench.total)[every]


def correlation(table: Table) -> float:
    """Return the variance of sums of white noise behind the low-pass, at the rows that count, over that of independent rows.

        c = 1 / (2 B dt),   B = integral of the squared gain over frequency [Hz],   dt from row to row;   1 without a low-pass
    """
    factors, rows = [], []
    for piece in table.pieces:
        segment = table.case.all_units[piece.number].segments()[piece.k]
        factor = 1.0
        if segment.low_pass is not None and segment.low_pass.cutoff_hz * segment.dt < 0.45:  # else it passes everything
            f = np.linspace(0.0, 0.5 / segment.dt, 4000)
            factor = 1 / (2 * float(np.trapezoid(segment.low_pass.gain(f) ** 2, f)) * piece.dt)
        factors.append(factor)
        rows.append(len(piece.y))
    return max(1.0, float(np.average(factors, weights=rows)))


def _directions(candidate: Candidate) -> Iterator[tuple[str, str, list[int], Array]]:
    """(parameter, unit, columns, direction of size 1): every common parameter alone, or an amplitude over all own columns."""
    effect, start = candidate.instance.effect, min((*candidate.columns, *candidate.own))
    names, linear = effect.linear_names(), len(effect.linear_names())
    if candidate.own and not candidate.columns:
        even = torch.ones(linear, dtype=torch.float64)
        name, quantity = next(iter(effect.with_linear(even).quantities().items()))
        yield name, quantity.unit, list(candidate.own), even.numpy() / quantity.value
        return
    for k, (name, unit) in enumerate(zip(names, effect.linear_units(), strict=True)):
        yield name, unit, [start + k], np.eye(linear)[k]


def _within_bounds(candidate: Candidate, direction: Array, size: float) -> bool:
    bounds = candidate.instance.effect.linear_bounds()
    return any(all(low - 1e-12 <= v <= high + 1e-12 for v, (low, high) in zip(sign * size * direction, bounds, strict=True))
               for sign in (1.0, -1.0))


def _reveals(race: Race, threshold: float, correlated: float) -> Iterator[Reveal]:
    """One row for each parameter of each candidate of the race."""
    energies, whole = visible_energies(race)
    rows, unit = float(race.bench.blocks.n.sum()), race.bench.blocks.unit
    for c in race.bank.candidates:
        for name, unit_name, columns, direction in _directions(c):
            weights = direction**2 if len(columns) > 1 else np.ones(1)
            E, all_of_it = energies[:, :, columns] @ weights, float(whole[columns] @ weights)
            left, effect = float(E.sum()), c.instance.effect
            shape = {f: float(getattr(effect, f)[0]) for f in c.instance.spans}
            empty = Reveal(c.instance, name, unit_name, None, 0.0, None, shape, direction, (0, 1))
            if left <= 1e-9 * max(all_of_it, 1e-300):
                yield empty
                continue
            by_joint = E.sum(axis=0) / left
            where = Where(E.sum(axis=1) / left, unit, float(by_joint.max()), rows, correlated)
            needed = smallest_own_strength(where, len(c.own)) if c.own else \
                smallest_strength(where, Price(threshold, len(c.columns), price([c])))
            size = None if needed is None else needed / np.sqrt(left)
            possible = size is not None and _within_bounds(c, direction, size)
            yield replace(empty, size=size if possible else None, visible=float(np.sqrt(min(left / all_of_it, 1.0))),
                          strength=needed if possible else None, found_of=(int(possible), 1))


def _typical(rows: Sequence[Reveal]) -> Reveal:
    """The row of the middle size among the values of the nonlinear parameters that were tried."""
    order = sorted(rows, key=lambda r: np.inf if r.size is None else r.size)
    chosen = order[(sum(r.size is not None for r in rows) or len(rows)) // 2 if len(rows) > 1 else 0]
    if chosen.size is None and order[0].size is not None:
        chosen = order[0]
    return replace(chosen, found_of=(sum(r.size is not None for r in rows), len(rows)))


def _of_laws(rows: Sequence[Reveal]) -> Reveal:
    """The typical row of the law of the effect that is found at the smallest size: fewer values cost less."""
    laws: dict[int, list[Reveal]] = {}
    for row in rows:
        laws.setdefault(row.instance.width, []).append(row)
    return min((_typical(one) for one in laws.values()), key=lambda r: np.inf if r.size is None else r.size)


def _with_rivals(race: Race, rows: Sequence[Reveal]) -> list[Reveal]:
    """The rows with the effect whose columns come nearest to theirs beside the baseline, among the candidates of `race`."""
    bench, total = race.bench, race.bench.total
    take, every = np.arange(bench.p), np.arange(bench.p, bench.p + bench.blocks.K)
    A = total[np.ix_(take, take)] + np.diag(bench.penalty(take))
    H = total[np.ix_(every, every)] - total[np.ix_(every, take)] @ np.linalg.solve(A, total[np.ix_(take, every)])
    places = {id(c.instance): c for c in race.bank.candidates}
    made = []
    for row in rows:
        me = places[id(row.instance)]
        best, name = 0.0, None
        x = np.zeros(len(every))
        x[min((*me.columns, *me.own)): min((*me.columns, *me.own)) + len(row.direction)] = row.direction
        energy = float(x @ H @ x)
        for other in race.bank.candidates if energy > 0 and not me.own else ():
            if other.key[0] == me.key[0] or other.own:
                continue
            k = np.array(other.columns)
            h = H[k] @ x
            explained = float(h @ np.linalg.lstsq(H[np.ix_(k, k)], h, rcond=1e-9)[0]) / energy
            if explained > best:
                best, name = explained, other.key[0]
        made.append(replace(row, rival=name, likeness=float(np.sqrt(min(best, 1.0)))))
    return made


def _threshold(races: Sequence[Race], seed: int) -> float:
    """The statistic that chance exceeds over all columns of `races` as seldom as the locks ask for, one of the tests that are made."""
    null = np.max([statistics(race, seed)[1].max(axis=1) for race in races], axis=0)
    return float(np.quantile(null, 1 - P_BLOCK / MISMATCH_TESTS))


@one_thread()
def power(campaign: Campaign, baseline: str | None = None, seed: int = 0, cutoff_hz: float | None = None,
          without: Sequence[str] = (), progress: Callable[[str], None] = lambda line: None) -> Power:
    """Return what the recordings of `campaign` would reveal beside `baseline`, an effect and parameter a row, the most alike rival with it.

    Raises ConfigError for an unknown baseline, CampaignError or RecordingError where the data cannot be used.
    """
    ready = opened(campaign, baseline, seed, cutoff_hz)
    case = ready.case
    known = instances(campaign.arm, torque_peaks(case.all_units), without)
    table, believed = Table(case), case.model
    few, many = [i for i in known if i.grid <= MANY], [i for i in known if i.grid > MANY]
    races = [race_of(table, few, believed, ready.repeats)]
    noise = races[0].noise
    for start in range(0, len(many), AT_ONCE):
        progress(f"effects with many shapes: {start} of {len(many)}")
        races.append(race_of(table, many[start:start + AT_ONCE], believed, None, noise))
    threshold = _threshold(races, seed)
    correlated = correlation(table)
    by_key: dict[tuple[str, int, str], list[Reveal]] = {}
    for race in races:
        progress("sizes")
        for row in _reveals(race, threshold, correlated):
            by_key.setdefault((*row.instance.key, row.parameter), []).append(row)
    typical = [_of_laws(rows) for rows in by_key.values()]
    shown = list({id(row.instance): row.instance for row in typical}.values())
    return Power(case, noise, _with_rivals(race_of(table, shown, believed, None, noise), typical))
