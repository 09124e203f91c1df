"""The rows of a diagnosis: what the true model leaves, what effects are scaled by, and how small a claim may be."""

from dataclasses import replace

import numpy as np
from campaigns import campaign, planted, recording
from rigs import arm

from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

ARM = arm(1)
WHOLE = campaign(ARM, planted(ARM), count=4, noise=0.01)


def logged(rate):
    """The same motions and torques logged at `rate`, without noise."""
    return Campaign.of(ARM, [recording(ARM, planted(ARM), f"run{k}", seed=k + 1, rate=rate, seconds=8.0) for k in range(3)])


def test_what_the_true_model_leaves_of_computed_torques_is_a_thousandth_of_them():
    problem = problem_of(logged(100.0), edge=3.0)
    design = design_of(problem, baseline_of("constant", ARM, problem.units(), Preparation(LowPass(3.0))))
    assert (design.excess**2).sum() < 1e-5 * (design.tau**2).sum()


def test_a_stationary_torque_of_the_drive_is_told_from_a_free_arm():
    problem = problem_of(WHOLE, edge=3.0)
    base = baseline_of("constant", ARM, problem.units(), Preparation(LowPass(3.0)))
    assert not design_of(problem, base).undriven
    free = Campaign.of(ARM, [replace(r, tau=np.zeros_like(r.tau)) for r in WHOLE.recordings()])
    problem = problem_of(free, edge=3.0)
    assert design_of(problem, base).undriven


def test_of_a_free_arm_an_effect_may_be_as_large_as_its_drag_however_little_the_baseline_leaves():
    free = Campaign.of(ARM, [replace(r, tau=np.zeros_like(r.tau)) for r in WHOLE.recordings()])
    problem = problem_of(free, edge=3.0)
    design = design_of(problem, baseline_of("constant", ARM, problem.units(), Preparation(LowPass(3.0))))
    water = [design.baseline.physics.loads.terms[name] for name in ("normal_drag", "added_mass")]

    def by_rates(stretch):
        motion = Motion.of(stretch.segment)
        still = replace(motion, qd=0 * motion.qd)
        return sum(term.torque(Flow(ARM, motion)) - term.torque(Flow(ARM, still)) for term in water).numpy()

    alone = np.sqrt((design.rows(by_rates) ** 2).sum(axis=0) / design.time)
    np.testing.assert_allclose(design.resistance, alone, rtol=1e-9, err_msg="of one link only what the water does depends on rates")
    assert (design.scale >= alone).all()
