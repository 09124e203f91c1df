"""Score where and when a claim lets its effect act, against the answer of a campaign in which it acts in a part only.

    overlap   |claimed and true| / |claimed or true|, of recordings, or of a sector of a joint's angles     (Jaccard)
    moment    |claimed - true| s, where the effect begins within a recording and the claim names a moment in the same one
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final


@final
@dataclass(frozen=True)
class PlacementError:
    """What was said of when or where a hidden effect acts: overlap 0 to 1, and the error of the moment (None: none was named there)."""

    kind: str
    overlap: float
    moment_error_s: float | None = None


def number(value: Any) -> float | None:
    """The value as a finite number, None where it is none: a diagnosis may come from anybody's program."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e300:
        return None
    return float(value)


def _names(acts: dict[str, Any], names: Sequence[str]) -> set[str]:
    """The recordings in which an effect acts."""
    if isinstance(acts.get("recordings"), list):
        return {str(name) for name in acts["recordings"]} & set(names)
    place = {name: k for k, name in enumerate(names)}
    first, last = place.get(str(acts.get("since")), 0), place.get(str(acts.get("until")), len(names) - 1)
    return set(names[first:last + 1])


def _sector(claimed: Any, true: dict[str, Any]) -> float:
    """Overlap of two sectors; one that is open to a side ends where the other does there."""
    if not isinstance(claimed, dict) or claimed.get("joint") != true["joint"]:
        return 0.0
    a, b = float(true["low_rad"]), float(true["high_rad"])
    low, high = (fallback if (x := number(claimed.get(key))) is None else x for key, fallback in (("low_rad", a), ("high_rad", b)))
    both, either = min(b, high) - max(a, low), max(b, high) - min(a, low)
    return max(both, 0.0) / either if either > 0 else 0.0


def placement_error(true: dict[str, Any], claimed: Any, recordings: int) -> PlacementError:
    """Return how well `claimed` (a finding's "acts", None where it always acts) tells where the effect of an answer acts."""
    acts = claimed if isinstance(claimed, dict) else {}
    if true["region"] is not None:
        return PlacementError(true["kind"], _sector(acts.get("region"), true["region"]))
    names = [f"run_{k + 1:02d}" for k in range(recordings)]
    said, right = _names(acts, names), set(true["recordings"])
    at, there = number(acts.get("since_s")), true["moment_s"] is not None and acts.get("since") == true["moment_in"]
    error = abs(at - float(true["moment_s"])) if there and at is not None else None
    return PlacementError(true["kind"], len(said & right) / len(said | right), error)
