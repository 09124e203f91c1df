"""What a better model buys in tracking: `python training/control/run.py [strips] [concealed] [tank] [ns_tank] [ns_tank_fast] [hour]`.

Writes results.json, table.md, effort.md (rms torque of each joint) and tracking.png (pictures.py).
"""

import json
import resource
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
import yaml
from pictures import draw, tables
from truths import CONFIG, compiled, concealed, strips, tank

from nnhydro.deployment.native import NativeArm
from nnhydro.effects.effect import Effect
from nnhydro.errors import ModelError
from nnhydro.models.domain import DOMAIN, Domain
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.files import write_json, write_text
from nnhydro.simulation.controller import Controller, model_inside
from nnhydro.simulation.motions.motion_kind import Setting, motion_of
from nnhydro.simulation.native_loop import NativeInside, track
from nnhydro.simulation.recipe.recipe import parse_recipe
from nnhydro.simulation.run import grid

HERE = Path(__file__).parent
ROWS = [("pd", None), ("pid", None), *(("computed_torque", m) for m in ("dry", "constant", "state", "diagnosed", "hybrid", "exact")),
        ("sliding_mode", "dry"), ("sliding_mode", "hybrid"),
        *(("computed_torque", f"{m}, water 20 % too weak") for m in ("constant", "state", "diagnosed", "hybrid")),
        ("sliding_mode", "hybrid, water 20 % too weak")]


def weakened(model):
    """Return `model` with the water's coefficients of its physics multiplied by `wrong_by`."""
    if not isinstance(model, StripTheory):
        return replace(model, baseline=weakened(model.baseline))
    terms = {name: term if name == "rigid_body" or isinstance(term, Effect) else replace(term, **{
        f.name: tuple(CONFIG["wrong_by"] * v for v in getattr(term, f.name)) for f in term.parameters() if f.name not in ("tau_s",)})
        for name, term in model.loads.terms.items()}
    return replace(model, loads=Loads(terms))


def references(choice, arm):
    """Return the motions of each seed as (name, reference)."""
    kinds = [motion_of(chosen, "config") for chosen in choice.get("motions", CONFIG["motions"])]
    return [[(kind.name, kind.reference(Setting(arm, np.random.default_rng(seed + number), Path("."))))
             for number, kind in enumerate(kinds)] for seed in CONFIG["motion_seeds"]]


def outside(model, tracked):
    """Return the share of the instants asked for that lie outside what the learned `model` was trained on."""
    domain, found = Domain.parse(model.fit[DOMAIN]), []
    for _, reference in (pair for pairs in tracked for pair in pairs):
        t = grid(reference, 100.0)
        found.append(domain.outside(Motion(tensor(t), *(tensor(x) for x in reference.at(t))), model.arm) > 0)
    return float(np.concatenate(found).mean())


def measured(truth, law, tracked, rate_hz):
    """Return the tracking error in mrad (rms of all seeds, of each, peak) and the rms torque in N m; every controller sees the same."""
    by_seed, torques, known, hold = [], [], {}, round(rate_hz / CONFIG["control_rate_hz"])
    for pairs in tracked:
        errors = []
        for name, reference in pairs:
            drawn = reference.at(np.linspace(0, reference.duration, 100)).q.tobytes()  # a slew has no seed: it is tracked once
            if drawn not in known:
                known[drawn] = track(name, reference, truth, law, rate_hz, hold)
            run = known[drawn]
            errors.append(run.state.q - reference.at(np.minimum(run.t, reference.duration)).q)
            torques.append(run.tau)
        by_seed.append(np.concatenate(errors))
    rms = [1e3 * float(np.sqrt((error**2).mean())) for error in by_seed]
    return {"rms_mrad": float(np.sqrt(np.mean(np.square(rms)))), "rms_mrad_by_seed": rms,
            "peak_mrad": 1e3 * max(float(np.abs(error).max()) for error in by_seed),
            "torque_rms_Nm": np.sqrt((np.concatenate(torques)**2).mean(axis=0)).tolist()}


