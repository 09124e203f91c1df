"""How often the diagnosis errs where the truth is known: `python training/error_rates/run.py [false_alarms] [coverage] [KEY=VALUE ...]`.

false_alarms  healthy arms: the torque of the simulated arm of plan.yaml plus noise that is drawn anew; how often the diagnosis speaks.
              White, correlated (AR(1), 0.8) and heavy-tailed (Student's t with 3 degrees) noise; derivatives given, or angles alone
              from noisy encoders, which are drawn anew every `per_motion` draws.
coverage      effects of the catalogue planted at some times the smallest size that the recordings reveal, everything else as above; how
              often the 95 % intervals of what is named hold the truth. The truth has the card's own form: intervals tell chance, not form.

KEY=VALUE overrides config.toml. Writes false_alarms.json and coverage.json; a run that was ended starts again.
"""

import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch
import yaml
from numpy.typing import NDArray
from scipy.signal import lfilter

from nnhydro.diagnosis.calibration.injection import inject
from nnhydro.diagnosis.calibration.power import power
from nnhydro.diagnosis.diagnose import diagnose, search_design
from nnhydro.diagnosis.findings.finding import findings_of
from nnhydro.effects.catalogue import catalogue
from nnhydro.evaluation.metrics import interval_of_share
from nnhydro.fitting.identify import versions
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.runtime.files import write_json
from nnhydro.simulation.campaign_writer import write_campaign
from nnhydro.simulation.recipe.recipe import parse_recipe

Array = NDArray[np.float64]
HERE = Path(__file__).parent
CORRELATED, TAIL = 0.8, 3.0
NOMINAL = 0.01


def campaign(given: bool) -> Campaign:
    """Return the recordings of plan.yaml without noise, with or without derivatives."""
    plan = yaml.safe_load((HERE / "plan.yaml").read_text())
    plan["sensors"] |= {"velocities": given, "accelerations": given}
    with TemporaryDirectory() as folder:
        write_campaign(parse_recipe(plan, "plan.yaml", HERE), Path(folder) / "made")
        made = open_campaign(Path(folder) / "made")
        return Campaign.of(made.arm, list(made.recordings()))


def shaken(healthy: Campaign, size: float, seed: int) -> Campaign:
    """Return the campaign read by noisy encoders; `size` in rad."""
    rng = np.random.default_rng(seed)
    return Campaign.of(healthy.arm, [replace(r, q=r.q + size * rng.standard_normal(r.q.shape)) for r in healthy.recordings()])


def noise(kind: str, shape: tuple[int, ...], rng: np.random.Generator) -> Array:
    """Return noise of the given kind and unit variance."""
    if kind == "tailed":
        return np.asarray(rng.standard_t(TAIL, shape) / np.sqrt(TAIL / (TAIL - 2)))
    white = rng.standard_normal(shape)
    if kind == "white":
        return white
    return np.asarray(lfilter([np.sqrt(1 - CORRELATED**2)], [1, -CORRELATED], white, axis=0))


def disturbed(healthy: Campaign, kind: str, level: Array, seed: int) -> Campaign:
    """Return the campaign with noise of the standard deviation `level` (joints,) N m added to every torque."""
    drawn = [(r, noise(kind, r.q.shape, np.random.default_rng([seed, k]))) for k, r in enumerate(healthy.recordings())]
    return Campaign.of(healthy.arm, [replace(r, tau=r.tau + level * e) for r, e in drawn])


def rms(healthy: Campaign) -> Array:
    """Return the rms of the measured torque (joints,) N m."""
    return np.asarray(np.sqrt(np.mean(np.concatenate([r.tau**2 for r in healthy.recordings() if r.tau is not None]), axis=0)))


def share(hits: int, tries: int) -> dict[str, float]:
    """Return a share with its 95 % interval."""
    low, high = interval_of_share(hits, tries)
    return {"share": hits / tries, "low": low, "high": high, "hits": hits, "tries": tries}


