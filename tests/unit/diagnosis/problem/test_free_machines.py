"""Machines that nothing drives: what holds their scale, and the factor up to which their equation of motion holds."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import campaign, planted
from diagnosed import hanging, tethered
from rigs import arm

from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of, hypotheses_for
from nnhydro.diagnosis.problem.free_machines import scale_direction, scale_factor, shares_of_largest
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.errors import CampaignError
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.recording import Recording

ARM = arm(1)


def of(whole, edge=1.4):
    """The rows of a campaign against constant coefficients."""
    problem = problem_of(whole, edge=edge)
    return design_of(problem, baseline_of("constant", whole.arm, problem.units(), Preparation(LowPass(edge))))


def test_a_free_machine_with_a_tenth_more_weight_than_the_model_keeps_ten_elevenths_of_the_models_scale():
    """M + 0.1 w = 0, divided by the weight's 1.1: the columns hold no common factor, and the values over what is kept are the machine's."""
    design = of(hanging(), edge=1.4)
    w, model = design.largest_part, design.tau - design.y
    lifted = (w - model)[..., None]  # the column of a load of the weight's form: its share of the weight is 1
    for extra in (0.1, -0.2, 0.5):
        kept = scale_factor(np.ones(1), np.array([extra / (1 + extra)]))
        assert kept == pytest.approx(1 / (1 + extra))
        np.testing.assert_allclose(model + extra / (1 + extra) * lifted[..., 0], kept * (model + extra * w), atol=1e-12)


def test_of_a_free_machine_that_alone_is_balanced_which_lifts_the_weight_at_rest():
    """A rotor's torque runs like the weight's where nothing is driven, and lifts nothing; a tilt does; a spring in part."""
    design = of(hanging())
    laws = {h.key[0]: h for h in reversed(hypotheses_for(design))}  # of each effect its first law
    shares = {name: design.shares_of_model([laws[name]])
              for name in ("rotor_inertia", "coulomb_friction", "viscous_friction", "buoyancy_tilt", "umbilical_stiffness")}
    for name in ("rotor_inertia", "coulomb_friction", "viscous_friction"):
        np.testing.assert_allclose(shares[name], 0, atol=1e-12, err_msg=name)
    assert max(abs(shares["buoyancy_tilt"])) == pytest.approx(0.25 / (3.5 * 9.81 * 0.34), rel=0.02), "a newton at the middle of the rod"
    assert abs(shares["umbilical_stiffness"][0]) > 0.01
    model = design.baseline.at(np.zeros(design.Y.shape[2]))
    made, rotor = design.columns([laws["rotor_inertia"]], model), design.rows(lambda s: s.segment.qdd[..., None])
    np.testing.assert_allclose(made, rotor, atol=1e-9 * np.abs(rotor).max(), err_msg="its column stays as it is")
    driven = of(campaign(ARM, planted(ARM), count=4, noise=0.01))
    assert not driven.shares_of_model([laws["buoyancy_tilt"]]).any(), "torque tells the scale of what is driven"


def test_the_weight_sets_the_scale_only_where_it_varies_with_the_motion():
    """A pendulum's does; that of a rod which a spring holds level hardly does, though it is nearly as large as the inertia's torque."""
    def seen(whole):
        problem = problem_of(whole, edge=8.0)
        return design_of(problem, baseline_of("rigid", whole.arm, problem.units(), Preparation(LowPass(8.0))))

    assert seen(tethered()).heavy
    level = seen(tethered(12.0, 0.25, 0.25, 0.05, 3.0))
    assert level.undriven
    assert not level.heavy
    weight, inertia = level.part_rms[0]
    assert weight > 0.5 * inertia


def test_a_machine_that_coasts_has_the_inertia_that_is_stated_and_laws_as_they_are():
    t = np.arange(0, 20, 0.02)
    rate = 5 / (1 + 0.1 * t)
    wheel = Arm.model_validate({"fluid": {"density_kg_m3": 1.2, "kinematic_viscosity_m2_s": 1.5e-5},
                                "links": [
        {"length_m": 0.5, "diameter_m": 0.2, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 10.0, "known_to": 0.05}]})
    runs = [Recording(f"r{k}", t, (50 * np.log1p(0.1 * t))[:, None] * (1 + 0.1 * k), 0 * t[:, None], rate[:, None] * (1 + 0.1 * k))
            for k in range(3)]
    design = of(Campaign.of(wheel, runs))
    assert design.undriven
    assert not design.heavy
    laws = [h for h in hypotheses_for(design) if h.key[0] in ("tip_drag", "rotor_inertia", "coulomb_friction", "umbilical_stiffness")]
    assert len({h.key for h in laws}) == 4
    for law in laws:
        inertial = law.key[0] == "rotor_inertia"
        np.testing.assert_allclose(design.shares_of_model([law]), 0.1 if inertial else 0.0, rtol=1e-3, err_msg="a kg m^2 beside 10")
    rotor = [law for law in laws if law.key[0] == "rotor_inertia"]
    left = design.columns(rotor, design.baseline.at(np.zeros(design.Y.shape[2])))
    assert np.abs(left).max() < 0.05 * np.abs(design.largest_part).max(), "no torque tells one inertia from another"
    part = design.part_rms
    inertia = np.sqrt((design.rows(lambda s: 10.0 * s.segment.qdd) ** 2).sum(axis=0) / design.duration)
    np.testing.assert_allclose(part[:, 1], inertia, rtol=0.02, err_msg="of which the drag, as large in free motion, is no part")


def test_the_weight_of_a_free_pendulum_is_held_whatever_its_parameters_do():
    design = of(hanging())
    assert shares_of_largest(design, design.largest_part[..., None]) == pytest.approx(1.0)
    draws = np.random.default_rng(0).standard_normal((5, design.Y.shape[2]))
    first = [design.baseline.at(z).loads.terms["rigid_body"].first_moment for z in draws]
    assert np.ptp(first) == pytest.approx(0.0), "its weight stays, its inertia moves beside it"
    assert 0.01 < design.scale_spread < 0.05, "the mass is known to 2 %"
    assert np.allclose(scale_direction(design), 0), "what is held has no further direction"


def test_a_machine_that_neither_moves_nor_is_driven_is_refused():
    still = hanging()
    rest = [replace(run, q=np.full_like(run.q, -1.5), qd=None, qdd=None) for run in (still.load(name) for name in still.names)]
    with pytest.raises(CampaignError, match="no joint moves"):
        of(Campaign.of(still.arm, rest), edge=1.4)
