"""What a better model buys in tracking: `python training/control/run.py [strips] [tank]`. Writes results.json and table.md."""

import json
import resource
import sys
import time
import tomllib
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch
import yaml

from nnhydro.deployment.native import NativeArm
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.files import write_json, write_text
from nnhydro.identification.config import TrainingConfig
from nnhydro.identification.identify import identify
from nnhydro.identification.train import train
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.preprocessing import Preparation
from nnhydro.simulation.campaign_writer import write_campaign
from nnhydro.simulation.controller import Controller, model_inside
from nnhydro.simulation.motions.motion_kind import Setting, motion_of
from nnhydro.simulation.native_loop import NativeInside, tracked
from nnhydro.simulation.recipe import parse_recipe

HERE = Path(__file__).parent
CONFIG = tomllib.loads((HERE / "config.toml").read_text())
ROWS = [("pd", None), ("pid", None), *(("computed_torque", m) for m in ("dry", "constant", "state", "hybrid", "exact")),
        ("sliding_mode", "dry"), ("sliding_mode", "hybrid"),
        *(("computed_torque", f"{m}, water 20 % too weak") for m in ("constant", "state", "hybrid")),
        ("sliding_mode", "hybrid, water 20 % too weak")]


def fitted(campaign):
    """Return the models for a controller, by name."""
    choices = TrainingConfig(**CONFIG["training"], seed=CONFIG["seed"])
    return {"constant": identify(campaign, "constant"), "state": identify(campaign, "state"), "hybrid": train(campaign, choices)}


def strips(choice):
    """Return truth and models for the arm of library terms: simulated, recorded, identified."""
    document = yaml.safe_load(Path(choice["recipe"]).read_text()) | {"terms": choice["terms"]}
    recipe = parse_recipe(document, "strips", Path("."))
    with TemporaryDirectory() as folder:
        write_campaign(recipe, Path(folder) / "tank")
        models = fitted(open_campaign(Path(folder) / "tank"))
    return StripTheory(recipe.arm, Preparation(None), {}, "truth", recipe.loads), models


def tank(choice):
    """Return a learned twin of a recorded tank, and models that saw every other recording of it."""
    campaign = open_campaign(Path(choice["campaign"]))
    twin = train(campaign, TrainingConfig(baseline="state", **CONFIG["training"], seed=CONFIG["seed"] + 1))
    return twin, fitted(Campaign.of(campaign.arm, list(campaign.recordings())[::2]))


def weakened(model):
    """Return `model` with the water's coefficients of its physics multiplied by `wrong_by`."""
    if not isinstance(model, StripTheory):
        return replace(model, baseline=weakened(model.baseline))
    terms = {name: term if name == "rigid_body" else replace(term, **{
        f.name: tuple(CONFIG["wrong_by"] * v for v in getattr(term, f.name)) for f in term.parameters() if f.name not in ("tau_s",)})
        for name, term in model.loads.terms.items()}
    return replace(model, loads=Loads(terms))


def compiled(model):
    """Return `model` as machine code."""
    dynamics = Dynamics(model)
    return NativeArm(dynamics.model, dynamics.affine)


def measured(truth, arm, kind, inside):
    """Return rms and largest tracking error in mrad and the rms torque in N m over all motions, each controller seeing the same."""
    errors, torques = [], []
    for number, chosen in enumerate(CONFIG["motions"]):
        motion = motion_of(chosen, "config")
        reference = motion.reference(Setting(arm, np.random.default_rng(CONFIG["seed"] + number), Path(".")))
        settings = Controller(kind=kind, **CONFIG["gains"][kind], **CONFIG["sees"])
        law = settings.torque_law(arm, CONFIG["sample_rate_hz"] / CONFIG["hold"])
        run = tracked(motion.name, reference, truth, replace(law, inside=inside), CONFIG["sample_rate_hz"], CONFIG["hold"])
        errors.append(run.state.q - reference.at(np.minimum(run.t, reference.duration)).q)
        torques.append(run.tau)
    error, tau = np.concatenate(errors), np.concatenate(torques)
    return {"rms_mrad": 1e3 * float(np.sqrt((error**2).mean())), "peak_mrad": 1e3 * float(np.abs(error).max()),
            "torque_rms_Nm": np.sqrt((tau**2).mean(axis=0)).tolist()}


