"""Make the campaigns of 72 recorded machines, diagnose and judge each: `python training/machines/run.py [--only 0-10,14] [--seed S]`.

Campaigns and diagnoses go to runs/SEED/mNN; what is diagnosed there is not diagnosed again, so that a run that was ended goes on. With
--finished nothing is diagnosed: what is there is judged. A row a machine goes to results.json, in place of its earlier row, and the tables
go to table.md (of another seed: results_SEED.json, table_SEED.md). Seed S draws machine i from the random generator S + i.
"""

import argparse
import importlib
import json
import subprocess
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

import cards
from judge import judged

MODULES = ("friction", "gears", "flow", "bodies", "free", "held", "pairs_dry", "pairs_wet", "nameless", "healthy_dry", "healthy_wet")
for module in MODULES:
    importlib.import_module(module)  # enters its machines in cards.MACHINES

HERE = Path(__file__).parent
SEED = 6100
COLUMNS = ("machine", "what it is", "hidden", "named (confidence)", "value (95 % interval)", "error before and after, %", "noise floor, %",
           "verdict", "seconds")
VERDICTS = ("right", "half", "alarm", "silent", "wrong", "healthy-ok", "healthy-detected", "healthy-named", "refused", "crash")


def numbers(text: str) -> list[int]:
    """Return the numbers of a list such as 0-10,14."""
    ends = [part.partition("-") for part in text.split(",")]
    return [i for first, _, last in ends for i in range(int(first), int(last or first) + 1)]


def package() -> str:
    """Return the package's tree in git, `-dirty` where files of it have been changed since; empty where there is no git."""
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=False, cwd=HERE).stdout.strip()

    return git("rev-parse", "--short", "HEAD:nnhydro") + ("-dirty" if git("status", "--porcelain", "--", ":/nnhydro") else "")


def diagnose(folder: Path, baseline: str | None) -> str:
    """Diagnose the campaign in `folder`, and note the package's tree; return why there is no diagnosis, empty where there is one."""
    import nnhydro
    from nnhydro.errors import NnhydroError

    try:
        nnhydro.diagnose(nnhydro.load(folder / "campaign"), baseline=baseline).save(folder / "diagnosis")
    except NnhydroError as cause:
        return f"refused: {cause}"
    except Exception:
        return "crash: " + traceback.format_exc().strip().splitlines()[-1]
    (folder / "package.txt").write_text(package())
    return ""


def row(number: int, seed: int, finished: bool) -> dict[str, Any] | None:
    """Return what is told of one machine; None where nothing is to be diagnosed and nothing is."""
    folder = HERE / "runs" / str(seed) / f"m{number:02d}"
    result = folder / "diagnosis" / "diagnosis.json"
    if finished and not result.exists():
        return None
    card = cards.write(number, seed, folder / "campaign")
    known = {"machine": folder.name, "kind": card["kind"], "what": card["what"], "hidden": card["answers"], "nameless": card["nameless"],
             "tolerated": card["tolerated"], "note": card["note"]}
    why = "" if result.exists() else diagnose(folder, card["baseline"])
    if why:
        return known | {"verdict": why.partition(":")[0], "why": why, "said": [], "values": []}
    tree = folder / "package.txt"
    return known | judged(card, json.loads(result.read_text())) | {"package": tree.read_text() if tree.exists() else ""}


def hidden(r: dict[str, Any]) -> str:
    """Return what a machine hides, in words."""
    names = [a["effect"] + (f" at {a['joint']}" if a["joint"] else "") for a in r["hidden"]]
    return " + ".join(names) or ("no name" if r["nameless"] else "nothing")


def line(r: dict[str, Any]) -> str:
    """Return the row of a machine in the table."""
    names = [s["effect"] + (f" at {s['joint']}" if s["joint"] else "") + f" ({s['confidence'] or 0:.2f})" for s in r["said"]]
    values = [f"{v['value']:.3g} ({v['ci95'][0]:.3g} to {v['ci95'][1]:.3g}), truth {v['truth']:.3g} {v['unit']}"
              for v in r["values"] if v["holds"] is not None]
    errors = " to ".join("-" if r.get(k) is None else f"{100 * r[k]:.3g}" for k in ("error_before", "error_after"))
    floor = "-" if r.get("noise_floor") is None else f"{100 * r['noise_floor']:.3g}"
    cells = (r["machine"], r["what"], hidden(r), ", ".join(names) or r.get("why") or "nothing", "; ".join(values), errors, floor,
             r["verdict"], f"{r.get('seconds') or 0:.0f}")
    return f"| {' | '.join(cells)} |"


def tables(rows: list[dict[str, Any]]) -> str:
    """Return the verdicts by kind of machine, the share of intervals that hold the truth, and a row a machine."""
    seen = [v for v in VERDICTS if any(r["verdict"] == v for r in rows)]
    by_kind = [f"| {kind} | {len(of)} | " + " | ".join(str(Counter(r["verdict"] for r in of)[v]) for v in seen) + " |"
               for kind in dict.fromkeys(r["kind"] for r in rows) for of in [[r for r in rows if r["kind"] == kind]]]
    hold = [v["holds"] for r in rows for v in r["values"] if v["holds"] is not None]
    return "\n".join(["| machines | number | " + " | ".join(seen) + " |", "| --- | --- |" + " --- |" * len(seen), *by_kind, "",
                      f"{sum(hold)} of {len(hold)} intervals of 95 % hold the true value.", "",
                      f"| {' | '.join(COLUMNS)} |", "|" + " --- |" * len(COLUMNS), *(line(r) for r in rows), ""])


def main() -> None:
    """Make, diagnose, judge; print a row a machine and the tables, write both."""
    from nnhydro.fitting.identify import versions
    from nnhydro.runtime.files import write_json, write_text

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", type=numbers, default=sorted(cards.MACHINES), help="numbers of machines, such as 0-10,14")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--finished", action="store_true", help="judge what is diagnosed, diagnose nothing")
    given = parser.parse_args()
    ending = "" if given.seed == SEED else f"_{given.seed}"
    out = HERE / f"results{ending}.json"
    rows = {r["machine"]: r for r in json.loads(out.read_text())["machines"]} if out.exists() else {}
    for number in given.only:
        r = row(number, given.seed, given.finished)
        if r is None:
            continue
        print(line(r), flush=True)
        rows[r["machine"]] = r
        ordered = [rows[name] for name in sorted(rows)]
        write_json(out, {"versions": versions(), "seed": given.seed, "machines": ordered})
        write_text(HERE / f"table{ending}.md", tables(ordered))
    print(tables([rows[name] for name in sorted(rows)]))


if __name__ == "__main__":
    main()
