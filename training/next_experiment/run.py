"""Is an ambiguous finding settled by the motion that the diagnosis proposes? `python training/next_experiment/run.py [none|all]`.

A rig that has swung one way only hides friction at joint 1, recorded by the independent truth (nnhydro.simulation.truth). Where the
diagnosis cannot tell, the proposed motion is recorded as often as it asks, and a motion drawn at random as often, for comparison. Rates and
accelerations are recorded (all) or have to be derived from the angles (none).
"""

import sys
import tomllib
from pathlib import Path

import numpy as np

from nnhydro.conventions import column
from nnhydro.diagnosis.feasible import Rig, draw
from nnhydro.diagnosis.studied import Studied, studied
from nnhydro.files import write_json
from nnhydro.identification.identify import versions
from nnhydro.recordings.arm import parse_arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.recording import Recording
from nnhydro.simulation.motions.motion_kind import Setting, motion_of
from nnhydro.simulation.truth import registry
from nnhydro.simulation.truth.arms import document
from nnhydro.simulation.truth.sensors import FINE, Sensors, record
from nnhydro.simulation.truth.tank import plain_torque, read
from nnhydro.simulation.truth.world import Cause, Run, TrueArm, TrueLink

HERE = Path(__file__).parent


def slews(config: dict) -> list[dict]:
    """Return the motions of the campaign at hand as a recipe has them."""
    return [{"kind": "slew", "q_rad": stops, "duration_s": s, "pause_s": 0.5} for stops, s in zip(*config["motions"].values(), strict=True)]


class Tank:
    """The rig as it really is; records motions."""

    def __init__(self, config: dict, hidden: dict, seed: int) -> None:
        self.links = TrueArm(tuple(TrueLink(*values) for values in zip(*config["arm"].values(), strict=True)))
        self.arm = parse_arm(document(self.links, 0.01), "truth")
        self.sensors = Sensors(config["rate_hz"], config["given"], "white", config["noise"], 0.0, 2 * np.pi / 2**16, clock=False)
        made = (registry.makers()[hidden["effect"]](np.random.default_rng(k), self.links).make(hidden["level"]) for k in range(100))
        self.cause: Cause = next(cause for cause in made if cause.joint == 1 and cause.shape == "plain")
        self.rng = np.random.default_rng([seed, 2026])
        plain = [plain_torque(self.run(motion, "quiet"), self.links) for motion in slews(config)]
        self.sigma = config["noise"] * np.sqrt((np.concatenate(plain) ** 2).mean(axis=0))  # the sensor's own, whatever it measures

    def run(self, motion: dict, name: str) -> Run:
        """Return what the links do in one motion of a recipe."""
        reference = motion_of({"name": name, **motion}, "study").reference(Setting(self.arm, np.random.default_rng(0), HERE))
        t = np.arange(round(reference.duration * self.sensors.rate * FINE)) / (self.sensors.rate * FINE)
        return Run(name, t, *reference.at(t))

    def record(self, motion: dict, name: str) -> Recording:
        """Return what the sensors record of it."""
        run = self.run(motion, name)
        seen = record(run, read(run, self.links, [self.cause]), self.links, self.sensors, self.sigma, self.rng, True)
        q, qd, qdd, tau = (np.column_stack([seen[column(key, j)] for j in (1, 2)]) if column(key, 1) in seen else None
                           for key in ("q", "qd", "qdd", "tau"))
        return Recording(name, seen["t_s"], q, tau, qd, qdd, seen.get("u0_m_s"), seen.get("du0_m_s2"))


def outcome(found: Studied) -> str:
    """Return the names that the diagnosis gives, classes in brackets."""
    return "; ".join(f"{'/'.join(f.members)} at joint {f.effect.joint}" for f in found.findings) or "nothing"


def settled(found: Studied, effect: str) -> bool:
    """Whether the one finding is the hidden effect and stands alone."""
    return [f.members for f in found.findings] == [(effect,)]


def main() -> None:
    """Run every case, print and write results_GIVEN.json."""
    config, results = tomllib.loads((HERE / "config.toml").read_text()), []
    config["given"] = (*sys.argv[1:], "all")[0]
    for hidden in config["hidden"]:
        for seed in config["seeds"]:
            tank = Tank(config, hidden, seed)
            first = [tank.record(motion, f"run_{k}") for k, motion in enumerate(slews(config))]
            before = studied(Campaign.of(tank.arm, first))
            row = {"hidden": hidden, "seed": seed, "before": outcome(before)}
            proposal = before.proposal()
            if proposal is not None:
                rig = Rig.of([s for unit in before.case.all_units for s in unit.segments()])
                others = draw(rig, tank.arm, config["rate_hz"], config["controls"], np.random.default_rng([seed, 1]))
                after = []
                for motion in [proposal.motion, *others]:
                    more = [tank.record(motion.document, f"next_{k}") for k in range(proposal.recordings)]
                    after.append(studied(Campaign.of(tank.arm, [*first, *more])))
                row |= {"proposal": proposal.document(), "after": outcome(after[0]), "settled": settled(after[0], hidden["effect"]),
                        "after_random": [outcome(one) for one in after[1:]],
                        "settled_random": [settled(one, hidden["effect"]) for one in after[1:]]}
            results.append(row)
            print({key: value for key, value in row.items() if key != "proposal"}, proposal and proposal.statement(), flush=True)
    write_json(HERE / f"results_{config['given']}.json", {"cases": results, "config": config, "versions": versions()})


if __name__ == "__main__":
    main()
