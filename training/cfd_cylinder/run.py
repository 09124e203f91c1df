"""C_D(s/D), C_M(s/D) against Navier-Stokes: `python training/cfd_cylinder/run.py` (about a minute); writes results.json."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

from nnhydro.evaluation.mclain.study import PHASES, Candidate, TowedMotion, fit_and_predict, leave_one_out
from nnhydro.fitting.identify import versions
from nnhydro.models.baselines import baseline
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.history_force import HistoryForce
from nnhydro.physics.travel.state_model import bspline_loads, state_loads
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.files import write_json

HERE = Path(__file__).parent
RULES = ("reset", "keep", "decay")


def water(loads: Loads) -> Loads:
    """The terms of the water: the cylinder's own mass is not in these torques."""
    return Loads({name: term for name, term in loads.terms.items() if name != "rigid_body"})


def candidates(arm: Arm, config: dict) -> list[Candidate]:
    """The models in the order of the table; with a history term beside each that is fitted."""
    one, two = np.linspace(*config["one_scale"]), np.linspace(*config["two_scales"])
    weights = np.geomspace(*config["penalties"])
    end = np.array([config["b_spline_end"]])
    spline, free = water(state_loads(arm, per_link=1)), water(bspline_loads(arm, config["b_splines"], float(end[0]), per_link=1))
    found = [Candidate(name, water(baseline(name).start(arm)), fitted=False) for name in ("drag-only", "textbook")]
    fitted = [Candidate("fitted constants", water(baseline("constant").start(arm))), Candidate("spline, one scale", spline, (one,)),
              Candidate("spline, two scales", spline, (two, two)),
              Candidate("spline, one scale, bends penalised", spline, (one,), weights),
              Candidate("spline, two scales, bends penalised", spline, (two, two), weights),
              Candidate("B-splines, bends penalised", free, (end,), weights)]
    history = [replace(c, name=f"{c.name}, history", loads=c.loads.plus("history", HistoryForce.at_start(arm))) for c in fitted]
    return [*found, *fitted, *history]


def main() -> None:
    """Print and store the errors of every model, pooled, by phase, and on reversing motions."""
    config = tomllib.loads((HERE / "config.toml").read_text())
    campaign = open_campaign(HERE / config["campaign"])
    how = campaign.plan()

    def motion(name: str, until: float = np.inf) -> TowedMotion:
        return TowedMotion.of(campaign.segments(name, how)[0], campaign.arm, config["slowest"], until)

    seen, unseen = [motion(name) for name in config["fitted"]], [motion(*item) for item in config["predicted"].items()]
    results = {}
    print(f"{'':42s}{'left out':>9s} |{''.join(f'{phase:>17s}' for phase in PHASES[:3])} |{''.join(f'{m.name:>9s}' for m in unseen)}")
    for candidate in candidates(campaign.arm, config):
        out = leave_one_out(candidate, seen)
        loads, far = fit_and_predict(candidate, seen, unseen)
        results[candidate.name] = {"left_out": out.error, "by_motion": out.by_motion, "by_phase": out.by_phase,
                                   "unseen": far.by_motion, "unseen_by_phase": far.by_phase, "model": loads.document()}
        print(f"{candidate.name:42s}{out.error:9.3f} |{''.join(f'{out.by_phase[phase]:17.3f}' for phase in PHASES[:3])} |"
              f"{''.join(f'{far.by_motion[m.name]:9.3f}' for m in unseen)}")
        if candidate.name == "spline, one scale":
            for rule in RULES:
                ruled = Loads({name: replace(term, at_reversal=rule) for name, term in loads.terms.items()})
                far = fit_and_predict(Candidate(rule, ruled, fitted=False), seen, unseen)[1]
                results[candidate.name][f"unseen_{rule}"] = far.by_motion | far.by_phase
                print(f"  at a reversal: {rule:7s} {' '.join(f'{name} {e:.3f}' for name, e in (far.by_motion | far.by_phase).items())}")
    write_json(HERE / "results.json", {"config": {k: str(v) for k, v in config.items()}, "models": results, "versions": versions(),
                                       "campaign_sha256": campaign.sha256()})


if __name__ == "__main__":
    main()
