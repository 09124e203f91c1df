"""Score one diagnosis against one answer.

A claim is a finding of diagnosis.json. It fits a hidden effect if it names it, or if its class of at most three names holds it. Every
hidden effect takes at most one claim; a claim left over is false. Where nothing of the catalogue is hidden every claim is false, except
names that the answer calls near (a baseline that is wrong in form may be called drag_form).

    right    every hidden effect has its claim and none is left over        exact    right, and every claim names its effect
    family   every hidden effect has a claim of its family                  joint    every claim that fits names the right joint
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from nnhydro.blind_tests.scoring_windows import PlacementError, number, placement_error
from nnhydro.errors import ConfigError

HONEST = 3  # names: a longer class says too little


@final
@dataclass(frozen=True)
class Claim:
    """One finding, as far as the score needs it."""

    effect: str
    family: str | None
    names: tuple[str, ...]
    joint: int | None
    confidence: float
    parameters: dict[str, Any]
    acts: Any = None  # when or where, None: always

    def fits(self, effect: str) -> bool:
        """Return whether the claim names `effect`, or an honest class that holds it."""
        return effect == self.effect or (effect in self.names and len(self.names) <= HONEST)


@final
@dataclass(frozen=True)
class ScoredParameter:
    """One number said by a claim beside the true one: relative error, and whether the interval holds the truth (None: no interval)."""

    effect: str
    name: str
    error: float | None
    covered: bool | None


@final
@dataclass(frozen=True)
class Verdict:
    """The score of one diagnosis; errors of unseen motions are sum|error| / sum|torque|, None where nothing was predicted."""

    campaign: str
    kind: str
    strength: str | None
    truth: tuple[str, ...]
    other_shape: bool
    named: tuple[str, ...]
    detected: bool
    right: bool
    exact: bool
    family: bool
    joint: bool
    false_claims: int
    class_sizes: tuple[int, ...]
    claims: tuple[tuple[float, bool], ...]  # confidence, correct
    pairs: tuple[tuple[str, str], ...]  # hidden, named: rows of the confusion table
    alarm: bool  # something was said or noticed, right or wrong
    parameters: tuple[ScoredParameter, ...] = ()
    rivals: tuple[dict[str, float], ...] = ()  # of every hidden effect: nearest other names, with the lambda that tells them apart
    limit: float | None = None  # the lambda from which on the campaign reveals something
    seconds: float | None = None
    error_before: float | None = None
    error_after: float | None = None
    error_true: float | None = None  # of the truth itself, given the motions as they were recorded
    notes: tuple[str, ...] = field(default=())
    part: str = "always"  # in what part of the campaign the effect acts
    placed: PlacementError | None = None  # how well that was told, where the effect was named
    confined: bool = False  # whether a claim that fits is confined to a part though its effect always acts


def _text(value: Any) -> str | None:
    if value is not None and not isinstance(value, str):
        raise TypeError(f"{value!r:.60} is not text")
    return value


def claims_of(diagnosis: Any, where: str) -> tuple[Claim, ...]:
    """Return the findings of a diagnosis.json; raise ConfigError naming what is missing."""
    try:
        return tuple(Claim(str(f["effect"]), _text(f.get("family")), tuple(map(str, f.get("class") or [f["effect"]])),
                           None if f.get("joint") is None else int(f["joint"]), float(f.get("confidence", 1.0)),
                           dict(f.get("parameters") or {}), f.get("acts")) for f in diagnosis["findings"])
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as cause:
        raise ConfigError(f"{where}: is not a diagnosis ({type(cause).__name__}: {cause}): "
                          "findings need effect, class, joint, confidence") from cause


def match_claims(truth: Sequence[str], claims: Sequence[Claim]) -> list[int | None]:
    """Return for every hidden effect which claim fits it, exact names first; each claim is used once."""
    result: list[int | None] = [None] * len(truth)
    for exact in (True, False):
        for k, effect in enumerate(truth):
            free = [c for c in range(len(claims)) if c not in result]
            fit = [c for c in free if (claims[c].effect == effect if exact else claims[c].fits(effect))]
            if result[k] is None and fit:
                result[k] = fit[0]
    return result


def _numbers(entry: dict[str, Any], claim: Claim) -> list[ScoredParameter]:
    """The claim's parameters beside the true ones: by name, else by a unit that occurs once on either side."""
    made = []
    for name, true in entry["parameters"].items():
        said = claim.parameters.get(name)
        if said is None:
            mine = [n for n, v in entry["parameters"].items() if v["unit"] == true["unit"]]
            theirs = [v for v in claim.parameters.values() if isinstance(v, dict) and v.get("unit") == true["unit"]]
            said = theirs[0] if len(mine) == len(theirs) == 1 and true["unit"] != "1" else None
        found = number(said.get("value")) if isinstance(said, dict) else None
        if not isinstance(said, dict) or found is None:
            continue
        value, angle = float(true["value"]), name == "direction"
        off = found - value
        if angle:
            turns = 2 * np.pi * round(off / (2 * np.pi))
            value, off = value + turns, off - turns
        ci = said.get("ci95")
        ends = [end for end in map(number, ci) if end is not None] if isinstance(ci, list) else []
        inside = bool(min(ends) <= value <= max(ends)) if len(ends) == 2 else None
        made.append(ScoredParameter(entry["effect"], name, None if angle or value == 0 else abs(off / value), inside))
    return made


