"""Diagnose real rigs and hold what is said against what is known of them: `python training/real_rigs/run.py FOLDER [OUT] [family-out]`.

FOLDER holds one campaign a rig (a folder with arm.yaml) and answers.json:

    {"rig": {"baseline": "rigid", "must": [[["coulomb_friction"], 1, [0.14, 0.21]]], "may": ["rotor_inertia"], "error": 0.18}}

must: effects that a right answer names (any of the list), their joint (null: any), the range of their main value (null: any); may: what is
also true; error: the held-out error of a good answer (null: not known); nothing: whether silence is right; path: where the campaign lies,
from FOLDER. A rig is right, half (true, but something is missing or a value is off), silent, wrong (a false name or an absurd figure),
refused, or crashed. OUT holds each diagnosis, results.json and index.html with the pictures; what is there is not diagnosed again.
`run.py table` prints the table of README.md from the results stored here.
With family-out the families of what a right answer names are taken out of the catalogue, as if nobody had written a card for the cause:
whatever is named then and is not also true (may) is a wrong name. OUT/family_out.json holds what was said.
"""

import html
import json
import sys
import time
import traceback
from pathlib import Path
from typing import Any

ABSURD = 5.0  # an error above is no figure
STORED = ("results.json", "collected_again.json", "thirty.json", "fourteen.json", "fifteen.json", "twelve.json",
          "fourteen_more.json")  # as collected
PICTURES = ("torque_history.png", "laws.png", "residual_map.png")


def names_of(finding: dict[str, Any]) -> set[str]:
    """Return the effects that a finding names, those included that cannot be told from it."""
    return {finding["effect"], *finding["class"]}


def main_value(finding: dict[str, Any]) -> float | None:
    """Return the first number of a finding."""
    return next((p["value"] for p in finding["parameters"].values()), None)


def judged(card: dict[str, Any], document: dict[str, Any]) -> tuple[str, str]:
    """Return the verdict on a diagnosis and why."""
    findings, used, notes = document["findings"], set(), []
    for names, joint, span in card["must"]:
        hit = next((i for i, f in enumerate(findings) if i not in used and names_of(f) & set(names)
                    and (joint is None or f["joint"] in (joint, None))), None)
        if hit is None:
            notes.append(f"missing {' or '.join(names)}" + (f" at joint {joint}" if joint else ""))
            continue
        used.add(hit)
        value = main_value(findings[hit])
        if span and findings[hit]["effect"] in names and value is not None and not span[0] <= abs(value) <= span[1]:
            notes.append(f"{findings[hit]['effect']} {value:.3g} outside {span[0]:g} to {span[1]:g}")
    after = document["proof"]["error_after"]
    false = [f["effect"] for i, f in enumerate(findings) if i not in used and f["effect"] not in card["may"]]
    if false or not after < ABSURD:
        return "wrong", f"false: {', '.join(false)}" if false else f"error {after:.2g}"
    if not findings and card["must"]:
        return "silent", "a mismatch is seen" if document["mismatch"]["detected"] else "no mismatch is seen"
    if not notes and card.get("error") and after > 1.1 * card["error"]:
        notes.append(f"error {after:.3f} above {card['error']:g}")
    return ("half", "; ".join(notes)) if notes else ("right", "")


def diagnosed(folder: Path, baseline: str, out: Path) -> tuple[dict[str, Any] | None, str]:
    """Return what diagnosis.json holds, or None and the reason."""
    import nnhydro
    from nnhydro.errors import NnhydroError

    if not (out / "diagnosis.json").exists():
        try:
            nnhydro.diagnose(nnhydro.load(folder), baseline=baseline).save(out)
        except NnhydroError as cause:
            return None, f"refused: {cause}"
        except Exception:
            return None, "crash: " + traceback.format_exc().strip().splitlines()[-1]
    return json.loads((out / "diagnosis.json").read_text()), ""


def row(name: str, card: dict[str, Any], root: Path, out: Path) -> dict[str, Any]:
    """Return what is told of one rig."""
    start = time.perf_counter()
    document, why = diagnosed(root / card.get("path", name), card["baseline"], out / name)
    if document is None:
        return {"rig": name, "verdict": why.split(":")[0], "why": why, "said": "", "seconds": time.perf_counter() - start}
    verdict, why = judged(card, document)
    places = [f" at {f['joint']}" if f["joint"] else "" for f in document["findings"]]
    said = "; ".join(f"{f['effect']}{place} ({f['confidence']:.2f})" for f, place in zip(document["findings"], places, strict=True))
    values = {f"{f['effect']}_{f['joint'] or 0}": {k: [p["value"], *p["ci95"]] for k, p in f["parameters"].items()}
              for f in document["findings"]}
    return {"rig": name, "verdict": verdict, "why": why, "said": said or "nothing", "values": values,
            "error_before": document["mismatch"]["error"], "error_after": document["proof"]["error_after"],
            "noise_floor": document["mismatch"]["noise_floor"], "card_error": card.get("error"), "seconds": document["seconds"]}


