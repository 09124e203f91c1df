"""Learned models on tanks without a planted law: `python training/independent_tanks/run.py [SET[:PROTOCOL] ...] [models=A,B]`, from root.

One model at a time; results.json is written after each, and a model that is there from the same version is not run again: a run that was
stopped goes on where it was. README.md shows what the version at hand made and nothing else.
"""

import json
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.files import write_json, write_text

HERE = Path(__file__).parent
BASES, LEARNED = ("constant", "state"), ("network", "hybrid")
HEAD = ["# Learned models on independent tanks", "",
        "`python training/independent_tanks/run.py` prints this table; `config.toml` holds all choices, `results.json` all numbers.",
        "No feature uses an equation of the data.", "",
        "- `error`: sum |tau - model| / sum |tau| in %, on recordings (or whole kinds of motion) held out of the fit.",
        "- `bar`: the target. With recordings held out, it is half the error of `state`, or a third of that of `constant`, whichever is",
        "  less. With kinds of motion held out, it is 0.8 times the error of the better baseline. For cfd_cylinder and rivera_tank,",
        "  config.toml states it.",
        "- `worst`: largest error on a recording, relative to that of `constant`; the aim is at most 1.1.",
        "- `> 1.1`: number of recordings on which the error is more than 1.1 times that of `constant`.",
        "- `95 %`: share of held-out rows within the model's 95 % intervals.",
        "- `_60`, `_100`: the tank with as many recordings, drawn by datasets/strip_more.py beside the 20 listed ones.", "",
        "| tank | protocol | model | error | bar | worst | > 1.1 | 95 % |", f"|{' --- |' * 8}"]
TAIL = ["", "`python training/independent_tanks/where.py ns_tank` prints where the error of the hybrid stands: by kind of motion,",
        "by time, and by frequency.", "",
        "The memory that rivera_tank plants is of first order. No feature has this memory: those of features/wake.py are of second",
        "order. One version of nnhydro made this table. In results.json, `version` is the hash of the folder `nnhydro`",
        "in git (`git rev-parse --short COMMIT:nnhydro`).", ""]


def version() -> str:
    """What made the figures: the package's tree in git, `-dirty` where files of it have been changed since."""
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    return git("rev-parse", "--short", "HEAD:nnhydro") + ("-dirty" if git("status", "--porcelain", "--", ":/nnhydro") else "")


def campaign_of(name: str, chosen: dict) -> Path:
    """The campaign of a set; one with `more` motions is made in runs/ if it is not there."""
    listed = Path(chosen["campaign"])
    if "more" not in chosen:
        return listed
    made = HERE / "runs" / name
    if not made.is_dir():
        made.parent.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=made.parent) as place:
            more = [sys.executable, str(listed.parent / "strip_more.py"), listed.name, str(chosen["more"]), f"{place}/{name}"]
            subprocess.run(more, check=True)
            Path(place, name).rename(made)
    return made


def bar(models: dict, kinds: bool, stated: float | None) -> str:
    """The error in % that was asked of a learned model: as stated, or beside the baselines of the same table, nothing without them."""
    if stated is not None:
        return f"{stated:.1f}"
    if not all(name in models for name in BASES):
        return ""
    constant, state = (models[name]["error"] for name in BASES)
    return f"{100 * (0.8 * min(constant, state) if kinds else min(state / 2, constant / 3)):.1f}"


def row(key: str, name: str, entry: dict, models: dict, asked: str) -> str:
    """A line of the table."""
    covered, cells, constant = entry.get("coverage", {}).get("shares", {}).get("95"), ("", ""), models.get("constant")
    if constant is not None and name not in BASES:
        ratios = [error / constant["by_recording"][unit] for unit, error in entry["by_recording"].items()]
        cells = (f"{max(ratios):.2f}", f"{sum(ratio > 1.1 for ratio in ratios)} of {len(ratios)}")
    asked = asked if name in LEARNED else ""
    return (f"| {key.replace(':', ' | ')} | {name} | {100 * entry['error']:.1f} | {asked} | {cells[0]} | {cells[1]} | "
            f"{'' if covered is None else f'{100 * covered:.0f}'} |")


def table(results: dict, now: str, sets: dict) -> str:
    """The page: what the version `now` made."""
    lines = [*HEAD]
    for key, every in results.items():
        models = {name: entry for name, entry in every.items() if entry["version"] == now}
        if models:
            asked = bar(models, key.endswith("leave-kind-out"), sets[key.split(":")[0]].get("bar"))
            lines += [row(key, name, entry, models, asked) for name, entry in sorted(models.items(), key=lambda item: item[1]["error"])]
    return "\n".join([*lines, *TAIL])


def main() -> None:
    """Run what is named on the command line, all by default, and is not there yet."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    path, now = HERE / "results.json", version()
    results = json.loads(path.read_text()) if path.exists() else {}
    every = [f"{name}:{protocol}" for name, one in config["sets"].items() for protocol in one["protocols"]]
    write_text(HERE / "README.md", table(results, now, config["sets"]))
    given = [word.removeprefix("models=").split(",") for word in sys.argv[1:] if word.startswith("models=")]
    asked = [word for word in sys.argv[1:] if not word.startswith("models=")] or every
    for key in (key for key in every if key in asked or key.split(":")[0] in asked):
        name, protocol = key.split(":")
        chosen, found = config["sets"][name], results.setdefault(key, {})
        for model in given[0] if given else chosen.get("models", config["models"]):
            if found.get(model, {}).get("version") == now:
                continue
            options = BenchmarkOptions([model], config["folds"], config["seed"], protocol=protocol)
            result = options.benchmark(open_campaign(campaign_of(name, chosen)))
            found[model] = result.document()["models"][model] | {"version": now}
            write_json(path, results)
            write_text(HERE / "README.md", table(results, now, config["sets"]))
            print(key, model, f"{100 * found[model]['error']:.2f} %", flush=True)


if __name__ == "__main__":
    main()
