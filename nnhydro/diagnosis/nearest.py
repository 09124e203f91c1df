"""The cards that come nearest to what no finding explains, and what keeps each of them out, in a sentence."""

from dataclasses import dataclass
from typing import Any, final

from nnhydro.diagnosis.bank import Candidate
from nnhydro.diagnosis.locks import MATERIAL, P_BLOCK, family_wise_p, first_lock_p, left_out_p, material, opens
from nnhydro.diagnosis.race import Race, ranked
from nnhydro.diagnosis.tournament import LEAST_OF_FIRST

SHOWN = 2  # cards a joint


@final
@dataclass(frozen=True)
class Near:
    """A card, the score that it gains beside what is found, and why it is not said."""

    effect: str
    joint: int
    gain: float
    why: str

    def sentence(self) -> str:
        """Return it in words."""
        return f"{self.effect}{f' at joint {self.joint}' if self.joint else ''}: {self.why}"

    def document(self) -> dict[str, Any]:
        """Return it for diagnosis.json."""
        return {"effect": self.effect, "joint": self.joint or None, "gain": round(self.gain, 2), "why": self.why}


def _why(race: Race, candidate: Candidate, gain: float, p_block: float) -> str:
    """What keeps `candidate` out: the first of the locks that stays shut, in the order of the search."""
    before, after = race.scored(), race.scored([candidate])
    p_one, share = first_lock_p(candidate, gain, p_block), material(before, after)
    if p_one > P_BLOCK:
        return f"what it explains may be chance (p = {p_one:.2g} over all that was tried)"
    if not opens(before.by_unit - after.by_unit):
        return f"it does not predict left-out recordings better (p = {left_out_p(before, after):.2g})"
    if share < MATERIAL:
        return f"it explains only {100 * max(share, 0.0):.1f} % of what remains"
    if gain < LEAST_OF_FIRST * race.first_gain:
        return "it adds too little beside what was found: as much may be left by a finding of slightly other form"
    return "it was taken back: what it adds fades beside looser findings or at another cut-off, or explains too little of the whole"


def nearest(race: Race, joints: list[int], seed: int) -> list[Near]:
    """Return for each of `joints` the candidates that gain most beside what is chosen, with what keeps them out."""
    order = [(gain, c) for gain, c in ranked(race, race.bank.candidates) if gain > 0]
    p_block = family_wise_p(race, seed)
    found: dict[tuple[str, int], Near] = {}
    for joint in joints:
        for gain, c in [(gain, c) for gain, c in order if c.key[1] in (0, joint)][:SHOWN]:
            found.setdefault(c.key, Near(*c.key, gain, _why(race, c, gain, p_block)))
    return sorted(found.values(), key=lambda one: -one.gain)