def named(r: dict[str, Any]) -> str:
    """Return what a diagnosis names: effects with their joint, main value in SI units, and confidence."""
    mains = [f"{next(iter(values.values()))[0]:.3g}" for values in r["values"].values()]
    return "; ".join(f"{said[:-1]}, {main})" for said, main in zip(r["said"].split("; "), mains, strict=True)) if mains else r["said"]


def table(rows: list[dict[str, Any]]) -> str:
    """Return the table of README.md."""
    head = "| rig | verdict | named at joint (confidence, main value) | error, before -> after | why not right |\n|" + " --- |" * 5
    errors = {r["rig"]: f"{100 * r['error_before']:.1f} -> {100 * r['error_after']:.1f} %" for r in rows if "error_after" in r}
    return "\n".join([head, *(f"| {r['rig']} | {r['verdict']} | {named(r)} | {errors[r['rig']]} | {r['why']} |" for r in rows
                              if r["rig"] in errors)])


def family_out(cards: dict[str, Any], root: Path, out: Path) -> None:
    """Diagnose every rig without the families of what is known to be missing; print and write what is named all the same."""
    import nnhydro
    from nnhydro.diagnosis.diagnose import diagnose
    from nnhydro.effects.catalogue import catalogue
    from nnhydro.errors import NnhydroError
    from nnhydro.fitting.identify import versions
    from nnhydro.runtime.files import write_json

    every, rows = catalogue(), []
    for name, card in cards.items():
        families = {every[effect].family for names, *_ in card["must"] for effect in names}
        if not families or not (root / card.get("path", name)).exists():
            continue
        without = tuple(effect for effect in every if every[effect].family in families)
        try:
            found = diagnose(nnhydro.load(root / card.get("path", name)), card["baseline"], without=without)
        except NnhydroError as cause:
            rows.append({"rig": name, "without": sorted(families), "refused": str(cause)})
        else:
            named = [[f.effect, round(f.confidence, 2)] for f in found.findings]
            rows.append({"rig": name, "without": sorted(families), "named": named, "detected": found.detected,
                         "wrong": [effect for effect, _ in named if effect not in card["may"]]})
        print(f"| {name} | {', '.join(sorted(families))} | {rows[-1].get('named', 'refused')} | {rows[-1].get('wrong', '')} |", flush=True)
    answered = [row for row in rows if "named" in row]
    told = {"a wrong name": f"{sum(bool(row['wrong']) for row in answered)} of {len(answered)}",
            "an alarm": f"{sum(row['detected'] for row in answered)} of {len(answered)}"}
    print(json.dumps(told))
    write_json(out / "family_out.json", {"versions": versions(), "summary": told, "rigs": rows})


def _picture(rig: str, name: str) -> str:
    return f'<img src="{rig}/{name}" alt="{name[:-4]} of {rig}">'


def page(rows: list[dict[str, Any]], out: Path) -> str:
    """Return the page with the table and the pictures."""
    cells = "".join(f"<tr><td>{r['rig']}</td><td>{r['verdict']}</td><td>{html.escape(r['said'])}</td><td>{html.escape(r['why'])}</td></tr>"
                    for r in rows)
    figures = "".join(f"<h2>{r['rig']}</h2>" + "".join(_picture(r["rig"], p) for p in PICTURES
                                                       if (out / r["rig"] / p).exists()) for r in rows)
    style = "<style>img{max-width:100%}td{padding:4px 8px}</style>"
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Real rigs</title>{style}<h1>Real rigs</h1>'
    return f"{head}<table><tr><th>rig</th><th>verdict</th><th>said</th><th>why</th></tr>{cells}</table>{figures}</html>"


def main() -> None:
    """Diagnose every rig of the folder, print the table, write results.json and index.html."""
    from nnhydro.fitting.identify import versions
    from nnhydro.runtime.files import write_json, write_text

    if sys.argv[1:] == ["table"]:
        print(table([r for name in STORED for r in json.loads((Path(__file__).parent / name).read_text())["rigs"]]))
        return
    places = [x for x in sys.argv[1:] if x != "family-out"]
    root, out = Path(places[0]), Path(places[1] if len(places) > 1 else "runs/real_rigs")
    cards = {k: v for k, v in json.loads((root / "answers.json").read_text()).items() if not k.startswith("_")}
    out.mkdir(parents=True, exist_ok=True)
    if "family-out" in sys.argv[1:]:
        family_out(cards, root, out)
        return
    rows = []
    for name, card in cards.items():
        if not (root / card.get("path", name)).exists():
            continue
        rows.append(row(name, card, root, out))
        r = rows[-1]
        errors = f"{100 * r['error_before']:.1f} -> {100 * r['error_after']:.1f} %" if "error_after" in r else ""
        print(f"| {name} | {r['verdict']} | {r['said']} | {errors} | {r['why']} | {r['seconds']:.0f} |", flush=True)
    count = {v: sum(r["verdict"] == v for r in rows) for v in dict.fromkeys(r["verdict"] for r in rows)}
    print(", ".join(f"{n} {v}" for v, n in count.items()))
    write_json(out / "results.json", {"versions": versions(), "count": count, "rigs": rows})
    write_text(out / "index.html", page(rows, out))


if __name__ == "__main__":
    main()
