"""Judge a diagnosis by the card of its machine; nothing of the package.

right: every hidden effect is named, and nothing else. half: a part of them, or a name that is half right. alarm: a mismatch without a name.
silent: neither. wrong: a name that is not true. A healthy machine is healthy-ok, healthy-detected (an alarm) or healthy-named.
"""

import re
from typing import Any

Row = dict[str, Any]
UNITS = {"": "1", "-": "1", "nm/(rad/s)": "nms/rad", "nms": "nms/rad", "periods/rev": "1/rev"}


def at_joint(name: str, joint: int | None) -> tuple[str, int | None]:
    """Return effect and joint of a name such as torque_bias or torque_bias@2; without a joint it is `joint`."""
    effect, _, own = name.partition("@")
    return effect, int(own) if own else joint


def same_joint(one: int | None, other: int | None) -> bool:
    """Return whether two joints agree; None is any joint."""
    return one is None or other is None or one == other


def effects_of(finding: Row) -> set[str]:
    """Return the effects that a finding names, those included that cannot be told from it."""
    return {finding["effect"], *(finding.get("class") or [])}


def names_answer(finding: Row, answer: Row) -> bool:
    """Return whether a finding names a hidden effect, or one that is as right."""
    names = (at_joint(name, answer["joint"]) for name in (answer["effect"], *answer["accept"]))
    return any(effect in effects_of(finding) and same_joint(joint, finding.get("joint")) for effect, joint in names)


def names_half(finding: Row, answer: Row) -> bool:
    """Return whether a finding is half right about a hidden effect."""
    names = (at_joint(name, answer["joint"]) for name in answer["partial"])
    return any(effect == finding["effect"] and same_joint(joint, finding.get("joint")) for effect, joint in names)


def tolerated(finding: Row, card: Row) -> bool:
    """Return whether a finding counts neither for nor against."""
    names = (at_joint(name, None) for name in card["tolerated"])
    return any(effect in effects_of(finding) and same_joint(joint, finding.get("joint")) for effect, joint in names)


def is_alarm(document: Row) -> bool:
    """Return whether a mismatch, or a rest that no finding explains, is detected."""
    return any((document.get(part) or {}).get("detected") for part in ("mismatch", "unexplained"))


def verdict(card: Row, document: Row) -> str:
    """Return the verdict on what diagnosis.json says of a machine."""
    findings, answers, alarm = document.get("findings") or [], card["answers"], is_alarm(document)
    ignored = {at_joint(name, None)[0] for name in card["tolerated"]}
    named = [f for f in findings if f["effect"] not in ignored]
    if card["healthy"]:
        return "healthy-named" if named else "healthy-detected" if alarm else "healthy-ok"
    if card["nameless"]:
        return "wrong" if named else "half" if findings else "right" if alarm else "silent"
    true = [[a for a in answers if names_answer(f, a)] for f in findings]
    half = [[a for a in answers if names_half(f, a)] for f in findings]
    if any(not (t or h or tolerated(f, card)) for f, t, h in zip(findings, true, half, strict=True)):
        return "wrong"
    if {a["effect"] for a in answers} <= {a["effect"] for found in true for a in found}:
        return "right"
    return "half" if any(true) or any(half) else "alarm" if alarm else "silent"


def missing(card: Row, findings: list[Row]) -> list[str]:
    """Return the hidden effects, as effect@joint, that no finding names; the verdict counts effects, not joints."""
    return [f"{a['effect']}@{a['joint']}" for a in card["answers"] if not any(names_answer(f, a) for f in findings)]


def plain(unit: str | None) -> str:
    """Return a unit in one way of writing."""
    text = re.sub(r"[\s*·.^]", "", (unit or "").lower()).replace("²", "2")
    return UNITS.get(text, text)


def beside_truth(card: Row, finding: Row) -> list[Row]:
    """Return the values of a finding beside the truth, matched by unit, then by name, and whether the 95 % interval holds it."""
    out = []
    for answer in card["answers"]:
        if answer["effect"] != finding["effect"] or not same_joint(answer["joint"], finding.get("joint")):
            continue
        left = {k: p for k, p in (finding.get("parameters") or {}).items() if isinstance(p, dict) and p.get("value") is not None}
        for name, truth in answer["values"].items():
            near = [k for k, p in left.items() if plain(p.get("unit")) == plain(truth["unit"])]
            if not near:
                continue
            key = next((k for k in near if name[:4] in k), near[0])
            said = left.pop(key)
            low, high = said.get("ci95") or (None, None)
            holds = None if low is None or high is None else low <= truth["value"] <= high
            out.append({"effect": finding["effect"], "joint": finding.get("joint"), "parameter": key, "unit": truth["unit"],
                        "truth": truth["value"], "value": said["value"], "ci95": [low, high], "holds": holds})
    return out


def judged(card: Row, document: Row) -> Row:
    """Return what is known and what was said of one machine, and the verdict."""
    findings = document.get("findings") or []
    said = [{k: f.get(k) for k in ("effect", "joint", "class", "level", "confidence")} for f in findings]
    mismatch, proof = document.get("mismatch") or {}, document.get("proof") or {}
    return {"verdict": verdict(card, document), "said": said, "missing": missing(card, findings) if said else [],
            "values": [value for f in findings for value in beside_truth(card, f)],
            "detected": mismatch.get("detected"), "unexplained": (document.get("unexplained") or {}).get("detected"),
            "error_before": mismatch.get("error"), "error_after": proof.get("error_after"), "noise_floor": mismatch.get("noise_floor"),
            "seconds": document.get("seconds"), "versions": document.get("versions")}
