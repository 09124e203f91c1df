"""A model as the truth of a recipe: a physics model is its terms, a learned one gives its own torques, under a controller too."""

import numpy as np
import pytest
from campaigns import GIVEN
from rigs import arm

from nnhydro.deployment.native import compiler
from nnhydro.errors import ConfigError
from nnhydro.models.storage import load_model, save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.recordings.campaign import open_campaign
from nnhydro.simulation.campaign_writer import runs, write_campaign
from nnhydro.simulation.recipe.recipe import parse_recipe, read_recipe

SLEW = {"kind": "slew", "name": "reach", "q_rad": [[0.0, 0.2], [0.6, -0.4]], "duration_s": 0.6, "rest_s": 0.1}
PD = {"kind": "pd", "kp": [40.0, 10.0], "kd": [8.0, 2.0]}


def of(folder, controller="none", **keys):
    return parse_recipe({"motions": [SLEW], "controller": controller, "sample_rate_hz": 100, "substeps": 2, **keys}, "recipe", folder)


def torque_along(model, run):
    return model.torque(Motion(tensor(run.t), *(tensor(x) for x in run.state))).detach().numpy()


@pytest.fixture(scope="module")
def folder(hybrid, tmp_path_factory):
    made = tmp_path_factory.mktemp("models")
    a = arm(2)
    save_model(StripTheory(a, GIVEN, {}, "state", state_loads(a)), made / "state")
    save_model(hybrid, made / "hybrid")
    return made


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["none", PD])
def test_a_physics_model_as_the_truth_is_its_terms(folder, controller):
    state = dict.fromkeys(("state_drag", "state_added_mass", "state_at_rest"), "start")
    given = ({"truth": "state"}, {"arm": arm(2).document(), "terms": state})
    (whole,), (terms,) = (runs(of(folder, controller, sample_rate_hz=50, **truth)) for truth in given)
    for got, want in ((whole.state.q, terms.state.q), (whole.tau, terms.tau)):
        np.testing.assert_allclose(got, want, rtol=1e-9, atol=1e-9 * np.abs(want).max())


@pytest.mark.slow(seconds=30)
@pytest.mark.skipif(compiler() is None, reason="no C compiler here")
def test_under_a_controller_a_learned_truth_moves_as_its_own_inverse_dynamics_say(folder):
    model = load_model(folder / "hybrid")
    recipe = of(folder, {"kind": "computed_torque", "kp": 100.0, "kd": 20.0, "model": "hybrid", "rate_hz": 200}, truth="hybrid")
    (run,) = runs(recipe)
    assert recipe.learned_truth is not None
    np.testing.assert_allclose(torque_along(model, run), run.tau, atol=2e-2 * np.abs(run.tau).max())
    goal = recipe.references["reach"].at(np.minimum(run.t, recipe.references["reach"].duration)).q
    assert np.abs(run.state.q - goal).max() < 5e-3, "the model knows the arm exactly"


@pytest.mark.slow
def test_a_learned_truth_that_follows_its_motion_gives_its_torques_and_the_campaign_holds_it(folder, tmp_path):
    recipe = of(folder, truth="hybrid")
    (run,) = runs(recipe)
    np.testing.assert_allclose(run.tau, torque_along(load_model(folder / "hybrid"), run), atol=1e-12)
    write_campaign(recipe, tmp_path / "tank")
    write_campaign(read_recipe(tmp_path / "tank" / "recipe.yaml"), tmp_path / "again")
    first, again = (open_campaign(tmp_path / name) for name in ("tank", "again"))
    assert first.sha256() == again.sha256()
    assert first.arm.document() == arm(2).document()


@pytest.mark.parametrize(("keys", "message"), [
    ({}, "give arm and terms, or truth"), ({"truth": "state", "terms": {"normal_drag": "start"}}, "leave out arm and terms"),
    ({"truth": "state", "arm": arm(2).document()}, "leave out arm and terms"), ({"truth": "nowhere"}, "not the folder")])
def test_a_truth_is_terms_on_an_arm_or_a_model(keys, message, tmp_path):
    with pytest.raises(ConfigError, match=message):
        of(tmp_path, **keys)
