"""The next experiment: the motion that tells the members of a class apart, where the recordings at hand cannot; as a file ready to run.

    max over feasible motions  of the chance that every wrong member leaves the class               (`contest`)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.contest import Array, Contest, Judge, Planned, contest_of, least_pair
from nnhydro.diagnosis.feasible import Proposed, draw, varied
from nnhydro.diagnosis.race import Race
from nnhydro.diagnosis.rig import Limits, Rig
from nnhydro.files import write_text
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.preprocessing import prepare
from nnhydro.recordings.segment import Segment

DRAWN, BETTERED = 60, 30  # motions tried at first, and in the neighbourhood of the best
BEST = 5
FEWEST, MOST = 3, 6  # times that a motion is to be recorded: what one recording shows no other one confirms
ENOUGH = 0.9  # chance from which no further repeat is asked for
FAIR = 0.5  # chance below which a motion is called unlikely to settle anything
STEM = "next_experiment"


@final
@dataclass(frozen=True, eq=False)
class Proposal:
    """The motion to record next, how often, and what may be expected of it."""

    contest: Contest
    motion: Proposed
    recordings: int
    gain: float  # expected score between the two members that stay closest
    chance: float  # that all wrong members leave the class
    usual: float  # the same for the median of the motions drawn at random
    arm: Arm
    stated: bool = False  # whether the rig's limits are stated, not only shown

    def document(self, file: str | None = None) -> dict[str, Any]:
        """Return what diagnosis.json holds as next_experiment; `file` is where the motion was written."""
        members = [{"effect": c.key[0], "joint": c.key[1] or None} for c in self.contest.members]
        return {"separates": members, "motion": self.motion.document, "seconds": float(self.motion.t[-1]), "recordings": self.recordings,
                "expected_gain": self.gain, "chance": self.chance, "chance_of_a_random_motion": self.usual, "file": file,
                "statement": self.statement()}

    def statement(self) -> str:
        """Return the proposal in one sentence."""
        first, *others = (c.key[0] + (f" at joint {c.key[1]}" if c.key[1] else "") for c in self.contest.members)
        often = "once" if self.recordings == 1 else f"{self.recordings} times"
        motion = f"the proposed {self.motion.document['kind']} ({self.motion.t[-1]:.1f} s)"
        if self.chance < FAIR:
            within = "the limits of this rig" if self.stated else "what this rig has shown"
            return (f"Within {within} no motion is likely to tell {first} from {', '.join(others)}: {motion}, recorded "
                    f"{often}, settles the matter with a chance of {100 * self.chance:.0f} %.")
        return (f"To tell {first} from {', '.join(others)}, record {motion} {often}: it settles the matter with a chance of "
                f"{100 * self.chance:.0f} % (a motion drawn at random: {100 * self.usual:.0f} %).")

    def write(self, path: Path) -> None:
        """Write the motion as a CSV file in the columns of a recording without torques, whole or not at all."""
        columns = self.motion.columns(self.arm)
        rows = (",".join(f"{x:.9g}" for x in row) for row in np.column_stack(list(columns.values())) + 0.0)
        write_text(path, "\n".join([",".join(columns), *rows]) + "\n")


@final
@dataclass(frozen=True, eq=False)
class _Planner:
    """Motions that the rig can do, judged by how far they bring the members of a class apart."""

    judge: Judge
    H: Array  # Gram matrix of the recordings at hand
    rows: float  # of theirs, over all joints
    before: Array  # (members, members) lambda^2 there

    def gain(self, one: Planned, often: int = 1) -> Array:
        """Return the lambda^2 (members, members) that recording a motion so often adds."""
        return np.maximum(self.judge.apart(self.H + often * one.G) - self.before, 0.0)

    def chance(self, one: Planned, often: int) -> float:
        """Return the chance that recording a motion so often settles the matter."""
        H, rows = self.H + often * one.G, often * one.rows
        gained = self.judge.gained(H, self.rows + rows)
        return self.judge.chance(self.gain(one, often), rows, self.judge.possible(H), often, gained)

    def merit(self, one: Planned, often: int) -> tuple[float, float]:
        """Return what motions are compared by where they are recorded so often: the chance, then how far they bring members apart."""
        gain, rows = self.gain(one, often), often * one.rows
        return round(self.chance(one, often), 2), self.judge.apart_by(gain, rows)

    def best(self, motions: list[Planned], often: int) -> Planned:
        """Return the motion that most likely settles the matter when it is recorded so often."""
        return max(motions, key=lambda one: self.merit(one, often))


def shown_by(case: Case) -> list[Segment]:
    """Return the moving segments with torques: what a rig has shown it can do."""
    return [s for unit in case.all_units if not unit.steady for s in unit.segments() if s.tau is not None and s.keep.any()]


def _able(motions: Sequence[Proposed], rig: Rig, model: StripTheory) -> list[Proposed]:
    """Those of `motions` that the drives can do: the baseline's torque stays within the limits."""
    def peaks(motion: Proposed) -> Array:
        segments = prepare(motion.recording("next"), model.preparation)
        tau = [np.abs(model.torque(Motion.of(segment)).numpy()).max(axis=0) for segment in segments]
        return np.asarray(np.max(tau, axis=0)) if tau else np.full(len(rig.tau), np.inf)

    return [motion for motion in motions if bool((peaks(motion) <= rig.tau).all())]


