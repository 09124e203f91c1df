"""The two locks of a finding, and whether it is material.

Lock 1  family-wise block test: the largest standardised block score over the whole bank, against its distribution under random signs of the
        blocks (Rademacher multipliers): one p with the look-elsewhere effect paid. Or an e-value: what is gained on recordings left out.
Lock 2  recordings left out of the fit must be predicted better: a sign-flip test on the per-recording log ratio, violent ones cut. Of what
        has values of each recording's own alone, the likelihoods of all recordings but the best one may say so instead: two tests at 5 %.
Besides, a finding must be material: at least 1 % of the residual energy of a joint on left-out recordings.

Masses that a fit has to move far beyond what is known of them testify, too: a rotor's inertia or a payload hides in them and leaves the
recordings no residual. What relieves them passes on their word.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.race import Race, columns_of, own_of
from nnhydro.diagnosis.score import FLOOR, Scored

Array = NDArray[np.float64]
SIGNS = 999
P_BLOCK, P_LEFT_OUT = 0.01, 0.05
MISMATCH_TESTS = 3  # of "nothing is missing": blocks, left-out likelihood, what is known
MATERIAL = 0.01
SLIGHT, TELLS = 0.02, 2.0  # of the largest log ratio, or in score: recordings that tell less do not vote
VIOLENT = 3.0  # of the median recording's log ratio: the most that one recording counts for
FEWEST = 4  # recordings of which anything is said
EXACT = 12  # recordings up to which all signs are tried
SOFT = 6.0  # score difference that counts as one: left-out scores of autocorrelated rows overstate the evidence
TRIED = 660  # hypotheses that are tried in all, on an arm of two links
RELIEF = 0.5  # of a gain: when that much of it is relief of what is known, recordings need not testify
ALIVE = 1e-6  # of a column's energy: what is left of it beside the baseline and the chosen


def block_scores(race: Race) -> tuple[Array, Array]:
    """Return U (blocks, K), each candidate column's projected product with the residual, and the columns' projected energy (K,)."""
    bench = race.bench
    kept = race.kept()
    take = np.concatenate([bench.index(columns_of(kept)), bench.p + own_of(kept)])
    G, total = bench.joint_sums, bench.total
    every = np.arange(bench.p, bench.p + bench.blocks.K)
    A = total[np.ix_(take, take)] + np.diag(bench.penalty(take))
    solved = np.linalg.solve(A, total[np.ix_(take, [*every, total.shape[0] - 1])])
    B, theta = solved[:, :-1], solved[:, -1]
    gX = G[:, every, -1] - np.einsum("bkq,q->bk", G[:, every[:, None], take[None, :]], theta)
    gY = G[:, take, -1] - np.einsum("bqr,r->bq", G[:, take[:, None], take[None, :]], theta)
    energy = np.diag(total)[every] - (total[np.ix_(every, take)] * B.T).sum(axis=1)
    return gX - gY @ B, np.maximum(energy, 0.0)


def turns(race: Race, order: Sequence[int]) -> Array:
    """Return for every column (K,) how far its block scores, summed over units in the `order` of the campaign, leave 0 in a part of it."""
    U, _ = block_scores(race)
    by_unit = np.zeros((int(race.bench.blocks.unit.max()) + 1, U.shape[1]))
    np.add.at(by_unit, race.bench.blocks.unit, U)
    running = np.cumsum(by_unit[list(order)], axis=0)
    reach = np.maximum(np.abs(running).max(axis=0), np.abs(running[-1] - running).max(axis=0))
    return np.asarray(reach / np.maximum(np.sqrt((U**2).sum(axis=0)), 1e-300), np.float64)


def _standardised(x: Array) -> Array:
    result: Array = x / np.maximum(np.sqrt((x**2).sum(axis=0)), 1e-300)
    return result


def _ranks(x: Array) -> Array:
    """Ranks 1, 2, ... of `x` (n, k) along its first axis; equal ones in their order."""
    return np.asarray(np.argsort(np.argsort(x, axis=0, kind="stable"), axis=0) + 1.0, np.float64)


def statistics(race: Race, seed: int) -> tuple[Array, Array]:
    """Return the statistic of every column (K,), and of every column under random signs of the blocks (999, K), both about N(0, 1) in size.

    Each column enters by its block scores and by their signed ranks, which a few violent blocks cannot drown; columns with values of each
    recording's own do not enter, see `gain_p`.
    """
    U, energy = block_scores(race)
    alive = (energy > ALIVE * np.maximum(np.diag(race.bench.total)[race.bench.p:-1], 1e-300)) & ((U**2).sum(axis=0) > 0)
    U = np.where(alive, U, 0.0)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(SIGNS, len(U)))
    parts = [_standardised(U), _standardised(np.sign(U) * _ranks(np.abs(U)) * alive)]
    seen = np.maximum(*(np.abs(x.sum(axis=0)) for x in parts))
    null = np.maximum(*(np.abs(signs @ x) for x in parts))
    own = [k for c in race.bank.candidates for k in c.own]
    seen[own], null[:, own] = 0.0, 0.0
    return seen, null


def gain_p(gain: float, tried: int) -> float:
    """Return the p of a candidate by its gain in left-out likelihood; no block's sign can testify to values of each recording's own.

        p <= tried exp(-gain / 6)        a likelihood ratio on data left out is an e-value; 6 for the correlation of rows; by Markov

    `tried` is the number of candidates among which it is the best. Source: Shafer (2021), J. R. Stat. Soc. A 184; the tempering is ours.
    """
    return float(np.clip(tried * np.exp(-max(gain, 0.0) / SOFT), 1 / (SIGNS + 1), 1.0))  # no smaller than the other test can give


def known_p(race: Race, scored: Scored) -> float:
    """Return the p of "the baseline's parameters are what is known of them":  |z|^2 = 2 cost ~ chi^2 with as many degrees as are known.

    Below four recordings nothing is decided, as by `sign_flip_p`.
    """
    from scipy.stats import chi2

    if len(scored.by_unit) < FEWEST:
        return 1.0
    p = float(chi2.sf(2 * scored.cost, max(int((race.bench.prior > 0).sum()), 1)))
    return max(p, 1 / (SIGNS + 1))  # no smaller than the other tests can give


@final
@dataclass(frozen=True, eq=False)
class Extremes:
    """The largest statistic over the columns tried so far, and the largest under each draw of random signs (999,)."""

    seen: float = 0.0
    null: Array = field(default_factory=lambda: np.zeros(SIGNS))

    def beside(self, race: Race, seed: int) -> "Extremes":
        """Return the extremes over the columns of `race`, too, which shares recordings and chosen candidates with the others."""
        one, many = statistics(race, seed)
        return Extremes(max(self.seen, float(one.max())), np.maximum(self.null, many.max(axis=1))) if one.size else self

    @property
    def p_value(self) -> float:
        """The p of "nothing is missing" over all these columns."""
        return float((1 + (self.null >= self.seen - 1e-12).sum()) / (SIGNS + 1)) if self.seen > 0 else 1.0


def family_wise_p(race: Race, seed: int) -> float:
    """Return the p of "nothing is missing" over all columns of `race`."""
    return Extremes().beside(race, seed).p_value


def sign_flip_p(gains: Array) -> float:
    """Return the one-sided p of "the mean of `gains` (n,) is not above 0" under random signs; below four nothing is decided.

    One counts for at most three times the median, so that a violent recording does not decide alone.
    """
    if len(gains) < FEWEST:
        return 1.0
    most = VIOLENT * float(np.median(np.abs(gains)))
    gains = np.clip(gains, -most, most)
    if len(gains) <= EXACT:
        signs = 1.0 - 2.0 * ((np.arange(2 ** len(gains))[:, None] >> np.arange(len(gains))) & 1)
    else:
        signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(2**EXACT, len(gains)))
        signs[0] = 1.0
    return float((signs @ gains >= gains.sum() - 1e-9 * most).mean())


def left_out_p(before: Scored, after: Scored) -> float:
    """Return the one-sided p of "left-out recordings are not predicted better", from the log ratio a recording."""
    return sign_flip_p(telling(before.by_unit - after.by_unit))


def telling(gains: Array) -> Array:
    """Return those `gains` (n,) that tell anything: a recording on which next to nothing changes has no vote.

    A gain of `TELLS` in score is one whatever others gain: a single violent recording would silence them, and one vote decides nothing.
    """
    size = np.abs(gains)
    return gains[size > max(1e-9, min(SLIGHT * float(size.max(initial=0.0)), TELLS))]


def opens(gains: Array) -> bool:
    """Return whether recordings are predicted better by `gains` (n,): p <= 0.05, or all of only four (p = 1/16, the least there is)."""
    gains = telling(gains)
    return sign_flip_p(gains) <= (P_LEFT_OUT if len(gains) != FEWEST else 2.0**-FEWEST)


def confirmed(gains: Array) -> bool:
    """Return whether what the recording with the largest of `gains` (n,) shows is seen in the others, too: p <= 0.05 of their likelihoods.

    A recording's own values are predicted within that recording alone, so that likelihoods of a few are evidence where signs are none.
    """
    return bool(len(gains) > 1 and gain_p(float(gains.sum() - gains.max()), 1) <= P_LEFT_OUT)


def material(before: Scored, after: Scored) -> float:
    """Return the largest share, over joints, of left-out residual energy that is gained."""
    a, b = before.energy.sum(axis=0), after.energy.sum(axis=0)
    return float(np.max((a - b) / np.maximum(a, 1e-300)))


def first_lock_p(candidate: Candidate, gain: float, p_block: float) -> float:
    """Return the p of "nothing is missing" by which `candidate` passes lock 1: `p_block` of the blocks, or that of its `gain`.

        p = min(p_block, 3 N exp(-gain / 6))        N = TRIED; the second alone for values of each recording's own

    What few blocks tell has few signs; no block's sign can testify to values of each recording's own. `gain` is that in left-out score,
    `p_block` the p of `family_wise_p`. Source: `gain_p`; that either may open the lock is ours.
    """
    p_gain = gain_p(gain, MISMATCH_TESTS * TRIED)
    return p_gain if candidate.own else min(p_block, p_gain)


def passes(race: Race, candidate: Candidate, gain: float, seed: int) -> bool:
    """Return whether `candidate` passes both locks and is material, or relieves what is known, and write it down."""
    before, after = race.scored(), race.scored([candidate])
    p_block = first_lock_p(candidate, gain, family_wise_p(race, seed))
    p_left_out, share, p_known = left_out_p(before, after), material(before, after), known_p(race, before)
    race.log.append(f"{candidate.key[0]} joint {candidate.key[1]}: gain {gain:.1f}, p_block {p_block:.3f}, p_left_out {p_left_out:.4f}, "
                    f"energy {share:.3f}, p_known {p_known:.3f}")
    if p_known <= P_BLOCK and before.cost - after.cost >= RELIEF * gain and gain_p(gain, len(race.bank.candidates)) <= P_BLOCK:
        return True
    return p_block <= P_BLOCK and _agreed(race, candidate, before, after) and share >= MATERIAL


def _agreed(race: Race, candidate: Candidate, before: Scored, after: Scored) -> bool:
    """Whether recordings left out agree on the candidate.

    Of a wave or a street, all of whose values are a recording's own, those where nothing is missing need not; nor all of the others, as
    links shed where they are fast: likelihoods beside the largest count as well.
    """
    gains = before.by_unit - after.by_unit
    if candidate.columns:
        return opens(gains)
    heard = gains[(before.energy > FLOOR * race.bench.by_unit[1][:, None]).any(axis=1)]
    return opens(heard) or confirmed(heard)
