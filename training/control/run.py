"""What a better model buys in tracking: `python training/control/run.py [strips] [concealed] [tank] [ns_tank] [hour]`.

Writes results.json, table.md and tracking.png (pictures.py).
"""

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
from pictures import draw

import nnhydro
from nnhydro.blind_tests.truth.campaign import Wish, draw_campaign
from nnhydro.blind_tests.truth.tank import joint_torque
from nnhydro.blind_tests.truth.world import TrueRun
from nnhydro.deployment.native import NativeArm
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.effects.effect import Effect
from nnhydro.errors import ModelError
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.files import write_json, write_text
from nnhydro.simulation.campaign_writer import write_campaign
from nnhydro.simulation.controller import Controller, model_inside
from nnhydro.simulation.motions.motion_kind import Setting, motion_of
from nnhydro.simulation.native_loop import NativeInside, track
from nnhydro.simulation.recipe.recipe import parse_recipe

HERE = Path(__file__).parent
CONFIG = tomllib.loads((HERE / "config.toml").read_text())
ROWS = [("pd", None), ("pid", None), *(("computed_torque", m) for m in ("dry", "constant", "state", "diagnosed", "hybrid", "exact")),
        ("sliding_mode", "dry"), ("sliding_mode", "hybrid"),
        *(("computed_torque", f"{m}, water 20 % too weak") for m in ("constant", "state", "diagnosed", "hybrid")),
        ("sliding_mode", "hybrid, water 20 % too weak")]


def fitted(campaign):
    """Return the models for a controller, by name."""
    choices = TrainingConfig(**CONFIG["training"], seed=CONFIG["seed"])
    return {"constant": identify(campaign, "constant"), "state": identify(campaign, "state"),
            "diagnosed": nnhydro.diagnose(campaign, seed=CONFIG["seed"]).corrected.torque_model, "hybrid": train(campaign, choices)}


def strips(choice):
    """Return truth and models for the arm of library terms: simulated, recorded, identified."""
    document = yaml.safe_load(Path(choice["recipe"]).read_text()) | {"terms": choice["terms"]}
    recipe = parse_recipe(document, "strips", Path("."))
    with TemporaryDirectory() as folder:
        write_campaign(recipe, Path(folder) / "tank")
        models = fitted(open_campaign(Path(folder) / "tank"))
    truth = StripTheory(recipe.arm, Preparation(None), {}, "truth", recipe.loads)
    return compiled(truth), truth, models


def tank(choice):
    """Return a learned twin of a recorded tank, and models that saw every other recording of it."""
    campaign = open_campaign(Path(choice["campaign"]))
    twin = train(campaign, TrainingConfig(baseline="state", **CONFIG["training"], seed=CONFIG["seed"] + 1))
    return compiled(twin), twin, fitted(Campaign.of(campaign.arm, list(campaign.recordings())[::2]))


class ConcealedArm:
    """The arm of a concealed world as it really is, without memory: what the control loop asks of a compiled arm."""

    def __init__(self, world):
        self.arm, self.causes = world.arm, world.causes

    def begin(self):
        """Nothing is remembered."""

    def torque(self, *motion, **others):
        """What happened is noted by arms with a memory; this one has none, and the loop asks for nothing else."""

    def torques(self, q, qd, qdd, u0, du0):
        """Return the joint torques (k, joints) N m at the accelerations `qdd` (k, joints)."""
        still = np.zeros(len(qdd))
        motion = (np.broadcast_to(x, qdd.shape) for x in (q, qd))
        run = TrueRun("loop", np.arange(len(qdd)) * 1e-3, *motion, qdd, still + u0, still + du0)
        return joint_torque(run, self.arm, self.causes)

    def acceleration(self, q, qd, tau, u0=0.0, du0=0.0, dt=0.0, start=None):
        """Return the accelerations (joints,) rad/s^2 under `tau` (joints,) N m."""
        n = len(q)
        found = self.torques(q, qd, np.vstack([np.zeros(n), np.eye(n)]), u0, du0)
        return np.linalg.solve((found[1:] - found[0]).T, tau - found[0])


def concealed(choice):
    """Return an arm with a cause that no model is told of, by other equations and other code, and models fitted to its recordings."""
    drawn = draw_campaign(CONFIG["seed"], choice["index"], Wish(choice["effect"], links=2, size="small"))
    with TemporaryDirectory() as folder:
        write_text(Path(folder) / "arm.yaml", yaml.safe_dump(drawn.arm, sort_keys=False))
        for name, columns in drawn.files.items():
            if name.startswith("recordings/"):
                rows = np.column_stack(list(columns.values()))
                write_text(Path(folder) / name, "\n".join([",".join(columns), *(",".join(f"{x:.9g}" for x in row) for row in rows)]) + "\n")
        models = fitted(open_campaign(Path(folder)))
    return ConcealedArm(next(iter(drawn.unseen.values()))), None, models


def weakened(model):
    """Return `model` with the water's coefficients of its physics multiplied by `wrong_by`."""
    if not isinstance(model, StripTheory):
        return replace(model, baseline=weakened(model.baseline))
    terms = {name: term if name == "rigid_body" or isinstance(term, Effect) else replace(term, **{
        f.name: tuple(CONFIG["wrong_by"] * v for v in getattr(term, f.name)) for f in term.parameters() if f.name not in ("tau_s",)})
        for name, term in model.loads.terms.items()}
    return replace(model, loads=Loads(terms))