def _near(entries: Sequence[dict[str, Any]], claim: Claim) -> bool:
    return any(claim.fits(name) for entry in entries for name in entry["near"])


def _says_detected(diagnosis: dict[str, Any], key: str) -> bool:
    part = diagnosis.get(key)
    return bool(part.get("detected", False)) if isinstance(part, dict) else False


def _pairs(answer: dict[str, Any], truth: Sequence[str], claims: Sequence[Claim], match: Sequence[int | None],
           ) -> tuple[tuple[str, str], ...]:
    """Rows of the confusion table: every hidden effect with its claim, else with one that fits nothing, else with "nothing"."""
    spare = [claim.effect for c, claim in enumerate(claims) if c not in match]
    pairs = []
    for effect, c in zip(truth, match, strict=True):
        pairs.append((effect, claims[c].effect if c is not None else spare.pop(0) if spare else "nothing"))
    hidden = "nothing" if truth or not answer["effects"] else str(answer["effects"][0]["effect"])
    pairs += [(hidden, named) for named in spare]
    return tuple(pairs) or ((hidden, "nothing"),)


def score(campaign: str, answer: dict[str, Any], diagnosis: dict[str, Any], where: str) -> Verdict:
    """Return the verdict on `diagnosis` (the document in the file `where`), without the errors of unseen motions."""
    claims, entries, listed = claims_of(diagnosis, where), answer["effects"], answer["kind"] == "effect"
    truth = tuple(entry["effect"] for entry in entries) if listed else ()
    match = match_claims(truth, claims)
    correct = [c in match or (not listed and _near(entries, claim)) for c, claim in enumerate(claims)]
    fitting = [(entry, claims[c]) for entry, c in zip(entries, match, strict=False) if c is not None]
    plain = [(entry, claim) for entry, claim in fitting if entry["shape"] == "plain" and claim.effect == entry["effect"]]
    right, families = all(correct) and None not in match, {claim.family for claim in claims}
    detected = _says_detected(diagnosis, "mismatch")
    local = next((entry for entry in entries if entry.get("acts")), None)
    mine = [claim for entry, claim in fitting if entry is local]
    place = placement_error(local["acts"], mine[0].acts, answer["recordings"]) if local is not None and mine else None
    return Verdict(
        campaign=campaign, kind=answer["kind"], strength=answer["strength"], truth=tuple(entry["effect"] for entry in entries),
        other_shape=any(entry["shape"] == "other" for entry in entries), named=tuple(claim.effect for claim in claims), detected=detected,
        right=right, exact=right and all(claim.effect == entry["effect"] for entry, claim in fitting),
        family=listed and all(entry["family"] in families for entry in entries),
        joint=bool(fitting) and all(claim.joint == entry["joint"] for entry, claim in fitting),
        false_claims=correct.count(False), class_sizes=tuple(len(claim.names) for _, claim in fitting),
        claims=tuple((claim.confidence, ok) for claim, ok in zip(claims, correct, strict=True)), pairs=_pairs(answer, truth, claims, match),
        alarm=detected or bool(claims) or _says_detected(diagnosis, "unexplained"),
        parameters=tuple(value for entry, claim in plain for value in _numbers(entry, claim)),
        rivals=tuple(entry.get("rivals", {}) for entry in entries), limit=answer.get("limit"),
        seconds=number(diagnosis.get("seconds")), part="always" if local is None else local["acts"]["kind"],
        placed=place, confined=any(claim.acts is not None for entry, claim in fitting if not entry.get("acts")))
