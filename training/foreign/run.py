"""Diagnose campaigns of another author and score the answers: `python training/foreign/run.py FOLDER OUT [FIRST:LAST:STEP] [HOW]`.

FOLDER holds case_NNN/ (campaigns), answers.json ({case: {"style", "hidden": [{"effect", "joint"}]}}) and truth_of_unseen/. A hidden effect
may also `accept` names that its author finds as right, and act in a `part` of the campaign. A campaign is exact if every hidden effect is
named, or lies in a class of at most three, at its joint, a part is claimed where there is one, and nothing else is said. What is diagnosed
already in OUT is not diagnosed again. OUT/results.json holds one row per campaign and the summary. `run.py table` prints the
table of README.md from the results stored here. HOW is

    family-out           the family of what is hidden is taken out of the catalogue: whatever is named is wrong then, and only campaigns
                         that hide something are diagnosed
    rates-of-a-logger    the rates are backward differences of the angles behind a low-pass filter of one sample; no accelerations
"""

import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

ALIKE = {"load_friction": {"coulomb_friction"}, "stribeck_friction": {"coulomb_friction"}, "backlash": {"joint_elasticity"}}
STORED = {"77 campaigns": "results_77.json", "24 by a sixth author": "results_24.json", "20 by a seventh": "results_20.json",
          "28 by an eighth": "results_28.json", "32 by a ninth": "results_32.json", "36 by a tenth": "results_36.json",
          "36 by an eleventh": "results_36_eleventh.json", "34 by a twelfth": "results_34.json",
          "36 by a thirteenth": "results_36_thirteenth.json", "30 by a fourteenth": "results_30_fourteenth.json",
          "30 by a fifteenth": "results_30_fifteenth.json"}
REMARKS = {"torque_drift", "torque_bias"}  # true where every recording has an offset of its own
MOST = 3  # names of a class that still says something


def hits(finding: dict[str, Any], hidden: dict[str, Any]) -> bool:
    """Return whether a finding names a hidden effect."""
    names = {finding["effect"], *(finding["class"] if len(finding["class"]) <= MOST else ())}
    right = {hidden["effect"]} | ALIKE.get(hidden["effect"], set()) | set(hidden.get("accept") or ())
    return bool(names & right) and (hidden["joint"] is None or finding["joint"] in (hidden["joint"], None))


def scored(answer: dict[str, Any], document: dict[str, Any]) -> dict[str, Any]:
    """Return the row of one campaign."""
    findings, used = document["findings"], set()
    hidden = [h for h in answer["hidden"] if not h["effect"].startswith("unknown")]
    accepted = [f for f in findings if any(hits(f, h) for h in answer["hidden"] if h["effect"].startswith("unknown"))]
    for h in hidden:
        hit = next((i for i, f in enumerate(findings) if i not in used and hits(f, h)), None)
        used |= set() if hit is None else {hit}
    part = any(h.get("part", False) for h in hidden)
    remarks = REMARKS if answer["style"] == "offsets" else set()
    wrong = [f["effect"] for i, f in enumerate(findings) if i not in used and f["effect"] not in remarks and f not in accepted]
    return {"style": answer["style"], "hidden": [h["effect"] for h in answer["hidden"]], "said": [f["effect"] for f in findings],
            "exact": len(used) == len(hidden) and not wrong and part == any("acts" in f for f in findings), "wrong": wrong,
            "confidence": [f["confidence"] for f in findings], "detected": document["mismatch"]["detected"], "seconds": document["seconds"]}


def share(values: list[bool]) -> str:
    """Return a share with its 95 % interval."""
    from nnhydro.evaluation.metrics import interval_of_share

    if not values:
        return "-"
    low, high = interval_of_share(sum(values), len(values))
    return f"{100 * sum(values) / len(values):.0f} % ({100 * low:.0f} to {100 * high:.0f}) of {len(values)}"


