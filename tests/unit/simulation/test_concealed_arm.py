"""The arm of a concealed world: its equation of motion, solved."""

import numpy as np
import pytest
from concealed_worlds import ARM, truth, world

from nnhydro.blind_tests.truth.world import TrueArm
from nnhydro.simulation.concealed_arm import ConcealedArm
from nnhydro.simulation.native_loop import stepped_once


@pytest.mark.parametrize("name", ["", "link_interference", "rotor_inertia", "load_friction", "torque_ripple", "wave_orbital"])
def test_the_acceleration_solves_the_truths_equation(name):
    rng = np.random.default_rng(7)
    for seed in range(4):  # load_friction and torque_ripple may be bent in the acceleration, by the load that they follow
        arm = truth(world(name, seed=seed)).loop_arm("m")
        for _ in range(5):
            q, qd, tau, (u0, du0) = *rng.normal(0, 1, (2, 2)), rng.normal(0, 3, 2), rng.normal(0, 0.3, 2)
            qdd = arm.acceleration(q, qd, tau, u0, du0, 0.01)
            np.testing.assert_allclose(arm.torque(q, qd, qdd, u0, du0, 0.01), tau, atol=1e-10)


def test_torques_that_follow_the_load_are_not_taken_for_affine():
    affine = {name: [truth(world(name, seed=seed)).affine for seed in range(6)] for name in ("load_friction", "torque_ripple", "tip_drag")}
    assert not any(affine["load_friction"])
    assert set(affine["torque_ripple"]) == {True, False}
    assert all(affine["tip_drag"])


@pytest.mark.slow
def test_a_dry_arm_that_swings_on_a_hose_keeps_its_energy():
    """Kinetic energy of the links and k (d^2/2 + 0.15 d^4/4) of the hose, d = q - q0, under no torque at all."""
    dry = TrueArm(ARM.links, rho=0.0)
    made = next(made for made in (world("umbilical_stiffness", 0.9, seed, dry) for seed in range(9)) if made.causes[0].shape == "plain")
    arm, cause, none = truth(made).loop_arm("m"), made.causes[0], np.zeros(2)
    k, q0, j = cause.parameters["stiffness"][0], cause.parameters["free_angle"][0], cause.joint - 1

    def potential(q):
        return k * ((q[j] - q0)**2 / 2 + 0.15 * (q[j] - q0)**4 / 4)

    def kinetic(q, qd):
        still = np.array([arm.torque(q, none, unit) for unit in (*np.eye(2), none)])
        return 0.5 * qd @ (still[:2] - still[2]) @ qd

    q, qd, h, found = np.array([0.4, 0.9]), np.array([0.5, -1.0]), 2e-3, []
    for _ in range(500):
        found.append((kinetic(q, qd), potential(q)))
        q, qd, _ = stepped_once(arm, q, qd, none, np.zeros((3, 2)), h)
    assert np.ptp(found, axis=0).min() > 0.1 * np.max(found), "it swings from one kind of energy to the other"
    np.testing.assert_allclose(np.sum(found, axis=1), np.sum(found[0]), rtol=1e-8)


def test_a_concealed_arm_at_the_beginning_of_a_run_has_forgotten_the_one_before():
    arm = ConcealedArm(world("wave_orbital"), truth(world("wave_orbital")).loop_arm("m").run, True)
    q, qd, qdd = np.array([0.2, 0.3]), np.array([0.5, 0.1]), np.zeros(2)
    first = arm.torque(q, qd, qdd, 0.4)
    moved = arm.torque(q, qd, qdd, 0.4, dt=0.3)
    arm.begin()
    np.testing.assert_array_equal(arm.torque(q, qd, qdd, 0.4), first)
    assert np.abs(moved - first).max() > 1e-4, "the wave goes on, and the carriage goes along it"
