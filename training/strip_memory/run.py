"""How much of the water's force the strips' own history holds: `python training/strip_memory/run.py [CASE ...]`, from the root.

A memory (net.py) that all strips share is trained on the recordings of a fold: on the true force of every strip (`forces`), which no rig
measures, or on the joint torques alone (`torques`). `hybrid`, `stacked`: such a net and the calibrated constants, used as far as nets
without a third of the recordings gain on these (shares.py). Cases: config.toml; those in results.json are not run again. Table: README.md.
"""

import json
import sys
import time
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from net import train
from rows import run_of
from shares import Known, Model, hybrid

from nnhydro.evaluation.protocols.protocol import Material, protocol_called
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import Unit
from nnhydro.runtime.files import write_json, write_text

HERE = Path(__file__).parent
CONFIG = tomllib.loads((HERE / "config.toml").read_text())
HEAD = """# A trained memory of the strips

**Measured with one development version of 0.2.1 (dev1153, 27 November 2026).** The net is that of `net.py`.

`python training/strip_memory/run.py` prints the table. `config.toml` has every choice, `net.py` the net, and `results.json` every number. A
small recurrent net that all strips share is trained on `torques`, the joint torques that were recorded. With `forces`, it is trained on the
true force of every strip, which no rig measures. This shows how much of the force a strip's history determines. `/8` means training on 8
recordings of each fold, and `*3` the mean of three nets. `hybrid` is a net that has learned the residual of the calibrated constants. Its
residual is added in full. `stacked` is a net like that of `torques`, of which a share replaces the constants. `+gain` chooses for each
joint the share with the largest mean gain in N m, on recordings that other nets have not seen. There are three such nets, each trained
without a third of the recordings. `+sure` chooses the share with the largest mean gain minus one standard error. Size, inputs and passes
were chosen on two folds of vortex_tank, and the rule of the share on this table. The figures of that rule are therefore somewhat
optimistic. Nets of `torques` start from other numbers than those of `hybrid` and `stacked`.

error = sum |tau - model| / sum |tau| in % on what is held out, every third row. current hybrid, constant: as in
`training/independent_tanks`.
`worst`, `> 1.1`: error on a recording over that of `constant` there. s: processor time of a fold.

| held out | trained on | error | current hybrid | constant | worst | > 1.1 | s |
| --- | --- | --- | --- | --- | --- | --- | --- |"""


def plain(fitted: Sequence[Unit], known: Known, forces: bool, count: int) -> dict[str, Model]:
    """The mean of `count` nets of all recordings, beside the rigid body."""
    nets = [train([known[unit.name] for unit in fitted], forces, seed, CONFIG) for seed in range(count)]
    return {"": lambda unit: known[unit.name].y - torch.stack([net(known[unit.name]) for net in nets]).mean(dim=0)}


def judge(name: str, protocol: str, case: str) -> dict[str, Any]:
    """What is left of each recording held out, by variants of the case, and the training's processor time a fold."""
    campaign = open_campaign(Path("datasets") / name)
    how, (case_of_all, _, count) = campaign.plan(), case.partition("/")
    kind, _, nets = case_of_all.partition("*")
    split = protocol_called(protocol).split(Material((campaign,), (how,), (group_names(campaign),), 5, 0))
    known = {unit.name: run_of(unit.segments()[0], campaign.arm, Path("datasets") / name / "strips" / f"{unit.name}.npy", CONFIG["stride"])
             for unit in split.units}
    found: dict[str, dict[str, Any]] = {}
    begin = time.process_time()
    for number, fold in enumerate(split.folds):
        fitted = [split.units[i] for i in np.random.default_rng(number).permutation(fold.fitted)[:int(count) if count else None]]
        models = (hybrid(fitted, known, campaign.arm, how, CONFIG, kind == "stacked") if kind in ("hybrid", "stacked")
                  else plain(fitted, known, kind == "forces", int(nets or 1)))
        for variant, left in models.items():
            entry = found.setdefault(f"{name}:{protocol}:{case}{variant}", {"left": {}, "size": {}})
            for unit in (split.units[i] for i in fold.held_out):
                run = known[unit.name]
                entry["left"][unit.name], entry["size"][unit.name] = (float(z[run.keep].abs().sum()) for z in (left(unit), run.tau))
            print(name, protocol, f"{case}{variant}", fold.name, f"so far {100 * error_of(entry):.2f} %", flush=True)
    return {key: entry | {"cpu_s": round((time.process_time() - begin) / len(split.folds), 1)} for key, entry in found.items()}


def error_of(entry: dict[str, Any]) -> float:
    """sum |tau - model| / sum |tau| over recordings."""
    return float(sum(entry["left"].values()) / sum(entry["size"].values()))


def table(results: dict[str, Any]) -> str:
    """The page; constants' and hybrid's errors are those of training/independent_tanks."""
    beside = json.loads((HERE.parent / "independent_tanks" / "results.json").read_text())
    lines = HEAD.splitlines()
    for key, entry in sorted(results.items(), key=lambda item: (item[0].split(":")[1:], item[0])):
        name, protocol, case = key.split(":")
        models = beside[f"{name}:{protocol}"]
        ratios = [left / entry["size"][unit] / models["constant"]["by_recording"][unit] for unit, left in entry["left"].items()]
        errors = " | ".join(f"{100 * error:.1f}" for error in (error_of(entry), models["hybrid"]["error"], models["constant"]["error"]))
        lines.append(f"| {name}, {protocol} | {case} | {errors} | {max(ratios):.2f} | {sum(x > 1.1 for x in ratios)} of {len(ratios)} | "
                     f"{entry['cpu_s']:.0f} |")
    return "\n".join([*lines, ""])


def main() -> None:
    """Run what is named, all by default, and is not there yet."""
    torch.set_num_threads(1)
    path = HERE / "results.json"
    results = json.loads(path.read_text()) if path.exists() else {}
    for key in (key for key in CONFIG["cases"] if key not in results and (not sys.argv[1:] or key in sys.argv[1:])):
        results |= judge(*key.split(":"))
        write_json(path, results)
    write_text(HERE / "README.md", table(results))


if __name__ == "__main__":
    main()
