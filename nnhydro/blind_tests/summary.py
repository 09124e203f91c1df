"""Sum up the verdicts of a suite: shares by group, parameters, intervals, confidence, unseen motions, confusion table."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from nnhydro.blind_tests.scoring import Verdict
from nnhydro.blind_tests.truth.partial_causes import PARTS

SCHEMA = "nnhydro/score/2"
CONFIDENT = 0.9  # findings said with at least this confidence must be right as often
OVERLAP, MOMENT = 0.6, 0.5  # overlap of regions, and s, from which on a part or a moment counts as told
WORSE = 1.02  # an unseen error that has grown by more than 2 % is a case made worse
COUNT = {1: "one effect", 2: "two effects", 3: "three effects"}


def _share(values: Sequence[bool]) -> float | None:
    return float(np.mean(values)) if values else None


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _is_effect(count: int, strength: str, v: Verdict) -> bool:
    return v.kind == "effect" and len(v.truth) == count and v.strength == strength


def _in_part(part: str, v: Verdict) -> bool:
    return v.part == part


def _placement_rows(verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """How well diagnoses say when and where effects act; an effect without a name counts as missed."""
    local = [verdict for verdict in verdicts if verdict.part != "always"]
    moments = [verdict.placed.moment_error_s if verdict.placed else None for verdict in local if verdict.part == "onset"]
    near = [error for error in moments if error is not None]
    overlaps = [verdict.placed.overlap if verdict.placed else 0.0 for verdict in local]
    return {"campaigns": len(local), "overlap": _median(overlaps), "overlapping": _share([x >= OVERLAP for x in overlaps]),
            "moments": len(moments), "moment_error_s": _median(near),
            "moment_told": _share([e is not None and e <= MOMENT for e in moments]),
            "confined_wrongly": sum(verdict.confined for verdict in verdicts)}


def groups(verdicts: Sequence[Verdict]) -> list[tuple[str, list[Verdict]]]:
    """Return the groups that have members, in the order of the targets."""
    tests: list[tuple[str, Callable[[Verdict], bool]]] = [("healthy", lambda v: v.kind == "none"),
                                                          ("baseline slightly wrong in form", lambda v: v.kind == "base_form")]
    for count, words in COUNT.items():
        for strength in ("strong", "weak"):
            tests.append((f"{words}, {strength}", partial(_is_effect, count, strength)))
    tests.append(("of these in the usual shape", lambda v: v.kind == "effect" and not v.other_shape))
    tests.append(("of these in another shape", lambda v: v.kind == "effect" and v.other_shape))
    for part in PARTS:
        tests.append((f"of these acting in a part: {part}", partial(_in_part, part)))
    tests.append(("unlisted", lambda v: v.kind == "unlisted"))
    found = [(name, [v for v in verdicts if test(v)]) for name, test in tests]
    return [(name, members) for name, members in found if members]


def _group(name: str, members: Sequence[Verdict]) -> dict[str, Any]:
    """Shares and medians of one group of verdicts."""
    listed = members[0].kind == "effect"
    quiet = members[0].kind == "none"
    return {"group": name, "campaigns": len(members),
            "right": _share([verdict.right and not (quiet and verdict.alarm) for verdict in members]),
            "exact": _share([verdict.exact for verdict in members]) if listed else None,
            "family": _share([verdict.family for verdict in members]) if listed else None,
            "joint": _share([verdict.joint for verdict in members if verdict.class_sizes]) if listed else None,
            "detected": _share([verdict.detected for verdict in members]),
            "alarm": _share([verdict.alarm for verdict in members]),
            "wrong_claim": _share([verdict.false_claims > 0 for verdict in members]),
            "false_claims": sum(verdict.false_claims for verdict in members),
            "error_before": _median([verdict.error_before for verdict in members if verdict.error_before is not None]),
            "error_after": _median([verdict.error_after for verdict in members if verdict.error_after is not None])}


def _prediction_rows(verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """How well unseen motions are predicted, and what share of the improvement that the truth itself would make, for hidden effects.

    The median is over the campaigns in which the truth is better than the baseline, the pooled share over all, whatever it is there.
    """
    both = [(verdict, verdict.error_before, verdict.error_after) for verdict in verdicts
            if verdict.error_before is not None and verdict.error_after is not None]
    effects = [(before, after, verdict.error_true) for verdict, before, after in both if verdict.kind == "effect" and before > 0]
    known = [(before, after, true) for before, after, true in effects if true is not None]
    shares = [(before - after) / (before - true) for before, after, true in known if before > true]
    possible = sum(before - true for before, _, true in known)
    return {"campaigns": len(both), "median_before": _median([b for _, b, _ in both]), "median_after": _median([a for _, _, a in both]),
            "share_of_error": _median([1 - after / before for before, after, _ in effects]),
            "of_the_truth": {"campaigns": len(known), "better_than_baseline": len(shares), "share": _median(shares),
                             "pooled": sum(before - after for before, after, _ in known) / possible if possible > 0 else None,
                             "median_true": _median([true for _, _, true in known]),
                             "median_after": _median([after for _, after, _ in known])},
            "made_worse": _share([after > WORSE * before for _, before, after in both])}


def confusion(verdicts: Sequence[Verdict]) -> dict[str, dict[str, int]]:
    """Return for every hidden effect how often which name was given."""
    counts = Counter(pair for verdict in verdicts for pair in verdict.pairs)
    return {hidden: {named: n for (h, named), n in counts.most_common() if h == hidden} for hidden in sorted({h for h, _ in counts})}


def summary(verdicts: Sequence[Verdict], missing: Sequence[str]) -> dict[str, Any]:
    """Return the score as a JSON document."""
    numbers = [p for verdict in verdicts for p in verdict.parameters]
    confident = [ok for verdict in verdicts for confidence, ok in verdict.claims if confidence >= CONFIDENT]
    sizes = [n for verdict in verdicts for n in verdict.class_sizes]
    return {"schema": SCHEMA, "scored": len(verdicts), "missing": list(missing), "groups": [_group(*group) for group in groups(verdicts)],
            "class_size": float(np.mean(sizes)) if sizes else None,
            "parameters": {"compared": len(numbers),
                           "median_error": _median([parameter.error for parameter in numbers if parameter.error is not None]),
                           "coverage": _share([parameter.covered for parameter in numbers if parameter.covered is not None])},
            "confidence": {"threshold": CONFIDENT, "claims": len(confident), "right": _share(confident)},
            "unseen": _prediction_rows(verdicts), "placed": _placement_rows(verdicts),
            "median_seconds": _median([verdict.seconds for verdict in verdicts if verdict.seconds is not None]),
            "confusion": confusion(verdicts), "campaigns": [asdict(v) for v in verdicts]}
