"""What no finding explains: whether it is there, what it depends on, a hum, the nearest cards, and a formula as a suggestion."""

from dataclasses import dataclass
from typing import Any, final

from nnhydro.diagnosis.lines import TESTS, Line, strongest
from nnhydro.diagnosis.locks import P_BLOCK, family_wise_p
from nnhydro.diagnosis.naming import Named
from nnhydro.diagnosis.nearest import Near, nearest
from nnhydro.diagnosis.proof import Proof
from nnhydro.diagnosis.suggestion import Suggestion, suggested
from nnhydro.diagnosis.unknown import Learned, learned

ABOVE = 1.5  # of the noise: an error from which something systematic may be said to remain,
CLEARLY = 0.25  # or R2 of the learner at one joint: what the larger torques of another one hide in the error over all


@final
@dataclass(frozen=True)
class Remainder:
    """What is left beside the findings; `learned` has one entry a joint, none where there is nothing to learn."""

    detected: bool
    share: float  # error that remains
    learned: tuple[Learned, ...] = ()
    lines: tuple[Line, ...] = ()
    nearest: tuple[Near, ...] = ()
    suggestions: tuple[Suggestion, ...] = ()

    def document(self) -> dict[str, Any]:
        """Return what diagnosis.json holds as unexplained."""
        on = {x for one in self.learned if one.real for x in one.depends_on} | {"frequency" for _ in self.lines}
        return {"detected": self.detected, "share": self.share, "depends_on": sorted(on), "lines": [line.sentence() for line in self.lines],
                "predictable": [round(max(one.r2, 0.0), 3) for one in self.learned],
                "nearest": [one.document() for one in self.nearest],
                "suggestions": [one.document() for one in self.suggestions]}


def mismatch_p(found_p: float, rest: Remainder) -> float:
    """Return the p of "nothing is missing": by the search, by lines in the spectrum, by what a learner clearly predicts."""
    clear = [len(rest.learned) * one.p_value for one in rest.learned if one.real and one.r2 >= CLEARLY]
    return min([found_p, *(TESTS * line.p_value for line in rest.lines), *clear])


def _learned(proof: Proof, seed: int, block_test_open: bool) -> tuple[Learned, ...]:
    """What a learner predicts; where no block test saw anything only what it predicts clearly, as of a law that resembles no card."""
    if block_test_open:
        return tuple(learned(proof.remains, seed))
    clear = any(one.real and one.r2 >= CLEARLY for one in learned(proof.remains, seed, explain=False))
    return tuple(learned(proof.remains, seed)) if clear else ()


def remainder(told: Named, proof: Proof, noise_error: float, seed: int) -> Remainder:
    """Return what the findings of `told` leave, by its `proof`; `noise_error` is the error that noise alone would leave."""
    found, race = told.found, told.found.race
    left = max(family_wise_p(race, seed + 1), found.p_value)
    rest = _learned(proof, seed, left <= P_BLOCK)
    lines = tuple(line for joint in range(len(race.noise)) if (line := strongest(proof.remains, joint)) and line.material)
    real = [one for one in rest if one.real]
    loud = left <= P_BLOCK and proof.after > ABOVE * noise_error and (not told.findings or bool(real))
    systematic = loud or any(one.r2 >= CLEARLY for one in real)
    joints = [one.joint for one in real] or list(range(1, len(race.noise) + 1))
    offered = [suggested(race, found.table, found.believed, one, seed) for one in real] if systematic else []
    return Remainder(systematic or bool(lines), proof.after, rest, lines, tuple(nearest(race, joints, seed)) if systematic else (),
                     tuple(one for one in offered if one is not None))
