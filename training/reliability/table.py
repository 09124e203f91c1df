"""Print the table of README.md from results.json: `python training/reliability/table.py`."""

import json
from pathlib import Path
from typing import Any

LOST = ("half written", "lost", "result differs from an undisturbed run")  # of a run that is killed


def table(results: dict[str, Any]) -> str:
    """Return a row a study and command: how often it was tried, and how often it failed."""
    rows = [("killed", r["command"], r["killed at random"] + r["killed before an operation on files"], sum(r[name] for name in LOST))
            for r in results["kills"]["rows"]]
    rows += [("full or read-only disk", r["command"], r["tries"], r["failures"]) for r in results["faults"]["rows"]]
    rows += [("broken or hostile file", r["read"], r["inputs"], r["failures"]) for r in results["fuzz"]["rows"]]
    planted = results["soak"]["of these with an effect"]
    rows.append(("soak", "effects to be named", planted, planted - results["soak"]["effects named"]))
    rows += [("mutants", r["part"], r["mutants"], r["mutants"] - r["killed (or never ended)"]) for r in results["mutants_2054"]["rows"]]
    return "\n".join(["| study | command or file | tries | failures |", "|" + " --- |" * 4,
                      *(f"| {study} | {what} | {tries:,} | {failures} |" for study, what, tries, failures in rows)])


if __name__ == "__main__":
    print(table(json.loads((Path(__file__).parent / "results.json").read_text(encoding="utf-8"))))
