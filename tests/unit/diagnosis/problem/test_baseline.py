"""What recordings are compared with: named physics, a model folder, or the user's own column, and which of its parameters may move."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import campaign, planted, sensor_torque
from rigs import arm

from nnhydro.diagnosis.problem.baseline import WIDER, baseline_of
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.errors import ConfigError, RecordingError
from nnhydro.fitting.linear.prior import prior
from nnhydro.models.storage import save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

ARM = arm(1)
WHOLE = campaign(ARM, planted(ARM), count=4, noise=0.01)
PROBLEM = problem_of(WHOLE, edge=3.0)
HOW = Preparation(LowPass(3.0))
BASE = baseline_of("constant", ARM, PROBLEM.units(), HOW)
SEGMENT = PROBLEM.stretches[0].segment
NOTHING = np.zeros((*SEGMENT.tau.shape, len(BASE.prior.mean))), np.zeros_like(SEGMENT.tau)  # columns and fixed torque


def test_baselines_are_named_columns_files_or_refused(tmp_path):
    units, how = PROBLEM.units(), Preparation(LowPass(3.0))
    assert baseline_of(None, ARM, units, how).name == "constant"
    assert baseline_of(None, arm(1, density=0.0), units, how).name == "rigid"
    with pytest.raises(ConfigError, match="neither a baseline"):
        baseline_of(str(tmp_path / "nothing"), ARM, units, how)
    with pytest.raises(RecordingError, match="tau1_sim_Nm"):
        design_of(PROBLEM, baseline_of("column", ARM, units, how))


def test_what_is_to_be_explained_is_the_torque_less_the_baseline_whatever_that_is():
    simulated = 0.5 * SEGMENT.tau
    given = replace(SEGMENT, tau_sim=simulated)
    np.testing.assert_allclose(replace(BASE, column=True).target(given, *NOTHING), SEGMENT.tau - simulated)
    model = StripTheory(ARM, HOW, {}, "mine", planted(ARM))
    left = replace(BASE, simulated=model).target(SEGMENT, *NOTHING)
    np.testing.assert_allclose(left, SEGMENT.tau - sensor_torque(ARM, planted(ARM), Motion.of(SEGMENT)))
    assert np.sqrt((left**2).mean()) < 0.05 * np.sqrt((SEGMENT.tau**2).mean()), "the truth leaves noise"


def test_beside_a_simulation_recalibration_is_told_as_a_change_since_its_own_coefficients_are_not_known():
    z = 0.1 * np.random.default_rng(0).standard_normal(BASE.prior.F.shape[1])
    own, beside = BASE.recalibration(z), replace(BASE, column=True).recalibration(z)
    start = BASE.at(np.zeros(len(z))).loads.terms
    assert own["cd"] == pytest.approx(np.add(beside["cd"], start["normal_drag"].C_D))
    assert own["cm"] == pytest.approx(np.add(beside["cm"], start["added_mass"].C_M))


def test_a_fit_far_from_what_arm_yaml_states_says_so_and_one_near_it_nothing():
    z = np.zeros(BASE.prior.F.shape[1])
    body = np.flatnonzero(BASE.prior.F[0])[0]  # the first parameter is the mass
    z[body] = 3.0
    assert BASE.against_stated(z)["against_stated"] == []
    z[body] = -30.0
    said = BASE.against_stated(z)["against_stated"]
    assert any(line.startswith("rigid_body.mass[1] is fitted as") and "30 times" in line for line in said)
    assert replace(BASE, column=True).against_stated(z) == {}
    water = np.where(BASE.prior.F[0] == 0, 30.0, 0.0)
    assert not any("normal_drag" in line for line in BASE.against_stated(water)["against_stated"]), "a guess is no statement"


def test_parameters_move_from_their_mean_by_what_they_are_known_to():
    z = np.zeros(BASE.prior.F.shape[1])
    moved = BASE.at(z + np.eye(len(z))[0]).loads
    changed = [name for name, term in BASE.at(z).loads.terms.items() if term != moved.terms[name]]
    assert len(changed) == 1, "the first direction is of one term"


def test_coefficients_are_cut_at_their_physical_bounds_and_stay_as_they_are_within():
    z = np.zeros(BASE.prior.F.shape[1])
    np.testing.assert_array_equal(BASE.within(z), z)
    for far, end in ((-1e9, 0), (1e9, 1)):
        drag = BASE.at(BASE.within(z + far)).loads.terms["normal_drag"]
        np.testing.assert_allclose(drag.C_D, drag.linear_bounds()[0][end], atol=1e-9)


def test_added_mass_is_three_times_as_free_as_in_a_fit():
    linear = BASE.physics.loads
    freedom = np.abs(BASE.prior.F).max(axis=1) / np.maximum(np.abs(prior(linear, ARM).F).max(axis=1), 1e-300)
    names = [name for name, term in linear.linear().items() for _ in term.linear_values()]
    assert {round(float(f), 9) for f, name in zip(freedom, names, strict=True) if name == "added_mass"} == {WIDER}
    assert {round(float(f), 9) for f, name in zip(freedom, names, strict=True) if name == "normal_drag"} == {1.0}


def test_where_nothing_is_driven_parameters_move_across_the_scale_alone():
    rng = np.random.default_rng(0)
    r = BASE.prior.F.shape[1]
    direction = rng.standard_normal(r) * (np.arange(r) < r - 1)
    across = BASE.with_fixed(direction).prior
    assert across.F.shape[1] == r - 1
    z = np.linalg.lstsq(BASE.prior.F, across.F, rcond=None)[0]
    np.testing.assert_allclose(direction @ z, 0.0, atol=1e-9)
    np.testing.assert_allclose(z.T @ z, np.eye(r - 1), atol=1e-9, err_msg="known no better and no worse than before")
    assert BASE.with_fixed(np.zeros(r)) is BASE


def test_further_values_change_no_parameter():
    more = BASE.with_more(2)
    r = BASE.prior.F.shape[1]
    z = np.random.default_rng(1).standard_normal(r + 2)
    for name, term in more.at(z).loads.terms.items():
        assert term == BASE.at(z[:r]).loads.terms[name]
    assert np.isinf(more.prior.highest[-2:]).all()


def test_a_model_of_linear_physics_from_a_file_is_recalibrated_and_one_of_other_joints_is_refused(tmp_path):
    save_model(StripTheory(ARM, HOW, {"seen": ["abc"]}, "mine", planted(ARM)), tmp_path / "mine")
    own = baseline_of(str(tmp_path / "mine"), ARM, PROBLEM.units(), HOW)
    assert own.is_physics
    assert own.physics.fit["seen"] == ["abc"], "what the model has seen is not forgotten"
    planted_values = [float(x) for term in planted(ARM).linear().values() for x in term.linear_values()]
    np.testing.assert_allclose(own.prior.mean, planted_values, err_msg="it starts from the values of the file")
    with pytest.raises(ConfigError, match="model of 1 joint, the campaign's arm has 2"):
        baseline_of(str(tmp_path / "mine"), arm(2), PROBLEM.units(), HOW)