def _rate(segments: Sequence[Segment]) -> float:
    return 1 / float(np.median([s.dt for s in segments]))


@one_thread()
def motions_at_random(case: Case, count: int, seed: int, limits: Limits | None = None) -> list[Proposed]:
    """Return `count` motions drawn at random within the limits of the rig: what a proposal is to be compared with."""
    shown, rng = shown_by(case), np.random.default_rng([seed, 1])
    rig, found = Rig.of(shown).with_limits(limits), list[Proposed]()
    for _ in range(10):
        found += _able(draw(rig, case.model.arm, _rate(shown), 3 * count, rng), rig, case.model)
        if len(found) >= count:
            break
    return found[:count]


@one_thread()
def next_experiment(race: Race, case: Case, believed: StripTheory, seed: int, limits: Limits | None = None) -> Proposal | None:
    """Return the motion that would settle the first ambiguous finding of a finished race; None where nothing is ambiguous or moves.

    `believed` is what unsettled instruments read (`Found.believed`); `limits` are those of the rig that its user states, the others are
    taken from what it has shown. Raises ConfigError where they do not fit the arm.
    """
    contest, segments = contest_of(race), shown_by(case)
    if contest is None or not segments:
        return None
    judge, rng, arm = Judge(case, race, believed, contest), np.random.default_rng(seed), case.model.arm
    rig, rate, H = Rig.of(segments).with_limits(limits), _rate(segments), judge.recorded()
    planner = _Planner(judge, H, float(race.bench.blocks.n.sum()) * len(race.noise), judge.apart(H))
    drawn = judge.planned(_able(draw(rig, arm, rate, DRAWN, rng), rig, case.model))
    if not drawn:
        return None
    first = sorted(drawn, key=lambda one: planner.merit(one, MOST), reverse=True)[:BEST]
    near = varied([one.motion for one in first], rig, arm, rate, BETTERED, rng)
    tried = [*first, *judge.planned(_able(near, rig, case.model))]
    best, often = planner.best(tried, MOST), MOST
    for n in range(FEWEST, MOST):
        one = planner.best(tried, n)
        if planner.chance(one, n) >= ENOUGH:
            best, often = one, n
            break
    usual = float(np.median([planner.chance(one, often) for one in drawn]))
    return Proposal(contest, best.motion, often, least_pair(planner.gain(best, often)) / 2, planner.chance(best, often), usual, arm,
                    rig.stated)
