"""The dry arm obeys Lagrange's equations and conserves energy."""

from dataclasses import replace

import pytest
import torch
from lagrange import joints_of, lagrange_torque, velocity_of
from rigs import AUTOGRAD, arm, assert_close, at_rest, hub_at_rest, states, torque, without_acceleration

from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Motion, tensor

G = 9.81
LINKS = pytest.mark.parametrize("links", [1, 2, 3])


def mass_centres(q, a):
    _, e, joint = joints_of(q, tensor(a.L))
    return joint + tensor([link.com_m for link in a.links])[:, None] * e


def kinetic_energy(a):
    m, inertia = (tensor([getattr(link, key) for link in a.links]) for key in ("mass_kg", "inertia_kg_m2"))

    def energy(q, qd, u0):
        v = velocity_of(lambda q: mass_centres(q, a), q, qd, u0)
        return 0.5 * (m * (v**2).sum(-1)).sum() + 0.5 * (inertia * qd.cumsum(0) ** 2).sum()

    return energy


def weight_energy(a):
    m = tensor([link.mass_kg for link in a.links])
    return lambda q: a.gravity_m_s2 * (m * mass_centres(q, a)[:, 1]).sum()


def mass_matrix(a, q):
    """(n, links, links), from the torques of unit accelerations."""
    body, zero = RigidBody.of_arm(a), torch.zeros_like(q)
    nothing = torch.zeros(len(q), dtype=torch.float64)
    columns = [torque(body, a.model_copy(update={"gravity_m_s2": 0.0}), Motion(nothing, q, zero, zero + unit, nothing, nothing))
               for unit in torch.eye(q.shape[1], dtype=torch.float64)]
    return torch.stack(columns, dim=-1)


@LINKS
def test_the_torques_are_those_of_lagranges_equations_on_a_moving_carriage(links):
    a, motion = arm(links, gravity_m_s2=G), states(links)
    assert_close(torque(RigidBody.of_arm(a), a, motion), lagrange_torque(kinetic_energy(a), motion, weight_energy(a)), **AUTOGRAD)


@LINKS
def test_forward_then_inverse_dynamics_returns_the_torque(links):
    a, motion = arm(links, gravity_m_s2=G), states(links, seed=2)
    body, wanted = RigidBody.of_arm(a), 3 * states(links, seed=3).qd
    bias = torque(body, a, replace(motion, qdd=torch.zeros_like(motion.qdd)))
    qdd = torch.linalg.solve(mass_matrix(a, motion.q), wanted - bias)
    assert_close(torque(body, a, replace(motion, qdd=qdd)), wanted)


@LINKS
def test_the_power_of_the_drives_is_the_rate_of_change_of_the_energy(links):
    a, motion = arm(links, gravity_m_s2=G), hub_at_rest(states(links, seed=4))
    energy, height = kinetic_energy(a), weight_energy(a)

    def total(q, qd, u0):
        return energy(q, qd, u0) + height(q)

    def rate(q, qd, qdd, u0):
        by_q, by_qd = torch.func.grad(total, argnums=(0, 1))(q, qd, u0)
        return by_q @ qd + by_qd @ qdd

    power = (torque(RigidBody.of_arm(a), a, motion) * motion.qd).sum(-1)
    assert_close(power, torch.func.vmap(rate)(motion.q, motion.qd, motion.qdd, motion.u0), **AUTOGRAD)


@pytest.mark.slow
@LINKS
def test_the_rate_of_the_mass_matrix_minus_twice_the_coriolis_matrix_is_skew(links):
    a, motion = arm(links), without_acceleration(hub_at_rest(states(links, seed=5)))

    def matrix(q):
        return mass_matrix(a, q[None])[0]

    dH = torch.stack([torch.autograd.functional.jacobian(matrix, q) for q in motion.q])  # (n, i, j, k): dH_ij/dq_k
    christoffel = 0.5 * (dH + dH.transpose(2, 3) - dH.permute(0, 3, 1, 2))
    C = (christoffel * motion.qd[:, None, None, :]).sum(-1)
    N = (dH * motion.qd[:, None, None, :]).sum(-1) - 2 * C
    assert_close(N, -N.transpose(1, 2))
    assert_close(torque(RigidBody.of_arm(a), a, motion), (C @ motion.qd[..., None])[..., 0])


@LINKS
def test_the_mass_matrix_is_symmetric_and_positive(links):
    H = mass_matrix(arm(links), states(links, seed=6).q)
    assert_close(H, H.transpose(1, 2))
    assert (torch.linalg.eigvalsh(H) > 0).all()


@LINKS
def test_the_torque_that_holds_an_arm_at_rest_is_the_slope_of_its_height_energy(links):
    a, motion = arm(links, gravity_m_s2=G), at_rest(links)
    slope = torch.func.vmap(torch.func.grad(weight_energy(a)))(motion.q)
    assert_close(torque(RigidBody.of_arm(a), a, motion), slope)


@LINKS
def test_an_accelerating_carriage_feels_like_gravity(links):
    motion = states(links, seed=7)
    pushed, heavy = replace(motion, du0=torch.full_like(motion.du0, G)), replace(motion, du0=torch.zeros_like(motion.du0))
    body = RigidBody.of_arm(arm(links))
    assert_close(torque(body, arm(links), pushed), torque(body, arm(links, gravity_m_s2=G), heavy))


@LINKS
def test_a_steady_carriage_is_not_felt(links):
    a, motion = arm(links), states(links, seed=8)
    body = RigidBody.of_arm(a)
    assert torch.equal(torque(body, a, replace(motion, u0=motion.u0 + 3)), torque(body, a, motion))


def test_a_link_raised_level_in_a_vertical_plane_weighs_on_the_drive():
    a = arm(1, gravity_m_s2=G)
    level = Motion.at([[0.0]], 0.0, 0.0)
    assert_close(torque(RigidBody.of_arm(a), a, level), tensor([[a.links[0].mass_kg * G * a.links[0].com_m]]))
