"""The truths of run.py and the models for their controllers: library terms, a concealed world, a learned twin of a recorded tank."""

import tomllib
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import yaml

import nnhydro
from nnhydro.blind_tests.conceal import write_concealed
from nnhydro.blind_tests.truth.campaign import Wish, draw_campaign
from nnhydro.deployment.native import NativeArm
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
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


def concealed(choice):
    """Return an arm that hides something no model is told of, by other equations and other code, and models fitted to its recordings."""
    document = {"truth": {"concealed": choice["concealed"]}, "motions": CONFIG["motions"],
                "controller": {"kind": "pd", **CONFIG["gains"]["pd"], **CONFIG["sees"]}, "sample_rate_hz": CONFIG["control_rate_hz"]}
    recipe, keys = parse_recipe(document, "concealed", Path(".")), dict(choice["concealed"])
    with TemporaryDirectory() as folder:
        write_concealed(Path(folder), draw_campaign(keys.pop("seed"), keys.pop("index"), Wish(**keys)))
        models = fitted(open_campaign(Path(folder)))
    return recipe.concealed.loop_arm("loop"), None, models
