"""How well motions that are not yet recorded would separate the members of an equivalence set: algebra on Gram matrices, without torques.

    lambda_AB^2 = ||W^1/2 (I - P_[Y, x_B]) x_A beta_A||^2,    W = V^-1
    D_AB = lambda_AB^2 / 2 + (log|M_B| - log|M_A|) / 2        expected log evidence of the truth A over B

P_[Y, x_B] is the refit of the baseline, the other findings and the rival B to everything recorded, their priors included. New rows add
N(D, lambda^2 + 1) to the score deficit of B. With more parameters than A, B loses even if it contains A as a special case. Of B's fitted
law and its widest one, the closer counts. The noise of new rows is that of the campaign, with what A explains known to FORM.
Source: designs that discriminate between rival models, Atkinson & Fedorov (1975), Biometrika 62; in the evidence of `model.evidence`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import FORM, LEAST_GAIN, MODEL_ERROR, RHO
from nnhydro.diagnosis.decision.alternative_laws import EQUIVALENT_COSINE, parameter_count
from nnhydro.diagnosis.experiment.motions import CandidateMotion
from nnhydro.diagnosis.findings.equivalence import EQUIVALENT_SHARE, rivals_of
from nnhydro.diagnosis.noise.spectrum import Noise
from nnhydro.diagnosis.problem.columns import columns_on
from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.problem.hypothesis import Hypothesis, Key
from nnhydro.diagnosis.problem.problem import Problem, Stretch
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.fitting.linear.statistics import columns_and_offset
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion

Array = NDArray[np.float64]
SCATTER = 1.0  # nats^2: variance of the gain of two parameters fitted to noise alone (half a chi-squared of two)
PLANNED_HZ = 50.0  # Hz: least row rate at which planned motions are compared; a diagnosis never looks above 20 Hz
Members = tuple[int, ...]


@final
@dataclass(frozen=True, eq=False)
class DiscriminationProblem:
    """A class: its members (numbers in the library, the finding first), the rest of the claimed set, and their score deficits, nats."""

    members: Members
    rest: Members
    deficits: tuple[float, ...]
    keys: tuple[Key, ...]


def discrimination_of(search: Search, claimed: ScoredSet) -> DiscriminationProblem | None:
    """Return the class of the first member of `claimed` that holds rivals; None where every finding stands alone.

    Members with values per recording take no part: their phase in the next recording is unknown.
    """
    hypotheses = search.view.library.hypotheses
    for k in claimed.chosen:
        inside = [rival for rival in rivals_of(search, claimed, k)[1] if rival.equivalent and not hypotheses[rival.number].per_recording]
        if inside and not hypotheses[k].per_recording:
            members = (k, *(rival.number for rival in inside))
            rest = tuple(x for x in claimed.chosen if x != k and not hypotheses[x].per_recording)
            deficits = (0.0, *(max(rival.deficit, 0.0) for rival in inside))
            return DiscriminationProblem(members, rest, deficits, tuple(search.key(m) for m in members))
    return None


@final
@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """A motion with the Gram matrix (q, q) of its whitened columns."""

    motion: CandidateMotion
    G: Array


def chance_settled(task: DiscriminationProblem, size2: Array, margin: Array, limit: Array | float = LEAST_GAIN) -> float:
    """Return the chance that every wrong member leaves the class, the truth being each as likely as its score says.

    `size2` (members, members) is the lambda^2 that new rows add where the row's member is the truth and the column's the rival, `margin`
    the expected log evidence, `limit` the nats by which the rival must be behind to leave.
    """
    from scipy.special import ndtr

    behind = np.array(task.deficits)
    z = (behind[None, :] - behind[:, None] + margin - limit) / np.sqrt(size2 + SCATTER)
    leaves = np.asarray(ndtr(z), dtype=float)
    np.fill_diagonal(leaves, 1.0)
    weights = np.exp(-behind)
    return float(weights @ leaves.min(axis=1) / weights.sum())


@final
@dataclass(eq=False)
class Discriminator:
    """How far new motions separate the members of a class; columns: baseline, the other findings, then the members."""

    search: Search
    noise: Noise
    model: StripTheory
    task: DiscriminationProblem

    def __post_init__(self) -> None:
        task, library = self.task, self.search.view.library
        wider = {k: _widest(library.hypotheses, k) for k in task.members}
        self.numbers = (*task.rest, *task.members, *(w for k, w in wider.items() if w != k))
        laws = {k: [len(task.rest) + i] for i, k in enumerate(task.members)}
        for i, k in enumerate((k for k, w in wider.items() if w != k), len(task.rest) + len(task.members)):
            laws[k].append(i)
        self.laws = [laws[k] for k in task.members]  # places of each member's laws, its own first
        self.hypotheses: list[Hypothesis] = [_later(library.hypotheses[k]) for k in self.numbers]
        self.p = self.search.whitened.p
        ends = self.p + np.cumsum([0, *(hypothesis.width for hypothesis in self.hypotheses)])
        self.places = [np.arange(a, b) for a, b in pairwise(ends.tolist())]
        self.scale = np.concatenate([library.scale[library.at(k)] for k in self.numbers])
        self.q = int(ends[-1])
        self.values = [self._values(a) for a in range(len(task.members))]
        self.moments = [np.outer(d, d) for d in self.values]
        for a, k in enumerate(task.members):  # a law whose values are hardly known may show more than they do
            found, at = self.search.score((*task.rest, k)), self.places[self.laws[a][0]]
            place = found.places(self.search.view)[k]
            self.moments[a][np.ix_(at, at)] += found.fit.covariance(np.arange(place.start, place.stop))
        self.precision = np.concatenate([np.ones(self.p), np.full(self.q - self.p, RHO**-2)])
        self.H = self.recorded_gram()
        self.before = self.noncentralities(self.H)

    def _values(self, a: int) -> Array:
        """The scaled values (q,) of member `a`, fitted beside the rest, at its own places."""
        k = self.task.members[a]
        found = self.search.score((*self.task.rest, k))
        values = np.zeros(self.q)
        values[self.places[self.laws[a][0]]] = found.fit.mean[found.places(self.search.view)[k]]
        return values

    def recorded_gram(self) -> Array:
        """Return the Gram matrix (q, q) over the recordings at hand."""
        whitened, columns = self.search.whitened, self.search.view.join(self.numbers)
        assert columns is not None
        p = self.p
        made: Array = np.block([[whitened.G[:p, :p], columns.cross[:p]], [columns.cross[:p].T, columns.gram]])
        return made

    def feasible(self, motions: Sequence[CandidateMotion], most: Array) -> list[PlannedMotion]:
        """Return those of `motions` whose torque stays within `most` (joints,) N m, with their Gram matrices."""
        design = self.search.view.library.design
        old = design.problem
        placed = all(stretch.place is not None for stretch in old.stretches)
        able: list[CandidateMotion] = []
        stretches: list[Stretch] = []
        for motion in motions:
            segment = motion.segment(f"next_{len(able)}", max(PLANNED_HZ, 4 * old.edge))
            torque = np.abs(self.model.torque(Motion.of(segment)).numpy()).max(axis=0)
            if bool((torque <= most).all()):
                stretches.append(Stretch(len(able), segment.recording, segment, np.ones(len(segment)) if placed else None))
                able.append(motion)
        if not able:
            return []
        return self._gram(able, Problem(old.arm, old.edge, tuple(stretch.name for stretch in stretches), tuple(stretches)))

    def _gram(self, motions: Sequence[CandidateMotion], problem: Problem) -> list[PlannedMotion]:
        baseline = self.search.view.library.design.baseline
        zeros = np.zeros(0)

        def on(stretch: Stretch) -> Array:
            """Return the columns of baseline and hypotheses and the model's torque on a stretch, (n, joints, p + K + 1)."""
            Y = columns_and_offset(baseline.physics.loads, stretch.segment, problem.arm)[0] @ baseline.prior.F
            X = columns_on(self.hypotheses, self.model, stretch, predicted=True) * self.scale
            tau = self.model.torque(Motion.of(stretch.segment)).numpy()
            made: Array = np.nan_to_num(np.concatenate([Y, X, tau[..., None]], axis=2))
            return made

        rows = Design(problem, baseline, zeros, zeros, zeros).rows(on)
        columns, tau = rows[..., :-1], rows[..., -1]
        w = 1.0 / np.sqrt(self._variance(problem, columns, tau))
        made = []
        for group, motion in enumerate(motions):
            at = problem.group_of == group
            if at.any():
                x = (columns[at] * w[at][..., None]).reshape(-1, self.q)
                made.append(PlannedMotion(motion, x.T @ x))
        return made

    def _variance(self, problem: Problem, columns: Array, tau: Array) -> Array:
        """The variance (n, joints) of new rows: the campaign's noise, and the form of what the members explain and of the baseline."""
        f = np.maximum(problem.frequency, 0.0)
        bands, S = self.noise.bands, self.noise.S
        order = np.argsort(bands.centre)
        at = np.log(np.maximum(bands.centre[order], 1e-6))
        noise = np.stack([np.exp(np.interp(np.log(np.maximum(f, 1e-6)), at, np.log(S[j][order]))) for j in range(len(S))], axis=1)
        explained = np.mean([(columns @ d) ** 2 for d in self.values], axis=0)
        made: Array = noise + FORM**2 * _smooth(problem, explained) + MODEL_ERROR**2 * _smooth(problem, tau**2)
        return made

    def noncentralities(self, H: Array) -> tuple[Array, Array]:
        """Return lambda^2 (members, members), row the truth, and the expected log evidence of row over column, on the rows of `H`."""
        count = len(self.task.members)
        precision, common = self.precision, self._common_places()
        size2, margin, occam = np.zeros((count, count)), np.full((count, count), np.inf), np.zeros(count)
        for b, law in [(b, law) for b, laws in enumerate(self.laws) for law in laws]:
            take = np.concatenate([common, self.places[law]])
            A = H[np.ix_(take, take)] + np.diag(precision[take])
            paid = 0.5 * float(np.linalg.slogdet(A / np.sqrt(precision[take][:, None] * precision[take]))[1])
            occam[b] = paid if law == self.laws[b][0] else occam[b]
            for a in (a for a in range(count) if a != b):
                left = _energy_left(H, take, A, self.moments[a])
                if left / 2 + paid < margin[a, b]:
                    size2[a, b], margin[a, b] = left, left / 2 + paid
        np.fill_diagonal(margin, occam)
        return size2, margin - occam[:, None]

    def expected_gain(self, motion: PlannedMotion, often: int) -> tuple[Array, Array]:
        """Return lambda^2 and expected log evidence, both (members, members), that so many recordings of a motion add."""
        size2, margin = self.noncentralities(self.H + often * motion.G)
        return np.maximum(size2 - self.before[0], 0.0), margin - self.before[1]

    def chance(self, motion: PlannedMotion, often: int) -> float:
        """Return the chance that so many recordings of a motion decide between the members."""
        return chance_settled(self.task, *self.expected_gain(motion, often), self.limits(self.H + often * motion.G))

    def limits(self, H: Array) -> Array:
        """Return by how many nats (members, members) the column must be behind the row, the truth, to leave its class on the rows of `H`.

        Where the rival leaves less than 1 - EQUIVALENT_COSINE^2 of what the truth adds, its torque is similar: of one with no more values,
        a share of the gain is required, too.
        """
        size2, common = self.noncentralities(H)[0], self._common_places()
        A = H[np.ix_(common, common)] + np.diag(self.precision[common])
        energy = [max(_energy_left(H, common, A, m), 1e-12) for m in self.moments]
        whole = np.array(energy)[:, None]
        counts = np.array([parameter_count(self.search, k) for k in self.task.members])
        alike = (size2 / whole < 1 - EQUIVALENT_COSINE**2) & (counts[None, :] <= counts[:, None])
        return np.where(alike, np.maximum(LEAST_GAIN, EQUIVALENT_SHARE / 2 * whole), LEAST_GAIN)

    def _common_places(self) -> NDArray[np.int64]:
        """The places of the baseline and the other findings."""
        return np.concatenate([np.arange(self.p), *self.places[: len(self.task.rest)]]).astype(np.int64)


