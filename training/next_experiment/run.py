"""Is an ambiguous finding settled by the motion that the diagnosis proposes? `python training/next_experiment/run.py [KEY=VALUE ...]`.

Rigs whose motions leave something ambiguous (config.toml) hide one effect each, recorded by the independent truth. Where the diagnosis
cannot tell, the proposed motion is recorded as often as it asks, and motions drawn at random within the same limits as often, for
comparison. Each case is stored as it ends, under runs/VERSION: a run that was ended goes on. KEY=VALUE overrides config.toml, e.g.
`seeds=[1]`, `given="none"`, `stated=false` (within what the rig has shown). `python training/next_experiment/run.py table` writes all cases
that are there to results.json and prints the table of README.md.
"""

import json
import sys
import tomllib
from pathlib import Path

from table import honest, settled, table, words
from tank import Tank

from nnhydro.diagnosis.diagnose import SearchedCampaign, search_design
from nnhydro.diagnosis.experiment.proposal import motions_at_random, next_experiment
from nnhydro.diagnosis.experiment.rig_limits import Limits
from nnhydro.diagnosis.findings.finding import findings_of
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.fitting.identify import versions
from nnhydro.recordings.campaign import Campaign
from nnhydro.runtime.files import write_json

HERE = Path(__file__).parent
RUNS = HERE / "runs" / versions()["nnhydro"]  # one version makes a table


def told(found: SearchedCampaign) -> list[dict]:
    """Return what the diagnosis names."""
    claimed = found.decided.claimed
    findings = findings_of(found.search, claimed)
    return [{"class": list(f.equivalence_set), "joint": f.joint} for f in findings]


def case(config: dict, rig: dict, hidden: dict, seed: int) -> dict:
    """Return what came of one case."""
    tank = Tank(config, rig, hidden, seed)
    first = [tank.record(motion, f"run_{k}") for k, motion in enumerate(tank.motions)]
    before = search_design(design_on(problem_of(Campaign.of(tank.arm, first)), None), seed)
    limits = Limits(**rig["limits"]) if config["stated"] else None
    proposal = next_experiment(before.search, before.noise, before.decided.claimed, before.model, config["rate_hz"], seed, limits)
    row = {"rig": rig["name"], "hidden": hidden, "seed": seed, "given": config["given"], "stated": config["stated"],
           "before": told(before), "honest": honest(told(before), hidden), "after": None, "after_random": [],
           "proposal": None if proposal is None else proposal.document()}
    if proposal is None:
        return row
    others = motions_at_random(before.design.problem, before.model, config["rate_hz"], config["controls"], seed, limits)
    for motion in [proposal.motion, *others]:
        more = [tank.record(motion.document, f"s_next_{k}") for k in range(proposal.recordings)]
        names = told(search_design(design_on(problem_of(Campaign.of(tank.arm, [*first, *more])), None), seed))
        if motion is proposal.motion:
            row["after"] = names
        else:
            row["after_random"].append(names)
    return row | {"settled": settled(row["after"], hidden), "settled_random": [settled(names, hidden) for names in row["after_random"]],
                  "honest_after": honest(row["after"], hidden)}


def line(row: dict) -> str:
    """Return a case in a line."""
    start = f"{row['rig']}: {row['hidden']['effect']} ({row['hidden'].get('joint', 'arm')}), seed {row['seed']}: {words(row['before'])}"
    if row["proposal"] is None:
        return start
    p, controls = row["proposal"], " | ".join(words(names) for names in row["after_random"])
    return (f"{start} -> {p['recordings']} x {p['motion']['kind']}, chance {p['chance']:.2f} ({p['chance_of_a_random_motion']:.2f}): "
            f"{words(row['after'])} [{row['settled']}]; at random: {controls} {row['settled_random']}")


def configured(overrides: list[str]) -> dict:
    """Return config.toml with the overrides of the command line."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    for item in overrides:
        config |= tomllib.loads(item)
    return config


def main() -> None:
    """Run every case that is not there yet."""
    config = configured([item for item in sys.argv[1:] if item != "table"])
    if "table" in sys.argv[1:]:
        rows = [json.loads(path.read_text()) for path in sorted((RUNS / config.get("to", "table")).glob("*.json"))]
        write_json(HERE / "results.json", {"cases": rows, "config": config, "versions": versions()})
        print(table(rows))
        return
    only = config.get("only", "")
    for seed in config["seeds"]:
        for rig in config["rig"]:
            for hidden in rig["hidden"]:
                limits = "stated" if config["stated"] else "shown"
                name = "_".join([config["given"], limits, rig["name"], hidden["effect"], str(hidden.get("joint", 0)), str(seed)])
                path = RUNS / config.get("to", "table") / f"{name.replace(' ', '-')}.json"
                if path.is_file() or only not in name:
                    continue
                row = case(config, rig, hidden, seed)
                path.parent.mkdir(parents=True, exist_ok=True)
                write_json(path, row)
                print(line(row), flush=True)


if __name__ == "__main__":
    main()