def compiled(model):
    """Return `model` as machine code."""
    dynamics = Dynamics(model)
    return NativeArm(dynamics.model, dynamics.affine)


def measured(truth, arm, kind, inside, rate_hz):
    """Return the tracking error in mrad (rms of all seeds, of each, peak) and the rms torque in N m; every controller sees the same."""
    by_seed, torques, known, hold = [], [], {}, round(rate_hz / CONFIG["control_rate_hz"])
    for seed in CONFIG["motion_seeds"]:
        errors = []
        for number, chosen in enumerate(CONFIG["motions"]):
            motion = motion_of(chosen, "config")
            reference = motion.reference(Setting(arm, np.random.default_rng(seed + number), Path(".")))
            drawn = reference.at(np.linspace(0, reference.duration, 100)).q.tobytes()  # a slew has no seed: it is tracked once
            if drawn not in known:
                law = Controller(kind=kind, **CONFIG["gains"][kind], **CONFIG["sees"]).torque_law(arm, CONFIG["control_rate_hz"])
                known[drawn] = track(motion.name, reference, truth, replace(law, inside=inside), rate_hz, hold)
            run = known[drawn]
            errors.append(run.state.q - reference.at(np.minimum(run.t, reference.duration)).q)
            torques.append(run.tau)
        by_seed.append(np.concatenate(errors))
    rms = [1e3 * float(np.sqrt((error**2).mean())) for error in by_seed]
    return {"rms_mrad": float(np.sqrt(np.mean(np.square(rms)))), "rms_mrad_by_seed": rms,
            "peak_mrad": 1e3 * max(float(np.abs(error).max()) for error in by_seed),
            "torque_rms_Nm": np.sqrt((np.concatenate(torques)**2).mean(axis=0)).tolist()}


def table(native, exact, models, rate_hz):
    """Return the result of every row of ROWS against the arm `native`, whose own model is `exact` (None: nobody has it)."""
    arm, found = next(iter(models.values())).arm, {}
    known = {"dry": model_inside("dry", arm, None), **({} if exact is None else {"exact": exact}), **models}
    known |= {f"{name}, water 20 % too weak": weakened(models[name]) for name in models}
    inside = {name: NativeInside(compiled(model)) for name, model in known.items()}
    for kind, name in ROWS:
        if name and name not in inside:
            continue
        row = f"{kind}{f' ({name})' if name else ''}"
        try:
            found[row] = result = measured(native, arm, kind, inside.get(name), rate_hz)
        except ModelError as error:  # a learned truth that ends here
            found[row] = None
            print(f"{row}: {error}", flush=True)
            continue
        print(f"{kind:16} {name or '':32} {result['rms_mrad']:8.2f} {result['peak_mrad']:8.2f}", flush=True)
    return found


def hour(truth):
    """Return errors of the first and of the last minute, memory of the process and size of the state, over an hour at 500 Hz."""
    dt, arm, inside = 1 / CONFIG["control_rate_hz"], compiled(truth), compiled(truth)
    count, w = round(CONFIG["hour_s"] / dt), 2 * np.pi * np.array([0.25, 0.35])
    q, qd, error = np.zeros(2), np.zeros(2), np.full(count, np.nan)  # filled: its own pages are not to be taken for growth
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


def written(results):
    """Write results.json, and table.md and the picture of the truths that have been run."""
    write_json(HERE / "results.json", results)
    truths = [t for t in CONFIG["truths"] if t in results]
    if not truths:
        return

    def cell(one):
        if one is None:
            return "- | -"
        seeds = one["rms_mrad_by_seed"]
        return f"{one['rms_mrad']:.3g} ({min(seeds):.3g} to {max(seeds):.3g}) | {one['peak_mrad']:.3g}"

    lines = [f"| {row} | " + " | ".join(cell(results[t].get(row)) for t in truths) + " |" for row in results[truths[0]]]
    head = "| controller | " + " | ".join(f"{t}: rms, mrad (by seed) | peak" for t in truths) + " |"
    write_text(HERE / "table.md", "\n".join([head, "| --- " * (1 + 2 * len(truths)) + "|", *lines, ""]))
    draw(results, truths, HERE / "tracking.png")


def main():
    """Run all, or what is named, print, write."""
    torch.set_num_threads(1)
    path, wanted = HERE / "results.json", sys.argv[1:] or [*CONFIG["truths"], "hour"]
    results = json.loads(path.read_text()) if path.exists() else {}
    for name in CONFIG["truths"]:
        if name in wanted:
            print(name, flush=True)
            choice = CONFIG["truths"][name]
            made = {"strips": strips, "concealed": concealed}.get(name, tank)(choice)
            results[name] = table(*made, choice.get("sample_rate_hz", CONFIG["sample_rate_hz"]))
            written(results)
    if "hour" in wanted:
        recipe = parse_recipe(yaml.safe_load(Path(CONFIG["truths"]["strips"]["recipe"]).read_text())
                              | {"terms": CONFIG["truths"]["strips"]["terms"]}, "strips", Path("."))
        results["hour"] = hour(StripTheory(recipe.arm, Preparation(None), {}, "truth", recipe.loads))
        print(results["hour"])
    written(results)


if __name__ == "__main__":
    main()
