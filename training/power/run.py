"""Is the smallest size that `nnhydro power` states found four times in five? `python training/power/run.py [WORD] [KEY=VALUE]`.

table    what the motions of a campaign reveal, for every effect: results.json, table.md
plants   every effect planted at its stated size on these motions, the whole catalogue tried: how often it is found,
         that is, named, or in the class of what is named; and how often at the right joint
summary  counts the plants that are there, under runs/VERSION: a run that was ended goes on
page     prints the table of README.md from results.json, and runs nothing

KEY=VALUE overrides config.toml (TOML). Without a word: table, plants, summary, page.
"""

import json
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

from nnhydro.diagnosis.calibration.injection import inject
from nnhydro.diagnosis.calibration.power import DetectableSize, Power, power
from nnhydro.diagnosis.diagnose import search_design
from nnhydro.diagnosis.findings.finding import findings_of
from nnhydro.evaluation.metrics import interval_of_share
from nnhydro.fitting.identify import versions
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.files import write_json

HERE = Path(__file__).parent
RUNS = HERE / "runs" / versions()["nnhydro"]  # one version makes a table


def share_and_interval(hits: int, tries: int) -> tuple[float, float, float]:
    """Return a share and its 95 % interval."""
    return (hits / tries if tries else float("nan"), *interval_of_share(hits, tries, "wilson"))


def revealed(config: dict, recordings: list[str]) -> Power:
    """Return what `recordings` of the campaign reveal, all of them where none is named."""
    whole = open_campaign(HERE / config["campaign"])
    names = tuple(name for name in whole.names if not recordings or name in recordings)
    return power(replace(whole, names=names, steady=()), seed=config["seed"], progress=lambda line: print(line, file=sys.stderr))


def seen(found: Power, config: dict) -> list[DetectableSize]:
    """Return one row for each effect and joint that is revealed at some size: of its parameters the one that is least like a rival."""
    rows: dict[tuple[str, int], DetectableSize] = {}
    for row in sorted(found.rows, key=lambda r: -r.likeness):
        if row.size is not None and (not config["effects"] or row.hypothesis.key[0] in config["effects"]):
            rows[row.hypothesis.key] = row
    return list(rows.values())


def plant(found: Power, row: DetectableSize, draw: int, config: dict) -> dict:
    """Return what is named where `row` is planted at its stated size."""
    seed = config["seed"] + 1000 * draw + found.rows.index(row)  # noise of its own for every plant
    z = np.zeros(found.design.Y.shape[2])
    design = inject(found.design, found.noise, found.model, z, [(row.hypothesis, row.direction * row.size)], seed)
    named = search_design(design, draw)
    claimed = named.decided.claimed
    findings = findings_of(named.search, claimed)
    told = [{"class": list(f.equivalence_set), "joint": f.law.joint} for f in findings]
    key = row.hypothesis.key
    return {"effect": key[0], "joint": key[1], "parameter": row.parameter, "size": row.size, "draw": draw, "named": told,
            "found": any(key[0] in finding["class"] for finding in told),
            "at_joint": any(key[0] in finding["class"] and finding["joint"] in (key[1], 0) for finding in told)}


def plants(found: Power, config: dict) -> None:
    """Plant every effect so often; each is stored as it ends, and one that is there is not planted again."""
    done = 0
    for draw in range(config["plants"]):
        for row in seen(found, config)[: config["most"] - done]:
            done += 1
            path = RUNS / f"{row.hypothesis.key[0]}_{row.hypothesis.key[1]}_{draw}.json"
            if not path.is_file():
                path.parent.mkdir(exist_ok=True)
                write_json(path, plant(found, row, draw, config))
                result = json.loads(path.read_text())
                print(f"{path.stem:>28}  {result['found']!s:>5}  {result['named']}", flush=True)


def summary() -> dict:
    """Return how often what was planted was found, by effect and joint and in all."""
    rows = [json.loads(path.read_text()) for path in sorted(RUNS.glob("*.json"))]
    mine: dict[str, list[bool]] = {}
    for row in rows:
        mine.setdefault(f"{row['effect']} {row['joint'] or 'arm'}", []).append(row["found"])
    hits = sum(row["found"] for row in rows)
    return {"by_effect": {name: [sum(some), len(some)] for name, some in mine.items()}, "found": hits, "of": len(rows),
            "right_joint": sum(row["at_joint"] for row in rows), "share_and_interval": share_and_interval(hits, len(rows)), "plants": rows}


def table(document: dict) -> str:
    """Return what `nnhydro power --json` prints as a Markdown table."""
    lines = ["| effect | joint | parameter | smallest size | visible | most alike | at |", "| --- | --- | --- | --- | --- | --- | --- |"]
    for row in document["effects"]:
        size = "not at any size" if row["smallest_size"] is None else f"{row['smallest_size']:.2g} {row['unit']}"
        shape = ", ".join(f"{name} {value:.3g}" for name, value in row["at"].items())
        rival = "" if row["nearest"] is None else f"{row['nearest']} ({row['likeness']:.2f})"
        lines.append(f"| {row['effect']} | {row['joint'] or 'arm'} | {row['parameter']} | {size} | {100 * row['visible_share']:.0f} % | "
                     f"{rival} | {shape} |")
    return "\n".join(lines) + "\n"


def page(planted: dict) -> str:
    """Return the Markdown table of README.md: what was planted, by effect, and how often it was found."""
    lines = ["| effect | found | at its joint |", "| --- | --- | --- |"]
    rows = planted["plants"]
    for effect in sorted({row["effect"] for row in rows}):
        mine = [row for row in rows if row["effect"] == effect]
        found, at_joint = (sum(row[what] for row in mine) for what in ("found", "at_joint"))
        lines.append(f"| {effect} | {found} of {len(mine)} | {at_joint} of {len(mine)} |")
    share, low, high = planted["share_and_interval"]
    lines.append(f"| **all** | {planted['found']} of {planted['of']}: {100 * share:.0f} % ({100 * low:.0f} to {100 * high:.0f} %) | "
                 f"{planted['right_joint']} of {planted['of']} |")
    return "\n".join(lines)


def main() -> None:
    """Run what is asked for."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    for item in (item for item in sys.argv[1:] if "=" in item):
        config |= tomllib.loads(item)
    asked = [item for item in sys.argv[1:] if "=" not in item] or ["table", "plants", "summary", "page"]
    result = json.loads((HERE / "results.json").read_text()) if (HERE / "results.json").is_file() else {}
    if asked == ["page"]:
        print(page(result["plants"]))
        return
    result = result if result.get("versions") == versions() else {}  # figures of another version are not mixed with these
    if "table" in asked:
        result["table"] = revealed(config, []).document()
        (HERE / "table.md").write_text(table(result["table"]))
    if "plants" in asked:
        plants(revealed(config, config["recordings"]), config)
    if "summary" in asked:
        result["plants"] = summary()
    if "page" in asked:
        print(page(result["plants"]))
    write_json(HERE / "results.json", result | {"config": config, "versions": versions()})


if __name__ == "__main__":
    main()
