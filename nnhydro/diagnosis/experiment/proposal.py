"""The next experiment: the motion that best separates the members of an equivalence set; as a file ready to run.

    max over feasible motions  of the chance that every wrong member leaves the class               (`discrimination`)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from nnhydro.diagnosis.experiment.discrimination import DiscriminationProblem, Discriminator, PlannedMotion, discrimination_of
from nnhydro.diagnosis.experiment.motions import CandidateMotion, draw, neighbours
from nnhydro.diagnosis.experiment.rig_limits import Limits, Rig
from nnhydro.diagnosis.noise.spectrum import Noise
from nnhydro.diagnosis.problem.problem import Problem
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment
from nnhydro.runtime.files import write_text

DRAWN, BETTERED = 60, 30  # motions drawn at first, and in the neighbourhood of the best
BEST = 5  # best motions whose neighbourhood is searched
FEWEST, MOST = 3, 6  # fewest and most repeats of a proposed motion: no other recording confirms what a single one shows
TARGET_CHANCE = 0.9  # chance of telling the causes apart from which no further repeat is asked for
POOR_CHANCE = 0.5  # chance below which a motion is called unlikely to tell the causes apart


@final
@dataclass(frozen=True, eq=False)
class Proposal:
    """The motion to record next, how often, and the probability of a decision."""

    task: DiscriminationProblem
    motion: CandidateMotion
    recordings: int
    gain: float  # expected log evidence between the two members that stay closest, nats
    chance: float  # that all wrong members leave the class
    usual: float  # the same for the median of the motions drawn at random
    arm: Arm
    stated: bool = False  # whether the rig's limits are stated, not only shown

    def document(self, file: str | None = None) -> dict[str, Any]:
        """Return what diagnosis.json holds as next_experiment; `file` is where the motion was written."""
        members = [{"effect": effect, "joint": joint or None} for effect, joint in self.task.keys]
        return {"separates": members, "motion": self.motion.document, "seconds": float(self.motion.t[-1]), "recordings": self.recordings,
                "expected_gain": self.gain, "chance": self.chance, "chance_of_a_random_motion": self.usual, "file": file,
                "statement": self.statement()}

    def statement(self) -> str:
        """Return the proposal in one sentence."""
        first, *others = (effect + (f" at joint {joint}" if joint else "") for effect, joint in self.task.keys)
        often = "once" if self.recordings == 1 else f"{self.recordings} times"
        motion = f"the proposed {self.motion.document['kind']} motion ({self.motion.t[-1]:.1f} s)"
        if self.chance < POOR_CHANCE:
            within = "the limits of this rig" if self.stated else "the ranges of these recordings"
            return (f"Within {within} no motion is likely to distinguish {first} from {', '.join(others)}: {motion}, recorded "
                    f"{often}, decides with a probability of {100 * self.chance:.0f} %.")
        return (f"To distinguish {first} from {', '.join(others)}, record {motion} {often}: it decides with a probability of "
                f"{100 * self.chance:.0f} % (a motion drawn at random: {100 * self.usual:.0f} %).")

    def write(self, path: Path) -> None:
        """Write the motion as a CSV file in the columns of a recording without torques, whole or not at all."""
        columns = self.motion.columns(self.arm)
        rows = (",".join(f"{x:.9g}" for x in row) for row in np.column_stack(list(columns.values())) + 0.0)
        write_text(path, "\n".join([",".join(columns), *rows]) + "\n")


def shown_by(problem: Problem) -> list[Segment]:
    """Return the moving segments with torques: what a rig has shown it can do."""
    segments = [stretch.segment for stretch in problem.stretches]
    return [segment for segment in segments if not segment.steady and segment.tau is not None and segment.keep.any()]


def motions_at_random(problem: Problem, model: StripTheory, rate_hz: float, count: int, seed: int,
                      limits: Limits | None = None) -> list[CandidateMotion]:
    """Return `count` motions drawn at random within the limits of the rig: what a proposal is to be compared with."""
    rng, rig = np.random.default_rng([seed, 1]), Rig.of(shown_by(problem)).with_limits(limits)
    found = list[CandidateMotion]()
    for _ in range(10):
        for motion in draw(rig, problem.arm, rate_hz, 3 * count, rng):
            if bool((np.abs(model.torque(Motion.of(motion.segment("next", rate_hz))).numpy()).max(axis=0) <= rig.tau).all()):
                found.append(motion)
        if len(found) >= count:
            break
    return found[:count]


def _merit(discriminator: Discriminator, motion: PlannedMotion, often: int) -> tuple[float, float]:
    """The order of motions, each recorded that often: the chance of a decision, then the evidence between the closest pair."""
    return round(discriminator.chance(motion, often), 2), _least_pair(discriminator, motion, often)


def _least_pair(discriminator: Discriminator, motion: PlannedMotion, often: int) -> float:
    margin = discriminator.expected_gain(motion, often)[1]
    return float(margin[~np.eye(len(margin), dtype=bool)].min())


def _choose(discriminator: Discriminator, tried: Sequence[PlannedMotion]) -> tuple[PlannedMotion, int]:
    """The motion that most likely decides, and the smallest sufficient number of its recordings."""
    for often in range(FEWEST, MOST):
        motion = max(tried, key=lambda x: _merit(discriminator, x, often))
        if discriminator.chance(motion, often) >= TARGET_CHANCE:
            return motion, often
    return max(tried, key=lambda x: _merit(discriminator, x, MOST)), MOST


def next_experiment(search: Search, noise: Noise, claimed: ScoredSet, model: StripTheory, rate_hz: float, seed: int,
                    limits: Limits | None = None) -> Proposal | None:
    """Return the motion that would settle the first ambiguous finding of `claimed`; None where nothing is ambiguous or moves.

    `model` gives what instruments read; `rate_hz` is that of the motion's file; `limits` are those of the rig that its user states, the
    others are taken from what it has shown. Raises ConfigError where they do not fit the arm.
    """
    problem = search.view.library.design.problem
    task, segments = discrimination_of(search, claimed), shown_by(problem)
    if task is None or not segments:
        return None
    discriminator, rng = Discriminator(search, noise, model, task), np.random.default_rng(seed)
    rig = Rig.of(segments).with_limits(limits)
    drawn = discriminator.feasible(draw(rig, problem.arm, rate_hz, DRAWN, rng), rig.tau)
    if not drawn:
        return None
    first = sorted(drawn, key=lambda motion: _merit(discriminator, motion, MOST), reverse=True)[:BEST]
    near = neighbours([planned.motion for planned in first], rig, problem.arm, rate_hz, BETTERED, rng)
    best, often = _choose(discriminator, [*first, *discriminator.feasible(near, rig.tau)])
    usual = float(np.median([discriminator.chance(motion, often) for motion in drawn]))
    margin, chance = _least_pair(discriminator, best, often), discriminator.chance(best, often)
    return Proposal(task, best.motion, often, margin, chance, usual, problem.arm, rig.stated)
