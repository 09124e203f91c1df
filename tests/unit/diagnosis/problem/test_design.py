"""The rows of a diagnosis: what the true model leaves, what effects are scaled by, and how small a claim may be."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import campaign, planted, recording
from diagnosed import campaign as diagnosed_campaign
from diagnosed import hanging
from rigs import LINKS, arm

from nnhydro.diagnosis.constants import FORM, RELEVANT, RHO
from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of, hypotheses_for, relevant_share
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.effects.effect import REGISTER
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

ARM = arm(1)
WHOLE = campaign(ARM, planted(ARM), count=4, noise=0.01)


def of(whole=WHOLE, edge=3.0, name="constant"):
    """The rows of a campaign against a baseline."""
    problem = problem_of(whole, edge=edge)
    return design_of(problem, baseline_of(name, whole.arm, problem.units(), Preparation(LowPass(edge))))


def logged(rate):
    """The same motions and torques logged at `rate`, without noise."""
    return Campaign.of(ARM, [recording(ARM, planted(ARM), f"run{k}", seed=k + 1, rate=rate, seconds=8.0) for k in range(3)])


def test_an_effect_may_be_as_large_as_what_the_baseline_leaves_of_a_driven_torque():
    """A shaft's friction is all of its torque; the calibrated arm leaves noise; of a free pendulum what is left is the scale itself."""
    shaft, free = (design_on(problem_of(diagnosed_campaign(name)), base)
                   for name, base in (("shaft, 30 speeds", "rigid"), ("free pendulum", None)))
    assert shaft.left == pytest.approx(1 / RHO, rel=0.01)
    assert of().left == pytest.approx(1.0)
    assert free.undriven
    assert free.left == pytest.approx(1.0)


def test_what_the_true_model_leaves_of_computed_torques_is_a_thousandth_of_them():
    problem = problem_of(logged(100.0), edge=3.0)
    design = design_of(problem, baseline_of("constant", ARM, problem.units(), Preparation(LowPass(3.0))))
    assert (design.excess**2).sum() < 1e-5 * (design.tau**2).sum()


def test_the_friction_that_arm_yaml_states_moves_the_torque_as_the_sensors_read_it():
    """Half of it through a gear of 2 with the sensor at the motor; none where nothing is stated."""
    links = [{**LINKS[0], "gear": {"ratio": 2.0, "torque_at": "motor"}}]
    stated = [{"coulomb_Nm": 0.4, "viscous_Nm_s": 0.3}]
    geared, plain = (Arm.model_validate({"fluid": {"density_kg_m3": 1000.0}, "links": x, "friction": stated}) for x in (links, LINKS[:1]))
    rows = of(Campaign.of(plain, list(WHOLE.recordings()))).stated_friction
    halves = of(Campaign.of(geared, list(WHOLE.recordings()))).stated_friction
    np.testing.assert_allclose(halves, rows / 2, rtol=1e-9)
    first = of(Campaign.of(plain, list(WHOLE.recordings()))).problem.stretches[0].segment.qd
    assert 0.3 < np.sqrt((rows**2).mean() / ((0.4 * np.sign(first) + 0.3 * first) ** 2).mean()) < 3
    assert not of().stated_friction.any()


def test_what_the_recalibrated_baseline_leaves_does_not_hang_on_the_diameter_that_arm_yaml_states():
    """A coefficient that starts at thirty times its value: the error of a fit must not become noise."""
    thick = Arm.model_validate({"fluid": {"density_kg_m3": 1000.0}, "links": [{**LINKS[0], "diameter_m": 30 * LINKS[0]["diameter_m"]}]})
    left = [(of(Campaign.of(a, list(WHOLE.recordings()))).excess ** 2).sum() for a in (ARM, thick)]
    assert left[1] < 1.5 * left[0]


def test_a_stationary_torque_of_the_drive_is_told_from_a_free_arm():
    problem = problem_of(WHOLE, edge=3.0)
    base = baseline_of("constant", ARM, problem.units(), Preparation(LowPass(3.0)))
    assert not design_of(problem, base).undriven
    free = Campaign.of(ARM, [replace(r, tau=np.zeros_like(r.tau)) for r in WHOLE.recordings()])
    problem = problem_of(free, edge=3.0)
    assert design_of(problem, base).undriven


