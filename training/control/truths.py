"""The truths of run.py and the models for their controllers: library terms, a concealed world, a learned twin of a recorded tank."""

import tomllib
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml

import nnhydro
from nnhydro.blind_tests.truth.campaign import Wish, draw_campaign
from nnhydro.blind_tests.truth.tank import joint_torque
from nnhydro.blind_tests.truth.world import TrueRun
from nnhydro.deployment.native import NativeArm
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.runtime.files import write_text
from nnhydro.simulation.campaign_writer import write_campaign
from nnhydro.simulation.recipe.recipe import parse_recipe

CONFIG = tomllib.loads((Path(__file__).parent / "config.toml").read_text())


def compiled(model):
    """Return `model` as machine code."""
    dynamics = Dynamics(model)
    return NativeArm(dynamics.model, dynamics.affine)


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


@cache
def twin_and_models(folder):
    """Return a learned twin of the recorded tank in `folder`, compiled and as a model, and models that saw every other recording of it."""
    campaign = open_campaign(Path(folder))
    twin = train(campaign, TrainingConfig(baseline="state", **CONFIG["training"], seed=CONFIG["seed"] + 1))
    return compiled(twin), twin, fitted(Campaign.of(campaign.arm, list(campaign.recordings())[::2]))


def tank(choice):
    """Return the learned twin of a recorded tank, and models for its controllers."""
    return twin_and_models(choice["campaign"])


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