def _energy_left(H: Array, take: NDArray[np.int64], A: Array, moment: Array) -> float:
    """What a fit of the columns `take` leaves of a torque whose values have the second moment `moment` (q, q), in noise units."""
    explained = np.trace(np.linalg.solve(A, H[take] @ moment @ H[:, take])) if len(take) else 0.0
    return max(float((H * moment).sum() - explained), 0.0)


def _widest(hypotheses: Sequence[Hypothesis], k: int) -> int:
    """The law of the most values of the effect of hypothesis `k` at its joint, at its shape where there is one."""
    hypothesis = hypotheses[k]
    same = [i for i, other in enumerate(hypotheses)
            if other.key == hypothesis.key and not other.per_recording and other.width > hypothesis.width]

    def alike(i: int) -> tuple[int, int]:
        shape = sum(getattr(hypotheses[i].effect, name) == getattr(hypothesis.effect, name) for name in hypothesis.spans)
        return hypotheses[i].width, shape

    return max(same, key=alike, default=k)


def _later(hypothesis: Hypothesis) -> Hypothesis:
    """The hypothesis as it acts in what is recorded next: one that acts from a recording on still does."""
    return replace(hypothesis, activity=None) if hypothesis.activity is not None and hypothesis.activity.since else hypothesis


def _smooth(problem: Problem, x: Array) -> Array:
    """Return the mean of x (n, joints) over each recording and octave of frequency, spread on its rows again."""
    octave = np.where(problem.frequency > 0, 1 + np.floor(np.log2(np.maximum(problem.frequency, 1e-3)) + 10), 0).astype(int)
    _, at = np.unique(problem.group_of * (octave.max() + 1) + octave, return_inverse=True)
    count = np.bincount(at)
    made: Array = np.stack([np.bincount(at, x[:, j])[at] / count[at] for j in range(x.shape[1])], axis=1)
    return made
