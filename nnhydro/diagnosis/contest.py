"""How far the members of a class come apart in motions that nobody has recorded yet: algebra on Gram matrices, no torque needed.

    lambda_AB^2 = ||S^-1/2 (I - P_[Y, x_B]) x_A beta_A||^2 over old and new rows  -  the same over the old rows

P_[Y, x_B] is the refit of the baseline, the other findings and the rival B to everything recorded. With A the truth, B falls behind by
N(lambda^2 / 2, c lambda^2) in score; the score's logarithm, rows/2 log(1 + lambda^2 / rows), tames what a single recording can say.
Source: designs that discriminate between rival models, Atkinson & Fedorov (1975), Biometrika 62; projection and chance are ours.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import erf, sqrt
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate, build
from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.feasible import Proposed
from nnhydro.diagnosis.locks import SOFT
from nnhydro.diagnosis.race import Race, laws_of
from nnhydro.diagnosis.score import RIDGE, Bench
from nnhydro.diagnosis.table import Piece, Table
from nnhydro.diagnosis.verdict import CLEAR, HARDLY, NEAR, parameter_count, rivals_of
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.preprocessing import prepare
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]
DRAWS = 25  # of a member's values, to see whether they make sense
MOST_APART = 5.0  # standard deviations beyond which a pair is settled, or hopeless
CORRELATION = 1.5  # c: variance of sums of noise rows over that of independent ones, behind the low-pass


@final
@dataclass(frozen=True, eq=False)
class Contest:
    """A class: its members, the rest of the choice, and how far each member is behind the first in score."""

    members: tuple[Candidate, ...]
    rest: tuple[Candidate, ...]
    behind: tuple[float, ...]
    limit: Array  # (members, members) score by which a member (column) must fall behind another one (row) to leave its class
    own: tuple[float, ...] = ()  # how far those members are behind whose values are each recording's own
    hardly: Array | bool = True  # (members, members) whether it must fall behind by a share of what is gained, too
    freest: tuple[Candidate, ...] = ()  # the widest law of each member, which holds whatever law of it comes nearest; none: its own


def contest_of(race: Race) -> Contest | None:
    """Return the class of the first finding that holds rivals; None where every finding stands alone.

    For members whose values are each recording's own no motion is planned: nobody knows their phase. What they cost a recording ends them.
    """
    for chosen in race.chosen:
        every = [r for r in rivals_of(race, chosen) if r.in_class]
        inside = [r for r in every if not r.candidate.own]
        if inside and not chosen.own:
            told = (chosen, *(r.candidate for r in inside))
            limits = np.array([[_limit(a, b) for b in told] for a in told])
            wider = np.array([[min(map(parameter_count, laws_of(race, b))) > parameter_count(a) for b in told] for a in told])
            freest = tuple(max(laws_of(race, c), key=parameter_count) for c in told)
            return Contest(told, tuple(c for c in race.chosen if c is not chosen), (0.0, *(r.behind for r in inside)), limits,
                           tuple(r.behind for r in every if r.candidate.own), ~wider, freest)
    return None


def _limit(one: Candidate, other: Candidate) -> float:
    """How far `other` must fall behind `one`: further where it is the general form of its family."""
    a, b = one.instance.effect, other.instance.effect
    return CLEAR if b.general and a.family == b.family else NEAR


def unit_of(motion: Proposed, name: str, case: Case) -> Unit:
    """Return a motion that nobody has recorded yet as a unit whose torques are 0."""
    made = tuple(prepare(motion.recording(name), case.model.preparation))
    return Unit(name, name, False, lambda: made)


@final
@dataclass(frozen=True, eq=False)
class Planned:
    """A motion with the Gram matrix (q, q) of its columns and the number of its rows over all joints."""

    motion: Proposed
    G: Array
    rows: float


@final
@dataclass(frozen=True, eq=False)
class Judge:
    """Tells how far the members of a class come apart; columns are those of the baseline, the other findings, then the members."""

    case: Case
    race: Race
    believed: StripTheory
    contest: Contest

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """All whose columns are needed: the rest, the members, then wider laws of theirs."""
        named = (*self.contest.rest, *self.contest.members)
        return (*named, *(c for c in self.contest.freest if not any(c is one for one in named)))

    def _places(self) -> dict[int, list[int]]:
        """Columns of each candidate (by its id), side by side behind the baseline's."""
        ends = self.race.bench.p + np.cumsum([0, *(len(c.columns) + len(c.own) for c in self.candidates)])
        spans = zip(self.candidates, ends[:-1].tolist(), ends[1:].tolist(), strict=True)
        return {id(c): list(range(start, end)) for c, start, end in spans}

    def recorded(self) -> Array:
        """Return the Gram matrix (q, q) over the recordings at hand."""
        p, total = self.race.bench.p, self.race.bench.total
        take = [*range(p), *(p + k for c in self.candidates for k in sorted((*c.columns, *c.own)))]
        return np.asarray(total[np.ix_(take, take)])

    def planned(self, motions: Sequence[Proposed]) -> list[Planned]:
        """Return the motions that hold rows to compare.

        What a constant in each new recording could explain does not count: a zero that has moved since would be taken for it.
        """
        made = tuple(unit_of(motion, f"next_{number}", self.case) for number, motion in enumerate(motions))

        def last(unit: Unit, number: int) -> torch.Tensor:
            return torch.ones(len(unit.segments()[number]), dtype=torch.float64)

        table = Table(replace(self.case, all_units=made, places=last))
        numbers = sorted({piece.number for piece in table.pieces})
        if not numbers:
            return []
        joints, p = len(self.race.noise), self.race.bench.p

        def constants(piece: Piece) -> Array:
            return np.tile(np.eye(joints), (len(piece.y), 1, 1))

        _, blocks = build(table, [c.instance for c in self.candidates], self.believed, constants)
        G, rows = Bench.of(blocks, self.race.noise, self.race.bench.prior).by_unit
        return [Planned(motions[k], _less_offsets(one, p), float(n) * joints) for k, one, n in zip(numbers, G, rows, strict=True)]

    def _pairs(self, H: Array, laws: Sequence[Candidate]) -> Iterator[tuple[int, int, float, Array, Array]]:
        """Yield for every pair (A the truth, the law of B in its place) lambda^2, and B's values (k,) with their covariance there."""
        places = self._places()
        for a in range(len(self.contest.members)):
            d = self._values(a, len(H))
            for b in (b for b in range(len(self.contest.members)) if b != a):
                mine = places[id(laws[b])]
                take, A = self._beside(H, mine)
                inverse, h = np.linalg.inv(A), H[take] @ d
                fit, own = inverse @ h, slice(len(take) - len(mine), len(take))
                yield a, b, max(float(d @ H @ d - h @ fit), 0.0), fit[own], np.asarray(CORRELATION * inverse[own, own], np.float64)

    def _values(self, a: int, q: int) -> Array:
        """The fitted values (q,) of member `a` at its places among all columns."""
        member = self.contest.members[a]
        values, d = self.race.values([*self.contest.rest, member])[1], np.zeros(q)
        d[self._places()[id(member)]] = [values[k] for k in sorted(member.columns)]
        return d

    def _beside(self, H: Array, more: Sequence[int] = ()) -> tuple[Array, Array]:
        """The places (k,) of the baseline, the other findings and `more`, and what a fit of them inverts (k, k)."""
        p, places = self.race.bench.p, self._places()
        take = np.array([*range(p), *(k for one in self.contest.rest for k in places[id(one)]), *more])
        penalty = np.concatenate([self.race.bench.prior, np.zeros(len(take) - p)]) + RIDGE * np.diag(H)[take] + 1e-12
        return take, H[np.ix_(take, take)] + np.diag(penalty)

    def apart(self, H: Array) -> Array:
        """Return lambda^2 (members, members): what is left of member A's torque (row) when B's freest law (column) is fitted instead."""
        found = np.zeros((len(self.contest.members),) * 2)
        for a, b, size, _, _ in self._pairs(H, self.contest.freest or self.contest.members):
            found[a, b] = size
        return found

    def gained(self, H: Array, rows: float) -> Array:
        """Return the score (members,) that each member gains over `rows` rows with the Gram matrix H where it is the truth."""
        take, A = self._beside(H)
        found = np.zeros(len(self.contest.members))
        for a in range(len(found)):
            d = self._values(a, len(H))
            h = H[take] @ d
            found[a] = rows / 2 * np.log1p(max(float(d @ H @ d - h @ np.linalg.solve(A, h)), 0.0) / rows)
        return found

    def possible(self, H: Array) -> Array:
        """Return the chance (members, members) that B (column), fitted in the place of A (row), has values that make sense.

        A law that holds A's as a special case fits as well as A whatever is recorded; what ends it is that its values become absurd, such
        as a hose's rest angle ten turns away. Of several laws of B the one that makes sense most often counts.
        """
        found = np.eye(len(self.contest.members))
        for laws in (self.contest.members, *([self.contest.freest] if self.contest.freest else [])):
            rng = np.random.default_rng(0)
            for a, b, _, mean, covariance in self._pairs(H, laws):
                one = laws[b].instance
                low, high = np.array(one.bounds()).T
                drawn = rng.multivariate_normal(mean, covariance, DRAWS, method="svd")
                sense = float(np.mean([bool(((x >= low) & (x <= high)).all()) and one.plausible(x) for x in drawn]))
                found[a, b] = max(found[a, b], sense)
        return found

    def _own_leave(self, recordings: int) -> float:
        """The chance that members with values of each recording's own leave: every recording costs them as much as each one so far did."""
        own = self.contest.own
        if not own:
            return 1.0
        before = len(self.race.bench.by_unit[1])
        later = [behind * (before + recordings) / before for behind in own]
        truth = 1 / (1 + sum(np.exp(-max(behind, 0.0) / SOFT) for behind in own))  # that it is none of them
        return float(truth) * min(0.5 * (1 + erf((x - NEAR) / sqrt(4 * max(x, 1.0)))) for x in later)

    def chance(self, gain: Array, rows: float, possible: Array | None = None, recordings: int = 1, gained: Array | None = None) -> float:
        """Return the chance that every wrong member leaves the class, the truth being each as likely as its score says.

        `gain` (members, members) is the lambda^2 that the new rows add, `rows` their number over all joints; `possible` (members, members)
        how likely a member's values make sense where another one is the truth; `recordings` how many are added; `gained` (members,) what
        each member gains in all where it is the truth.
        """
        ahead, weights = self._ahead(gain, rows, gained), self._weights()
        leaves = 0.5 * (1 + np.vectorize(erf)(ahead / sqrt(2)))
        leaves = leaves if possible is None else 1 - (1 - leaves) * possible
        np.fill_diagonal(leaves, 1.0)
        return float(weights @ leaves.min(axis=1)) * self._own_leave(recordings)

    def apart_by(self, gain: Array, rows: float) -> float:
        """Return by how many standard deviations members leave the class, in the mean over all pairs, each counted for `MOST_APART`."""
        ahead, weights = np.clip(self._ahead(gain, rows), -MOST_APART, MOST_APART), self._weights()
        np.fill_diagonal(ahead, 0.0)
        return float(weights @ ahead.sum(axis=1)) / max(len(weights) - 1, 1)

    def _weights(self) -> Array:
        """How likely each member (members,) is the truth, as its score says."""
        weights = np.exp(-np.maximum(np.array(self.contest.behind), 0.0) / SOFT)
        return np.asarray(weights / weights.sum(), np.float64)

    def _ahead(self, gain: Array, rows: float, gained: Array | None = None) -> Array:
        """By how many standard deviations each member (row), the truth, throws each other one (column) out of the class.

        A rival of no more parameters must fall behind by a share of all that is gained, too: its law may have a slightly other form.
        """
        behind, limit = np.array(self.contest.behind), self.contest.limit
        limit = limit if gained is None else np.maximum(limit, np.where(self.contest.hardly, HARDLY * gained[:, None], 0.0))
        ahead = behind[None, :] - behind[:, None] + rows / 2 * np.log1p(gain / rows) - limit
        return np.asarray(ahead / np.sqrt(CORRELATION * np.maximum(gain, 1e-9)), np.float64)


def _less_offsets(G: Array, p: int) -> Array:
    """The Gram matrix (q, q) of one recording over its joints, off a constant at each joint; G (joints, P, P) holds it behind column p."""
    joints = len(G)
    kept = np.array([*range(p), *range(p + joints, G.shape[1] - 1)])
    less = [one - np.outer(one[:, p + j], one[p + j]) / max(float(one[p + j, p + j]), 1e-300) for j, one in enumerate(G)]
    return np.asarray(np.sum(less, axis=0)[np.ix_(kept, kept)], np.float64)


def least_pair(gain: Array) -> float:
    """Return the lambda^2 of the two members that stay closest."""
    return float(gain[~np.eye(len(gain), dtype=bool)].min())
