"""A campaign that is only planned: a recipe's motions run by a healthy arm."""

import numpy as np
import pytest

from nnhydro.diagnosis.calibration.planned_campaign import baseline_recipe, simulate_plan
from nnhydro.errors import ConfigError
from nnhydro.simulation.recipe.recipe import read_recipe

PLAN = """name: small
arm:
  fluid: {density_kg_m3: %s}
  links:
    - {length_m: 0.55, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.27, inertia_kg_m2: 0.026}
terms: {%s}
motions:
  - {kind: fourier, name: f1, q_rad: [0.3], duration_s: 4, reach_rad: 0.9, rate_rad_s: 2.0}
sensors: {torque_noise_share: %s, encoder_counts_per_rev: 65536}
"""
WATER = "normal_drag: {C_D: 1.7}, added_mass: {C_M: 0.8}"


def plan(folder, terms=WATER, noise="0.01", density="1000.0"):
    path = folder / "plan.yaml"
    path.write_text(PLAN % (density, terms, noise))
    return path


def test_a_plan_is_run_by_the_baseline_alone_and_says_what_it_leaves_off(tmp_path):
    whole, left_off = simulate_plan(plan(tmp_path, WATER + ", viscous_friction: {coefficient: 0.5}"))
    plain, nothing = simulate_plan(plan(tmp_path))
    assert left_off == ("viscous_friction",)
    assert nothing == ()
    np.testing.assert_array_equal(whole.load("f1").tau, plain.load("f1").tau)


def test_a_plan_without_noise_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="torque_noise_Nm"):
        simulate_plan(plan(tmp_path, noise="0.0"))


def test_coefficients_are_those_of_the_recipe_and_where_it_states_none_those_where_fits_begin(tmp_path):
    stated, left_off = baseline_recipe(read_recipe(plan(tmp_path, "normal_drag: {C_D: 1.7}")), None)
    assert stated.loads.terms["normal_drag"].C_D == (1.7,)
    assert stated.loads.terms["added_mass"].C_M == (0.8,)
    assert left_off == ()


def test_a_named_baseline_leaves_off_what_it_does_not_hold(tmp_path):
    rigid, left_off = baseline_recipe(read_recipe(plan(tmp_path)), "rigid")
    assert set(rigid.loads.terms) == {"rigid_body"}
    assert set(left_off) == {"normal_drag", "added_mass"}


def test_an_arm_in_air_is_planned_without_water(tmp_path):
    recipe, left_off = baseline_recipe(read_recipe(plan(tmp_path, "viscous_friction: {coefficient: 0.5}", density="0.0")), None)
    assert set(recipe.loads.terms) == {"rigid_body"}
    assert left_off == ("viscous_friction",)