def summary(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Return the shares over all rows."""
    alone = [r for r in rows if len(r["hidden"]) == 1 and not r["hidden"][0].startswith("unknown")]
    healthy = [r for r in rows if not r["hidden"]]
    several = [r["exact"] for r in rows if len(r["hidden"]) > 1]
    return {"one effect, exact": share([r["exact"] for r in alone]), "several, exact": share(several),
            "a wrong name": share([bool(r["wrong"]) for r in rows]), "healthy, named": share([bool(r["wrong"]) for r in healthy]),
            "healthy, detected": share([r["detected"] for r in healthy if r["style"] != "offsets"]),
            "seconds, median": f"{sorted(r['seconds'] for r in rows)[len(rows) // 2]:.1f}"}


def table(documents: list[dict[str, Any]]) -> str:
    """Return the table of README.md from the results of each author in STORED."""
    made = []
    for document in documents:
        rows = document["campaigns"]
        unlisted = [r for r in rows if r["hidden"] and r["hidden"][0].startswith("unknown")]
        made.append({k: v for k, v in summary(rows).items() if k != "seconds, median"}
                    | {"cause in no catalogue: no wrong name": f"{sum(not r['wrong'] for r in unlisted)} of {len(unlisted)}",
                       "cause in no catalogue: an alarm or a name": f"{sum(r['detected'] for r in unlisted)} of {len(unlisted)}"})
    lines = [["figure (95 % interval)", *STORED], ["---"] * (1 + len(STORED)), *([name, *(m[name] for m in made)] for name in made[0])]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def families_out(answer: dict[str, Any]) -> tuple[str, ...]:
    """Return the effects of the families of what is hidden."""
    from nnhydro.effects.catalogue import catalogue

    families = {catalogue()[h["effect"]].family for h in answer["hidden"] if h["effect"] in catalogue()}
    return tuple(name for name, effect in catalogue().items() if effect.family in families)


def family_out(root: Path, answers: dict[str, Any], names: list[str], out: Path) -> None:
    """Diagnose without the hidden families; print what is named all the same, write family_out.json."""
    import nnhydro
    from nnhydro.diagnosis.diagnose import diagnose
    from nnhydro.fitting.identify import versions
    from nnhydro.runtime.files import write_json

    rows = []
    for name in names:
        without = families_out(answers[name])
        if without:
            found = diagnose(nnhydro.load(root / name), without=without)
            rows.append({"case": name, "named": [[f.effect, f.confidence] for f in found.findings], "detected": found.detected})
            print(f"{name} {'+'.join(h['effect'] for h in answers[name]['hidden']):40s} {rows[-1]['named'] or 'nothing'}", flush=True)
    told = {"a wrong name": share([bool(r["named"]) for r in rows]), "an alarm": share([r["detected"] for r in rows])}
    print(json.dumps(told, indent=1))
    write_json(out / "family_out.json", {"versions": versions(), "summary": told, "campaigns": rows})


def as_logged(campaign: Any) -> Any:
    """Return the campaign with rates as a controller logs them: differences of the angles, filtered by a sample."""
    import numpy as np
    from scipy.signal import lfilter

    from nnhydro.recordings.campaign import Campaign

    def logged(r: Any) -> Any:
        """Return one recording with such rates."""
        keep = np.exp(-1.0)
        steps = np.diff(r.q, axis=0, prepend=r.q[:1]) / np.diff(r.t, prepend=2 * r.t[0] - r.t[1])[:, None]
        return replace(r, qd=np.asarray(lfilter([1 - keep], [1, -keep], steps, axis=0)), qdd=None)

    return Campaign.of(campaign.arm, [logged(campaign.load(name)) for name in campaign.names], campaign.steady)


def main() -> None:
    """Diagnose, print one row per campaign and the summary, write results.json."""
    import nnhydro
    from nnhydro.fitting.identify import versions
    from nnhydro.runtime.files import write_json

    if sys.argv[1:] == ["table"]:
        print(table([json.loads((Path(__file__).parent / name).read_text()) for name in STORED.values()]))
        return
    root, out = Path(sys.argv[1]), Path(sys.argv[2])
    answers = json.loads((root / "answers.json").read_text())
    part = next((x for x in sys.argv[3:] if ":" in x), ":")
    wanted = slice(*(int(x) if x else None for x in part.split(":")))
    out.mkdir(parents=True, exist_ok=True)
    if "family-out" in sys.argv[3:]:
        family_out(root, answers, sorted(answers)[wanted], out)
        return
    rows = []
    for name in sorted(answers)[wanted]:
        start = time.perf_counter()
        if not (out / name / "diagnosis.json").exists():
            campaign = nnhydro.load(root / name)
            nnhydro.diagnose(as_logged(campaign) if "rates-of-a-logger" in sys.argv[3:] else campaign).save(out / name)
        rows.append({"case": name} | scored(answers[name], json.loads((out / name / "diagnosis.json").read_text())))
        r = rows[-1]
        print(f"{name} {r['style']:9s} {'+'.join(r['hidden']) or 'nothing':40s} {'+'.join(r['said']) or 'nothing':40s} "
              f"{'exact' if r['exact'] else '-'} {time.perf_counter() - start:.0f} s", flush=True)
    print(json.dumps(summary(rows), indent=1))
    write_json(out / "results.json", {"versions": versions(), "summary": summary(rows), "campaigns": rows})


if __name__ == "__main__":
    main()
