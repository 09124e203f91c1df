"""The next experiment: the motion that tells the members of a class apart, where the recordings at hand cannot; as a file ready to run.

    max over feasible motions  min over pairs (A, B)  lambda_AB^2               (`contest`)
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from nnhydro.diagnosis.case import Case
from nnhydro.diagnosis.contest import Array, Contest, Judge, Planned, contest_of, least_pair
from nnhydro.diagnosis.feasible import HARDER, Proposed, Rig, draw, varied
from nnhydro.diagnosis.race import Race
from nnhydro.files import write_text
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.preprocessing import prepare

DRAWN, BETTERED = 60, 30  # motions tried at first, and in the neighbourhood of the best
BEST = 5
MOST = 5  # times that a motion is to be recorded at most
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
            return (f"Within what this rig has shown no motion is likely to tell {first} from {', '.join(others)}: {motion}, recorded "
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
    rig: Rig
    H: Array  # Gram matrix of the recordings at hand
    before: Array  # (members, members) lambda^2 there

    def _strong_enough(self, motion: Proposed) -> bool:
        """Whether the drives can do it: the baseline's torque stays near what was measured."""
        model = self.judge.case.model
        segments = list(prepare(motion.recording("next"), model.preparation))
        tau = [model.torque(Motion.of(segment)).numpy() for segment in segments]
        return all(bool((np.abs(x).max(axis=0) <= HARDER * self.rig.tau).all()) for x in tau)

    def able(self, motions: list[Proposed]) -> list[Planned]:
        """Return those of `motions` that the drives can do."""
        return self.judge.planned([m for m in motions if self._strong_enough(m)])

    def gain(self, one: Planned, often: int = 1) -> Array:
        """Return the lambda^2 (members, members) that recording a motion so often adds."""
        return np.maximum(self.judge.apart(self.H + often * one.G) - self.before, 0.0)

    def chance(self, one: Planned, often: int) -> float:
        """Return the chance that recording a motion so often settles the matter."""
        return self.judge.chance(self.gain(one, often), often * one.rows)

    def ranked(self, motions: list[Planned]) -> list[Planned]:
        """Return the motions, the one that tells the closest pair best first."""
        return sorted(motions, key=lambda one: -least_pair(self.gain(one)))


@one_thread()
def next_experiment(race: Race, case: Case, believed: StripTheory, seed: int = 0, rig: Rig | None = None) -> Proposal | None:
    """Return the motion that would settle the first ambiguous finding of a finished race; None where nothing is ambiguous or moves.

    `believed` is what unsettled instruments read (`Found.believed`); `rig` are the limits of the rig, by default what it has shown.
    """
    contest = contest_of(race)
    segments = [s for unit in case.all_units if not unit.steady for s in unit.segments() if s.tau is not None and s.keep.any()]
    if contest is None or not segments:
        return None
    judge, rng, arm = Judge(case, race, believed, contest), np.random.default_rng(seed), case.model.arm
    limits, rate, H = rig or Rig.of(segments), 1 / float(np.median([s.dt for s in segments])), judge.recorded()
    planner = _Planner(judge, limits, H, judge.apart(H))
    drawn = planner.ranked(planner.able(draw(limits, arm, rate, DRAWN, rng)))
    if not drawn:
        return None
    better = planner.able(varied([one.motion for one in drawn[:BEST]], limits, arm, rate, BETTERED, rng))
    best = planner.ranked([drawn[0], *better])[0]
    often = next((n for n in range(1, MOST) if planner.chance(best, n) >= ENOUGH), MOST)
    usual = float(np.median([planner.chance(one, often) for one in drawn]))
    return Proposal(contest, best.motion, often, least_pair(planner.gain(best, often)) / 2, planner.chance(best, often), usual, arm)
