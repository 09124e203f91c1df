"""Learned models on an arm that no mirror image shows: `python training/asymmetric_arm/run.py [LINE ...]`, from the repository root.

    line       tau_j += -d/dq_j (1/2 k max(0, |anchor - tip| - slack)^2)
    bent link  tau_j += dp/dq_j . (m p'' + 1/2 rho A |p'| p'),    p the place of a body beside the axis of link 2

Results carry the version of nnhydro; what is there from the same version is not run again.
"""

import json
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd

from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.fitting.identify import versions
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import open_campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import derivatives
from nnhydro.runtime.files import write_json, write_text

HERE = Path(__file__).parent
STEP = 1e-5  # rad, of the numerical derivative
COMPARATORS = ("gp", "boosted-trees", "mlp-raw")
HEAD = """# An arm without mirror symmetry

A line or cable fixed to the tank pulls at the tip of the arm of `datasets/ns_tank`, or its second link is bent.
`python training/asymmetric_arm/run.py` adds the torque of this cause to the recordings, fits all models, and prints this table.

**Measured with nnhydro {version}.** Error: sum |tau - model| / sum |tau| in %, on recordings held out of the fit.
[other_versions.csv](other_versions.csv) has the figures of other versions, if any are stored; [config.toml](config.toml) has the choices.

"""
TAIL = """
The target for the hybrid is at most 1.2 times the smallest error of gp, boosted-trees and mlp-raw. One of its choices was made on the
torques of slack_line and cable: the width of the Gaussians in its part without symmetry. Its errors there are therefore somewhat
optimistic. The bent link was not used for that choice.
"""


def place(q: np.ndarray, arm: Arm, along: float, beside: float) -> np.ndarray:
    """Place (n,) m, as complex numbers, of a point of link 2 at the angles q (n, 2) rad."""
    inner, outer = np.exp(1j * np.cumsum(q, axis=1)).T
    return np.asarray(arm.L[0] * inner + complex(along, beside) * outer)


def line_torque(t: np.ndarray, q: np.ndarray, arm: Arm, anchor_m: list[float], slack_m: float, stiffness_N_m: float) -> np.ndarray:
    """Torques (n, 2) N m that hold the arm against a line."""
    def energy(q: np.ndarray) -> np.ndarray:
        stretch = np.maximum(np.abs(complex(*anchor_m) - place(q, arm, arm.L[1], 0.0)) - slack_m, 0.0)
        return np.asarray(0.5 * stiffness_N_m * stretch**2)

    return np.stack([(energy(q + step) - energy(q - step)) / (2 * STEP) for step in STEP * np.eye(2)], axis=1)


def bend_torque(t: np.ndarray, q: np.ndarray, arm: Arm, along_m: float, beside_m: float, mass_kg: float, drag_area_m2: float,
                cutoff_hz: float) -> np.ndarray:
    """Torques (n, 2) N m that move a body beside the axis of link 2."""
    dt = (t[-1] - t[0]) / (len(t) - 1)
    p = place(LowPass(cutoff_hz).apply(q, dt), arm, along_m, beside_m)
    v, a = (derivatives(p.real, dt, order) + 1j * derivatives(p.imag, dt, order) for order in (1, 2))
    force = mass_kg * a + 0.5 * arm.fluid.density_kg_m3 * drag_area_m2 * np.abs(v) * v
    levers = [(place(q + step, arm, along_m, beside_m) - place(q - step, arm, along_m, beside_m)) / (2 * STEP) for step in STEP * np.eye(2)]
    return np.stack([(force * lever.conj()).real for lever in levers], axis=1)


def changed(source: Path, target: Path, what: dict) -> None:
    """Write the campaign `source` to `target` with the torques that `what` adds."""
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("unseen", "answers", "strips", "*.py", "card.*"))
    campaign = open_campaign(target)
    low_pass = campaign.plan(None).low_pass
    for path in sorted((target / "recordings").glob("*.csv")):
        table = pd.read_csv(path)
        t, q = table["t_s"].to_numpy(), table[["q1_rad", "q2_rad"]].to_numpy()
        if "anchor_m" in what:
            added = line_torque(t, q, campaign.arm, **what)
        else:
            assert low_pass is not None
            added = bend_torque(t, q, campaign.arm, **what, cutoff_hz=low_pass.cutoff_hz)
        table[["tau1_Nm", "tau2_Nm"]] += added
        table.to_csv(path, index=False)


def version() -> str:
    """The package's tree in git, `-dirty` where files of it have been changed since."""
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    return git("rev-parse", "--short", "HEAD:nnhydro") + ("-dirty" if git("status", "--porcelain", "--", ":/nnhydro") else "")


def entries_of(results: dict) -> list[tuple[str, str, str, dict]]:
    """Every entry with its version, line and model."""
    return [(entry["version"], line, model, entry) for line, found in results.items() for model, entry in found.items()]


def page(results: dict, version: str, models: list[str]) -> str:
    """The table of `version`: errors in %, one row per model."""
    made = {(model, line): entry for tree, line, model, entry in entries_of(results) if tree == version}
    rows = [(model, [f"{100 * made[model, line]['error']:.1f}" if (model, line) in made else "-" for line in results]) for model in models
            if any((model, line) in made for line in results)]
    table = [f"| model | {' | '.join(results)} |", "| --- |" + " --- |" * len(results),
             *(f"| {model} | {' | '.join(row)} |" for model, row in rows)]
    release = next(iter(made.values()))["versions"]["nnhydro"].partition("+")[0]
    return HEAD.format(version=release) + "\n".join(table) + "\n" + TAIL


def others(results: dict, version: str) -> str:
    """other_versions.csv: what other versions than `version` measured."""
    rows = [f"{made},{line},{model},{100 * entry['error']:.1f},{entry['fit_s']:.0f}"
            for made, line, model, entry in sorted(entries_of(results), key=lambda x: x[:3]) if made != version]
    return "\n".join(["version,line,model,error_percent,fit_s", *rows, ""])


def write_pages(results: dict, models: list[str]) -> None:
    """Write README.md of the version that has measured most, and other_versions.csv."""
    made = [version for version, *_ in entries_of(results)]
    version = max(dict.fromkeys(made), key=made.count)
    write_text(HERE / "README.md", page(results, version, models))
    write_text(HERE / "other_versions.csv", others(results, version))


def main() -> None:
    """Run the lines named on the command line, all by default; `models=A,B` runs these alone."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    path, now = HERE / "results.json", version()
    results = json.loads(path.read_text()) if path.exists() else {}
    models = next((word.removeprefix("models=").split(",") for word in sys.argv[1:] if word.startswith("models=")), config["models"])
    for name in [word for word in sys.argv[1:] if not word.startswith("models=")] or config["lines"]:
        found = results.setdefault(name, {})
        with tempfile.TemporaryDirectory() as folder:
            changed(Path(config["campaign"]), Path(folder) / name, config["lines"][name])
            for model in models:
                if found.get(model, {}).get("version") == now:
                    continue
                result = BenchmarkOptions([model], config["folds"], config["seed"]).benchmark(open_campaign(Path(folder) / name)).document()
                entry = result["models"][model]
                found[model] = {key: entry[key] for key in ("error", "nrmse", "fit_s", "by_recording")} | {
                    "version": now, "seed": config["seed"], "folds": config["folds"], "added": config["lines"][name],
                    "versions": versions() | {"campaign_sha256": result["versions"]["campaign_sha256"]}}
                write_json(path, results)
                write_pages(results, config["models"])
                print(name, model, f"{100 * found[model]['error']:.1f} %", flush=True)


if __name__ == "__main__":
    main()