def false_alarms(config: dict) -> None:
    """Print how often healthy arms are called ill."""
    rows = []
    print(f"{'motion':>12} {'noise':>10} {'draws':>6} {'alarms':>7} {'share':>7}   95 % interval        nominal {NOMINAL}")
    for motion in ("given", "angles only"):
        healthy = campaign(motion == "given")
        for kind in ("white", "correlated", "tailed"):
            hits = 0
            for draw in range(config["draws"]):
                if draw % config["per_motion"] == 0:
                    now = healthy if motion == "given" else shaken(healthy, config["encoder_noise_rad"], config["seed"] + draw)
                noisy = disturbed(now, kind, config["noise"] * rms(now), config["seed"] + draw)
                hits += diagnose(noisy, seed=draw).detected
            rows.append({"motion": motion, "noise": kind} | share(hits, config["draws"]))
            found = rows[-1]
            print(f"{motion:>12} {kind:>10} {found['tries']:>6} {found['hits']:>7} {found['share']:>7.4f}   "
                  f"{found['low']:.4f} to {found['high']:.4f}", flush=True)
    total = share(sum(r["hits"] for r in rows), sum(r["tries"] for r in rows))
    print(f"all: {total['hits']} of {total['tries']}, {total['share']:.4f} ({total['low']:.4f} to {total['high']:.4f})")
    write_json(HERE / "false_alarms.json", {"rows": rows, "all": total, "config": config, "versions": versions()})


def coverage(config: dict) -> None:
    """Print how often intervals hold the truth."""
    healthy = campaign(True)
    found = power(disturbed(healthy, "white", config["noise"] * rms(healthy), config["seed"]))
    seen = [row for row in found.rows if row.size is not None]
    inside: dict[str, list[bool]] = {}
    missed, elsewhere = 0, 0
    for number, row in enumerate(seen):
        others = [name for name in catalogue() if name != row.hypothesis.effect.id]
        for draw in range(config["repeats"]):
            values = row.direction * row.size * config["times"]
            z = np.zeros(found.design.Y.shape[2])
            design = inject(found.design, found.noise, found.model, z, [(row.hypothesis, values)], config["seed"] + 100 * number + draw)
            named = search_design(design, draw, others)
            claimed = named.decided.claimed
            told = {(f.effect, f.law.joint): f for f in findings_of(named.search, claimed)}
            finding = told.get(row.hypothesis.key)
            missed += finding is None
            truth = row.hypothesis.with_values(torch.from_numpy(values)).quantities()
            told_here = {} if finding is None else {name: q for name, q in truth.items() if name in finding.parameters}
            elsewhere += 0 if finding is None else len(truth) - len(told_here)
            for name, quantity in told_here.items():
                low, high = finding.parameters[name].ci95
                inside.setdefault(f"{row.hypothesis.key[0]}.{name}", []).append(bool(low <= quantity.value <= high))
        mine = {k: v for k, v in inside.items() if k.startswith(row.hypothesis.key[0] + ".")}
        print(f"{row.hypothesis.key[0]:>22} joint {row.hypothesis.key[1]}  "
              + ", ".join(f"{k.partition('.')[2]} {sum(v)}/{len(v)}" for k, v in mine.items()), flush=True)
    every = [x for values in inside.values() for x in values]
    total = share(sum(every), len(every))
    print(f"all: {total['hits']} of {total['tries']} intervals hold the truth, {total['share']:.3f} "
          f"({total['low']:.3f} to {total['high']:.3f}); {missed} planted effects were not named; "
          f"{elsewhere} values belong to a form of the law other than the one named")
    write_json(HERE / "coverage.json", {"inside": {k: share(sum(v), len(v)) for k, v in inside.items()}, "all": total, "missed": missed,
                                        "other_form": elsewhere,
                                        "config": config, "versions": versions()})


def main() -> None:
    """Run what is asked for."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    for key, _, value in (item.partition("=") for item in sys.argv[1:] if "=" in item):
        config[key] = type(config[key])(value)
    asked = [item for item in sys.argv[1:] if "=" not in item] or ["false_alarms", "coverage"]
    for name, work in (("false_alarms", false_alarms), ("coverage", coverage)):
        if name in asked:
            work(config)


if __name__ == "__main__":
    main()
