"""Drag across and along the links: closed forms, limits, scaling, dissipation, and the strip sum as its twin."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from rigs import arm, assert_close, hub_at_rest, scaled, states, torque

from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.axial_drag import AxialDrag
from nnhydro.physics.loads.normal_drag import NormalDrag, signed_square_integrals
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.strips import Strips

LINKS = pytest.mark.parametrize("links", [1, 2, 3])
C_D = 1.1


def strip_drag(flow, per_link):
    """Joint torques (n, joints, links) of quadratic drag, strip by strip."""
    strips = Strips.of(flow, per_link)
    return strips.to_joints(0.5 * flow.rho * C_D * flow.D[:, None] * strips.w.abs() * strips.w)


def one_link(u0, rate):
    a = arm(1)
    return a, Flow(a, Motion.at([[0.0]], [[rate]], 0.0, u0))


def test_a_tow_with_locked_joints_loads_the_link_evenly():
    a, flow = one_link(u0=0.9, rate=0.0)
    want = C_D / 4 * 1000 * a.D[0] * a.L[0] ** 2 * 0.9**2
    assert_close(NormalDrag((C_D,)).torque(flow), tensor([[want]]))


@pytest.mark.parametrize("rate", [1.7, -1.7])
def test_a_link_swept_at_constant_rate_matches_the_integral(rate):
    a, flow = one_link(u0=0.0, rate=rate)
    want = C_D / 8 * 1000 * a.D[0] * a.L[0] ** 4 * rate * abs(rate)
    assert_close(NormalDrag((C_D,)).torque(flow), tensor([[want]]))


def test_a_load_lumped_at_midspan_gives_half_the_torque_of_a_rotating_link():
    _, flow = one_link(u0=0.0, rate=1.3)
    assert_close(strip_drag(flow, per_link=1).sum(-1), NormalDrag((C_D,)).torque(flow) / 2)


def test_a_tip_at_rest_does_not_lose_the_drag_of_the_link():
    a = arm(1)
    _, flow = one_link(u0=0.8, rate=-0.8 / a.L[0])
    assert flow.A[0, 0] * flow.L[0] + flow.B[0, 0] == 0
    want = 0.5 * 1000 * a.D[0] * C_D * 0.8**2 * a.L[0] ** 2 / 12  # int (1 - x/L)^2 x dx = L^2 / 12
    assert_close(NormalDrag((C_D,)).torque(flow), tensor([[want]]))


@pytest.mark.parametrize("rate", [0.0, 1e-300, 1e-12, 1e-9, 1e-6])
def test_a_vanishing_rate_gives_the_drag_of_the_tow(rate):
    _, flow = one_link(u0=0.8, rate=rate)
    _, tow = one_link(u0=0.8, rate=0.0)
    assert_close(NormalDrag((C_D,)).torque(flow), NormalDrag((C_D,)).torque(tow), rtol=1e-11 + 2 * rate)


def test_the_torque_is_continuous_where_the_zero_of_the_velocity_enters_the_link():
    L = arm(1).L[0]
    around = [float(NormalDrag((C_D,)).torque(one_link(u0=0.8, rate=-0.8 / L * k)[1])) for k in (1 - 1e-9, 1, 1 + 1e-9)]
    assert np.ptp(around) < 1e-8


def test_opposite_loads_on_one_link_do_not_cancel_about_its_joint():
    a = arm(1)
    _, flow = one_link(u0=-0.5 * a.L[0] / 2, rate=0.5)  # the velocity is zero at midspan
    force, moment = NormalDrag((C_D,)).loads(flow)
    assert abs(float(force)) < 1e-12
    assert float(moment) > 0


def test_the_integrals_with_a_sign_change_match_a_fine_sum():
    A, B, L = tensor([[2.0, -1.5]]), tensor([[-0.7, 0.9]]), tensor([0.6, 0.8])
    x = L * (torch.arange(20000, dtype=torch.float64)[:, None] + 0.5) / 20000
    w = A * x + B
    force, moment = signed_square_integrals(A, B, L)
    fine = (w.abs() * w).mean(0) * L, (w.abs() * w * x).mean(0) * L
    assert_close(force[0], fine[0], atol=2e-9)  # the sum's own error: L^3 A^2 / (12 N^2)
    assert_close(moment[0], fine[1], atol=2e-9)


@LINKS
def test_torque_scales_as_length_to_the_fifth(links):
    a, motion, k = arm(links), states(links, seed=13), 1.7
    faster = replace(motion, u0=k * motion.u0)  # equal rates, equal ratio of tow to rotation
    for term in (NormalDrag((C_D,) * links), AxialDrag((0.04,) * links)):
        assert_close(torque(term, scaled(a, k), faster), k**5 * torque(term, a, motion), rtol=1e-10)


@LINKS
def test_drag_grows_with_the_square_of_the_speed_and_opposes_it(links):
    a, motion = arm(links), states(links, seed=14)
    back = replace(motion, qd=-3 * motion.qd, u0=-3 * motion.u0)
    for term in (NormalDrag((C_D,) * links), AxialDrag((0.04,) * links)):
        assert_close(torque(term, a, back), -9 * torque(term, a, motion), rtol=1e-10)


@LINKS
def test_with_the_hub_at_rest_drag_only_takes_energy(links):
    a, motion = arm(links), hub_at_rest(states(links, rows=500, seed=15))
    for term in (NormalDrag((C_D,) * links), AxialDrag((0.04,) * links)):
        assert ((torque(term, a, motion) * motion.qd).sum(-1) >= -1e-12).all()


@LINKS
def test_axial_drag_never_turns_its_own_joint(links):
    columns = AxialDrag((0.04,) * links).columns(Flow(arm(links), states(links, seed=16)))
    assert not torch.diagonal(columns, dim1=1, dim2=2).any()


def test_the_axial_force_of_link_2_turns_joint_1_by_the_sine_of_the_elbow():
    a, motion = arm(2), states(2, seed=17)
    flow, term = Flow(a, motion), AxialDrag((0.0, 0.04))
    force = 0.04 * term.loads(flow)[:, 1]
    assert_close(term.torque(flow)[:, 0], float(a.L[0]) * torch.sin(motion.q[:, 1]) * force)