def test_of_a_free_arm_an_effect_may_be_as_large_as_the_drag_that_takes_its_place_however_little_that_leaves():
    """A rolling ship with linear damping: C_D is fitted to three times that of any cylinder, and leaves 2 % of the weight's torque."""
    design = of(hanging(), edge=1.4)
    flat = design.Y.reshape(-1, design.Y.shape[2])
    best = design.baseline.at(design.baseline.within(np.linalg.lstsq(flat, design.y.ravel())[0])).loads.terms

    def by_rates(stretch):
        motion = Motion.of(stretch.segment)
        still = replace(motion, qd=0 * motion.qd)
        moving, resting = (Flow(design.problem.arm, m) for m in (motion, still))
        return sum(best[name].torque(moving) - best[name].torque(resting) for name in ("normal_drag", "added_mass")).numpy()

    alone = np.sqrt((design.rows(by_rates) ** 2).sum(axis=0) / design.duration)
    np.testing.assert_allclose(design.resistance, alone, rtol=0.02, err_msg="of one link only what the water does depends on rates")
    assert (design.scale >= design.resistance).all()


@pytest.mark.parametrize(("left", "share"), [
    ([1.0, 2.0], RELEVANT),  # noise hides more
    ([1e-4, 2.0], FORM**0.5 * 1e-4 / 3.0),  # a tenth of the energy that remains at the quieter joint
])
def test_a_claim_moves_three_thousandths_of_the_torque_or_a_tenth_of_the_energy_that_remains(left, share):
    design = SimpleNamespace(duration=20.0, scale=np.array([3.0, 4.0]))
    squares = np.tile(np.square(left) * design.duration / 50, (50, 1))
    assert relevant_share(design, squares) == pytest.approx(share)


def test_exact_motions_leave_no_noise_and_angles_alone_leave_their_own_in_the_torque():
    exact = of()
    assert exact.input_variance.max() < 1e-6 * (exact.tau**2).mean()
    rng = np.random.default_rng(0)
    noisy = Campaign.of(ARM, [replace(r, q=r.q + 1e-3 * rng.standard_normal(r.q.shape), qd=None, qdd=None) for r in WHOLE.recordings()])
    assert of(noisy).input_variance.mean() > 100 * exact.input_variance.mean()


def test_a_weight_that_is_most_of_the_model_is_told_from_an_inertia_that_is():
    hanging = arm(1, density=0.0, gravity_m_s2=9.81)
    flat = arm(1, density=0.0)
    slow, fast = (campaign(a, planted(a), count=3, highest=0.4) for a in (hanging, flat))
    assert of(slow, name="rigid").heavy
    assert not of(fast, name="rigid").heavy


@pytest.mark.parametrize(("added", "tried"), [(0.0, True), (20.0, False)], ids=["a joint that reverses", "one that always turns fast"])
def test_a_grip_that_is_lost_is_sought_where_the_joint_turns_slowly(added, tried):
    design = of()
    stretches = tuple(replace(s, segment=replace(s.segment, qd=s.segment.qd + added)) for s in design.problem.stretches)
    turned = replace(design, problem=replace(design.problem, stretches=stretches))
    assert ("stribeck_friction" in {h.key[0] for h in hypotheses_for(turned)}) is tried


def test_what_swings_with_the_motion_is_tried_where_the_motion_excites_it():
    design = of(edge=6.0)
    swinging = {h.effect.frequency[0] for h in hypotheses_for(design) if h.key[0] == "oscillating_mass"}
    assert swinging
    low, high = design.excited
    assert low <= min(swinging) <= max(swinging) < high < 6.0
    assert any(f > high for f in REGISTER["oscillating_mass"].grids()["frequency"]), "the grid goes on"
    energy, slow = design._weight_and_inertia[..., 1] ** 2, design.problem.frequency <= high
    assert 0.98 < energy[slow].sum() / energy.sum() < 1.0