def slopes(arm, q, qd, qdd, dt):
    """Return d tau / d qd and d tau / d qdd (joints, joints) of a compiled arm, `dt` s after the instant it was asked before."""
    found = []
    for rate, acc, reach in ((1.0, 0.0, 1e-3), (0.0, 1.0, 1e-1)):
        ahead, behind = ([arm.torque(q, qd + sign * rate * reach * unit, qdd + sign * acc * reach * unit, dt=dt, keep=False)
                          for unit in np.eye(len(q))] for sign in (1, -1))
        found.append((np.array(ahead) - np.array(behind)).T / (2 * reach))
    return found


def undamped(truth, inside, tracked):
    """Return the share of the instants at which computed torque leaves a joint without damping: kd M + C_true < C_model, C = d tau / d qd.

    The controller feeds the model's drag at the measured rate back: where that is too strong, it drives the arm.
    """
    dt, found, kd = 1 / CONFIG["control_rate_hz"], [], CONFIG["gains"]["computed_torque"]["kd"]
    for _, reference in (pair for pairs in tracked for pair in pairs):
        for arm in (truth, inside):
            arm.begin()
        for k, (q, qd, qdd) in enumerate(zip(*reference.at(grid(reference, 1 / dt))[:3], strict=True)):
            if k and k % 10 == 0:
                (true, _), (model, mass) = (slopes(arm, q, qd, qdd, dt) for arm in (truth, inside))
                found.append(np.diag(kd * mass + true - model).min() < 0)
            for arm in (truth, inside):
                arm.torque(q, qd, qdd, dt=dt if k else 0.0)
    return float(np.mean(found))


def table(native, exact, models, choice):
    """Return the result of every row of ROWS against the arm `native`, whose own model is `exact` (None: nobody has it)."""
    arm, found, rate_hz = next(iter(models.values())).arm, {}, choice.get("sample_rate_hz", CONFIG["sample_rate_hz"])
    known = {"dry": model_inside("dry", arm, None), **({} if exact is None else {"exact": exact}), **models}
    known |= {f"{name}, water 20 % too weak": weakened(models[name]) for name in models}
    inside, tracked = {name: NativeInside(compiled(model)) for name, model in known.items()}, references(choice, arm)
    for kind, name in ROWS:
        if name and name not in inside:
            continue
        row = f"{kind}{f' ({name})' if name else ''}"
        law = Controller(kind=kind, **CONFIG["gains"][kind], **CONFIG["sees"]).torque_law(arm, CONFIG["control_rate_hz"])
        try:
            found[row] = result = measured(native, replace(law, inside=inside.get(name)), tracked, rate_hz)
        except ModelError as error:  # a learned truth that ends here
            found[row] = None
            print(f"{row}: {error}", flush=True)
            continue
        left = ""
        if kind == "computed_torque" and isinstance(native, NativeArm):
            result["undamped"] = undamped(native, inside[name].arm, tracked)
            left = f" without damping {result['undamped']:.1%}"
        print(f"{kind:16} {name or '':32} {result['rms_mrad']:8.2f} {result['peak_mrad']:8.2f}{left}", flush=True)
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
    """Write results.json, and table.md, effort.md and the picture of the truths that have been run."""
    write_json(HERE / "results.json", results)
    truths = [t for t in CONFIG["truths"] if t in results]
    if not truths:
        return

    for name, text in tables(results, truths).items():
        write_text(HERE / name, text)
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
            if isinstance(made[1], LearnedTorque):
                results.setdefault("outside", {})[name] = share = outside(made[1], references(choice, made[1].arm))
                print(f"outside what the twin was trained on: {share:.1%} of the instants", flush=True)
            results[name] = table(*made, choice)
            written(results)
    if "hour" in wanted:
        recipe = parse_recipe(yaml.safe_load(Path(CONFIG["truths"]["strips"]["recipe"]).read_text())
                              | {"terms": CONFIG["truths"]["strips"]["terms"]}, "strips", Path("."))
        results["hour"] = hour(StripTheory(recipe.arm, Preparation(None), {}, "truth", recipe.loads))
        print(results["hour"])
    written(results)


if __name__ == "__main__":
    main()
