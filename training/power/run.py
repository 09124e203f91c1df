"""Is the smallest size that `nnhydro power` states found four times in five? `python training/power/run.py [table] [plants] [KEY=VALUE]`.

table   what the motions of a campaign reveal, for every effect: results.json, table.md
plants  every effect planted at its stated size on these motions, the baseline refitted, the whole catalogue tried: how often it is found,
        that is, named, or in the class of what is named; and how often at the right joint

KEY=VALUE overrides config.toml (TOML). Each plant is stored under runs/ as it ends: a run that was ended goes on.
"""

import json
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

from nnhydro.diagnosis.planting import planted
from nnhydro.diagnosis.power import Power, Reveal, power
from nnhydro.diagnosis.reference import reference
from nnhydro.diagnosis.studied import named
from nnhydro.effects.quantity import Z95
from nnhydro.files import write_json
from nnhydro.identification.identify import versions
from nnhydro.recordings.campaign import open_campaign

HERE = Path(__file__).parent
RUNS = HERE / "runs"


def wilson(hits: int, tries: int) -> tuple[float, float, float]:
    """Return a share and its 95 % interval (Wilson 1927, J. Am. Stat. Assoc. 22)."""
    if not tries:
        return float("nan"), 0.0, 1.0
    share, z = hits / tries, Z95
    centre = (share + z**2 / (2 * tries)) / (1 + z**2 / tries)
    half = z / (1 + z**2 / tries) * np.sqrt(share * (1 - share) / tries + z**2 / (4 * tries**2))
    return share, float(centre - half), float(centre + half)


def revealed(config: dict, recordings: list[str]) -> Power:
    """Return what `recordings` of the campaign reveal, all of them where none is named."""
    whole = open_campaign(HERE / config["campaign"])
    names = tuple(name for name in whole.names if not recordings or name in recordings)
    return power(replace(whole, names=names, steady=()), seed=config["seed"], progress=lambda line: print(line, file=sys.stderr))


def seen(found: Power, config: dict) -> list[Reveal]:
    """Return one row for each effect and joint that is revealed at some size: of its parameters the one that is least like a rival."""
    rows: dict[tuple[str, int], Reveal] = {}
    for row in sorted(found.rows, key=lambda r: -r.likeness):
        if row.size is not None and (not config["effects"] or row.instance.key[0] in config["effects"]):
            rows[row.instance.key] = row
    return list(rows.values())


def plant(found: Power, row: Reveal, draw: int, config: dict) -> dict:
    """Return what is named where `row` is planted at its stated size."""
    seed = config["seed"] + 1000 * draw + found.rows.index(row)  # noise of its own for every plant
    case = planted(found.case, [(row.instance, row.direction * row.size)], found.noise, seed)
    case = replace(case, reference=reference(None, case.model.arm, case.all_units, case.model.preparation))
    told = [{"class": list(f.members), "joint": f.effect.joint} for f in named(case, None, draw).findings]
    key = row.instance.key
    return {"effect": key[0], "joint": key[1], "parameter": row.parameter, "size": row.size, "draw": draw, "named": told,
            "found": any(key[0] in one["class"] for one in told),
            "at_joint": any(key[0] in one["class"] and one["joint"] in (key[1], 0) for one in told)}


def plants(found: Power, config: dict) -> dict:
    """Plant every effect so often; return how often it is found, by effect and in all."""
    rows: dict[str, list[bool]] = {}
    joints: list[bool] = []
    for draw in range(config["plants"]):
        for row in seen(found, config)[: config["most"] - len(joints)]:
            name = f"{row.instance.key[0]}_{row.instance.key[1]}"
            path = RUNS / f"{name}_{draw}.json"
            if not path.is_file():
                path.parent.mkdir(exist_ok=True)
                write_json(path, plant(found, row, draw, config))
            one = json.loads(path.read_text())
            rows.setdefault(name, []).append(one["found"])
            joints.append(one["at_joint"])
            print(f"{name:>26} {draw}  {one['found']!s:>5}  {one['named']}", flush=True)
    every = [x for one in rows.values() for x in one]
    return {"by_effect": {name: [sum(one), len(one)] for name, one in rows.items()}, "found": sum(every), "of": len(every),
            "right_joint": sum(joints), "share_and_interval": wilson(sum(every), len(every))}


def table(found: Power) -> str:
    """Return the rows as a Markdown table."""
    lines = ["| effect | joint | parameter | smallest size | visible | most alike | at |", "| --- | --- | --- | --- | --- | --- | --- |"]
    for row in found.rows:
        size = "not at any size" if row.size is None else f"{row.size:.2g} {row.unit}"
        shape = ", ".join(f"{name} {value:.3g}" for name, value in row.shape.items())
        rival = "" if row.rival is None else f"{row.rival} ({row.likeness:.2f})"
        lines.append(f"| {row.instance.key[0]} | {row.instance.key[1] or 'arm'} | {row.parameter} | {size} | {100 * row.visible:.0f} % | "
                     f"{rival} | {shape} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run what is asked for."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    for item in (item for item in sys.argv[1:] if "=" in item):
        config |= tomllib.loads(item)
    asked = [item for item in sys.argv[1:] if "=" not in item] or ["table", "plants"]
    result = json.loads((HERE / "results.json").read_text()) if (HERE / "results.json").is_file() else {}
    if "table" in asked:
        found = revealed(config, [])
        (HERE / "table.md").write_text(table(found))
        result["table"] = found.document()
    if "plants" in asked:
        result["plants"] = plants(revealed(config, config["recordings"]), config)
        share, low, high = result["plants"]["share_and_interval"]
        print(f"found {result['plants']['found']} of {result['plants']['of']}: {share:.2f} ({low:.2f} to {high:.2f})")
    write_json(HERE / "results.json", result | {"config": config, "versions": versions()})


if __name__ == "__main__":
    main()
