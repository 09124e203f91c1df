"""Learned models on campaigns of other authors: `python training/foreign/learned.py FOLDER OUT [FIRST:LAST:STEP] [models=A,B] [CASE ...]`.

FOLDER holds campaigns (folders with arm.yaml). Where truth_of_unseen/CASE is there, models are fitted to all recordings and judged on the
unseen motions; else recordings are held out in five folds. answers.json may say what is hidden: of simulated campaigns only those are taken
whose hidden effects are all among HIDDEN, or which are named. A campaign without torques has no error and is left out. The noise floor is
what repeated motions say. OUT/learned.json holds every figure, OUT/learned.md the tables; what is there from the same version is not run
again.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from nnhydro.errors import NnhydroError
from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.evaluation.entries import entries
from nnhydro.evaluation.metrics import Misfit
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import versions
from nnhydro.models.prediction import predict
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.repeats import group_names, noise_floor
from nnhydro.recordings.splitting import units
from nnhydro.runtime.files import write_json, write_text

HIDDEN = {"umbilical_stiffness", "wake_development", "flow_memory", "reynolds_drag", "coulomb_friction", "viscous_friction",
          "stribeck_friction", "load_friction"}
SEED, FOLDS = 0, 5
BASES = ("rigid", "constant", "state")


def on_unseen(root: Path, case: str, model: str, campaign: Campaign) -> float:
    """Error on the unseen motions, whose torques are free of noise, of a model of all recordings."""
    how, entry = campaign.plan(None), entries([model], (campaign,), TrainingConfig(seed=SEED))[0]
    fitted = entry.fit(units(campaign, how, SEED, group_names(campaign)), campaign.arm, how, None)
    misfits = []
    for path in sorted((root / "truth_of_unseen" / case).glob("*")):
        truth = pd.read_parquet(path) if path.suffix == ".parquet" else pd.read_csv(path)
        motion = read_recording(root / case / "unseen" / path.name, campaign.arm, torque=False)
        misfits.append(Misfit.of(truth.to_numpy(), predict(fitted, motion).tau))
    return Misfit.total(misfits).error


def version() -> str:
    """The package's tree in git, `-dirty` where files of it have been changed since."""
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=Path(__file__).parent).stdout.strip()

    return git("rev-parse", "--short", "HEAD:nnhydro") + ("-dirty" if git("status", "--porcelain", "--", ":/nnhydro") else "")


def page(results: dict[str, Any]) -> str:
    """A line per campaign, and what they say together."""
    names = sorted({name for row in results.values() for name in row["models"]}, key=lambda name: (name not in BASES, name))
    lines = ["| campaign | hidden | " + " | ".join(names) + " | noise floor | hybrid over floor | over best baseline |",
             "| --- " * (len(names) + 5) + "|"]
    floors, bases, ranks = [], [], []
    for case, row in results.items():
        errors = {name: entry["error"] for name, entry in row["models"].items()}
        least, floor = min((errors[name] for name in BASES if name in errors), default=None), row["noise_floor"]
        over = errors["hybrid"] / floor if "hybrid" in errors and floor else None
        beside = errors["hybrid"] / least if "hybrid" in errors and least else None
        floors += [] if over is None else [over]
        bases += [] if beside is None else [beside]
        others = [error for name, error in errors.items() if name not in ("hybrid", "network")]
        ranks += [] if "hybrid" not in errors else [1 + sum(error < errors["hybrid"] for error in others)]
        cells = [f"{100 * errors[name]:.1f}" if name in errors else "" for name in names]
        lines.append(f"| {case} | {row['hidden']} | {' | '.join(cells)} | {'' if floor is None else f'{100 * floor:.1f}'} | "
                     f"{'' if over is None else f'{over:.1f}'} | {'' if beside is None else f'{beside:.2f}'} |")
    if bases:
        lines += ["", f"Hybrid: median {np.median(floors):.1f} noise floors ({len(floors)} campaigns)." if floors else "",
                  f"Over the best baseline: at most {max(bases):.2f}; above 1.05 in {sum(b > 1.05 for b in bases)} of {len(bases)}.",
                  f"Mean rank among baselines and comparators: {np.mean(ranks):.1f} (1 is best)."]
    return "\n".join([*lines, ""])


def main() -> None:
    """Run what is not there yet."""
    root, out = Path(sys.argv[1]), Path(sys.argv[2])
    if not root.is_dir():
        sys.exit(f"{root}: is not here. These campaigns are not part of this repository; datasets/foreign holds eight of their kind")
    words = sys.argv[3:]
    asked = next((word.removeprefix("models=").split(",") for word in words if word.startswith("models=")), None)
    part = slice(*(int(x) if x else None for x in next((word for word in words if ":" in word), ":").split(":")))
    named = [word for word in words if "=" not in word and ":" not in word]
    answers = json.loads((root / "answers.json").read_text()) if (root / "answers.json").exists() else {}
    hidden = {case: [h["effect"] for h in answer["hidden"]] for case, answer in answers.items() if "hidden" in answer}
    now = version()
    cases = named or [case for case in sorted(path.parent.name for path in root.glob("*/arm.yaml"))
                      if case not in hidden or (hidden[case] and set(hidden[case]) <= HIDDEN)][part]
    out.mkdir(parents=True, exist_ok=True)
    results = json.loads((out / "learned.json").read_text()) if (out / "learned.json").exists() else {}
    for case in cases:
        campaign = open_campaign(root / case)
        floor = noise_floor(campaign, campaign.plan(None))
        row = results.setdefault(case, {"models": {}})
        row |= {"hidden": "+".join(hidden.get(case, [])), "noise_floor": None if floor is None else floor.error, "seed": SEED,
                "campaign_sha256": campaign.sha256()}
        plain = ["rigid"] if campaign.arm.dry else ["constant", "state"]
        for model in asked or [*plain, "network", "hybrid", "gp", "boosted-trees", "mlp-raw"]:
            if row["models"].get(model, {}).get("version") == now or (model in BASES and model not in plain):
                continue
            try:
                if (root / "truth_of_unseen" / case).is_dir():
                    error, recordings = on_unseen(root, case, model, campaign), None
                else:
                    document = BenchmarkOptions([model], FOLDS, SEED).benchmark(campaign).document()["models"][model]
                    error, recordings = document["error"], document["by_recording"]
            except NnhydroError as cause:
                print(f"{case} {model}: {cause}", flush=True)
                continue
            if not np.isfinite(error) or error > 1e3:
                print(f"{case}: no torque to speak of, no error", flush=True)
                break
            row["models"][model] = {"error": error, "by_recording": recordings, "version": now, "versions": versions()}
            write_json(out / "learned.json", results)
            print(f"{case} {row['hidden']} {model} {100 * error:.1f} %", flush=True)
        if not row["models"]:
            del results[case]
    write_json(out / "learned.json", results)
    write_text(out / "learned.md", page(results))
    print(page(results))


if __name__ == "__main__":
    main()