def table(truth, models):
    """Return the result of every row of ROWS against `truth`."""
    native, arm, found = compiled(truth), truth.arm, {}
    known = {"dry": model_inside("dry", arm, None), "exact": truth, **models}
    known |= {f"{name}, water 20 % too weak": weakened(models[name]) for name in models}
    inside = {name: NativeInside(compiled(model)) for name, model in known.items()}
    for kind, name in ROWS:
        found[f"{kind}{f' ({name})' if name else ''}"] = result = measured(native, arm, kind, inside.get(name))
        print(f"{kind:16} {name or '':32} {result['rms_mrad']:8.2f} {result['peak_mrad']:8.2f}", flush=True)
    return found


def hour(truth):
    """Return errors of the first and of the last minute, memory of the process and size of the state, over an hour at 500 Hz."""
    dt, arm, inside = CONFIG["hold"] / CONFIG["sample_rate_hz"], compiled(truth), compiled(truth)
    count, w = round(CONFIG["hour_s"] / dt), 2 * np.pi * np.array([0.25, 0.35])
    q, qd, error = np.zeros(2), np.zeros(2), np.empty(count)
    arm.torque(q, qd, q)
    began, memory = time.perf_counter(), []
    for k in range(count):
        a, t = np.array([0.8, 0.6]), k * dt
        want, rate, acc = a * (1 - np.cos(w * t)), a * w * np.sin(w * t), a * w**2 * np.cos(w * t)
        tau = inside.torque(q, qd, acc + 100 * (want - q) + 20 * (rate - qd), dt=dt if k else 0.0)
        half = qd + dt / 2 * arm.acceleration(q, qd, tau)
        middle = arm.acceleration(q + dt / 2 * qd, half, tau, dt=dt / 2)
        q, qd = q + dt * half, qd + dt * middle
        arm.torque(q, qd, middle, dt=dt)
        error[k] = np.abs(q - a * (1 - np.cos(w * (t + dt)))).max()
        if k % (count // 60) == 0:
            memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    minute = round(40 / dt)  # two periods of the motion
    first, last = (1e3 * float(np.sqrt((part**2).mean())) for part in (error[minute:2 * minute], error[-minute:]))
    return {"steps": count, "seconds": time.perf_counter() - began, "first_rms_mrad": first, "last_rms_mrad": last,
            "process_MB_after_first_minute": memory[1],
            "process_MB_at_end": memory[-1], "largest_state": float(np.abs(arm.memory).max())}


def main():
    """Run all, print, write."""
    torch.set_num_threads(1)
    path = HERE / "results.json"
    results = json.loads(path.read_text()) if path.exists() else {}
    for name, choice in CONFIG["truths"].items():
        if sys.argv[1:] and name not in sys.argv:
            continue
        truth, models = (strips if name == "strips" else tank)(choice)
        print(name)
        results[name] = table(truth, models)
        if name == "strips":
            results["hour"] = hour(truth)
            print(results["hour"])
        write_json(path, results)
    lines = [f"| {row} | " + " | ".join(f"{results[t][row]['rms_mrad']:.1f} | {results[t][row]['peak_mrad']:.1f}" for t in CONFIG["truths"])
             + " |" for row in results["strips"]] if all(t in results for t in CONFIG["truths"]) else []
    write_text(HERE / "table.md", "\n".join(["| controller | strips: rms, mrad | peak | tank: rms, mrad | peak |", "| --- " * 5 + "|",
                                             *lines, ""]))


if __name__ == "__main__":
    main()
