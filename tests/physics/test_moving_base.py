"""A base that moves and turns in the plane, and water that moves: what the loads feel is the motion through the water, and nothing else."""

from dataclasses import replace

import pytest
import torch
from moving_bases import everything, on_base, wave
from rigs import arm, assert_close, run, torque

from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.axial_drag import AxialDrag
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Base, Water

LINKS = pytest.mark.parametrize("links", [1, 2, 3])


@LINKS
def test_rates_on_a_turning_base_in_moving_water_are_the_derivatives_of_what_they_should_be(links):
    motion = on_base(run(links, rows=6001), yaw=0.8, x=0.5)
    _, v, slope = wave(motion.t, 2.1, 0.3)
    flow = Flow(arm(links), replace(motion, current=Water(torch.stack([v, -2 * v], 1), torch.stack([slope, -2 * slope], 1))))
    pairs = ((flow.phi, flow.A), (flow.A, flow.M), (flow.B, flow.N), (flow.u_x, flow.du_x))
    for x, rate in pairs:
        assert_close(torch.gradient(x, spacing=(motion.t,), dim=0)[0][1:-1], rate[1:-1], rtol=1e-4, atol=3e-4)


@LINKS
def test_a_base_that_turns_is_felt_as_the_first_joint_turning(links):
    a = arm(links, gravity_m_s2=9.81)
    motion = on_base(run(links), yaw=0.7)
    angle, rate, acceleration = (torch.zeros_like(motion.q) for _ in range(3))
    angle[:, 0], rate[:, 0], acceleration[:, 0] = motion.base.heading, motion.base.rate, motion.base.acceleration
    turned = replace(motion, q=motion.q + angle, qd=motion.qd + rate, qdd=motion.qdd + acceleration, base=None)
    assert_close(torque(everything(a), a, motion), torque(everything(a), a, turned))


@LINKS
def test_a_base_along_X_is_a_carriage_along_Y_seen_a_quarter_turn_on(links):
    a, motion = arm(links), run(links)
    quarter = motion.q.clone()
    quarter[:, 0] -= torch.pi / 2
    still = torch.zeros_like(motion.t)
    sideways = replace(motion, q=quarter, u0=still, du0=still, base=Base(motion.u0, motion.du0, still, still, still))
    assert_close(torque(everything(a), a, sideways), torque(everything(a), a, motion))


@LINKS
def test_an_arm_carried_along_by_a_steady_current_feels_no_water(links):
    a, motion = arm(links), run(links)
    still, one = torch.zeros_like(motion.t), torch.ones_like(motion.t)
    flow = Water(torch.stack([0.4 * one, -0.3 * one], 1), torch.zeros(len(one), 2, dtype=torch.float64))
    carried = replace(motion, u0=motion.u0 - 0.3, base=Base(0.4 * one, still, still, still, still), current=flow)
    assert_close(torque(everything(a), a, carried), torque(everything(a), a, motion))


@LINKS
def test_drag_in_a_current_is_drag_of_the_opposite_motion(links):
    a, motion = arm(links), run(links)
    still = torch.zeros_like(motion.t)
    _, v, slope = wave(motion.t, 1.1, 0.4)
    in_current = replace(motion, current=Water(torch.stack([v, still], 1), torch.stack([slope, still], 1)))
    on_moving_base = replace(motion, base=Base(-v, -slope, still, still, still))
    for term in (NormalDrag((1.1,) * links), AddedMass((0.9,) * links), AxialDrag((0.02,) * links)):
        assert_close(torque(term, a, in_current), torque(term, a, on_moving_base))


@LINKS
def test_a_piece_of_water_accelerated_with_the_water_needs_no_drive(links):
    a = arm(links)
    water = {"mass_kg": lambda k: 1000 * torch.pi / 4 * k.diameter_m**2 * k.length_m, "com_m": lambda k: k.length_m / 2}
    a = a.model_copy(update={"links": tuple(k.model_copy(update={name: value(k) for name, value in water.items()}) for k in a.links)})
    motion = run(links)
    still = torch.zeros_like(motion.t)
    _, v, slope = wave(motion.t, 1.9, 0.5)
    resting = replace(motion, qd=0 * motion.qd, qdd=0 * motion.qdd, u0=-v, du0=-slope, base=Base(2 * v, 2 * slope, still, still, still))
    along = replace(resting, current=Water(torch.stack([2 * v, -v], 1), torch.stack([2 * slope, -slope], 1)))
    assert float(torque(RigidBody.of_arm(a), a, along).abs().max()) > 0.1
    assert float(torque(everything(a), a, along).abs().max()) < 1e-11
