"""The inertia of the water: linear in the acceleration, and its three readings differ by exactly what each leaves out."""

from dataclasses import replace
from math import pi

import pytest
import torch
from lagrange import joints_of, lagrange_torque, velocity_of
from rigs import AUTOGRAD, arm, assert_close, hub_at_rest, states, torque, without_acceleration

from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import READINGS, AddedMass
from nnhydro.physics.loads.axial_added_mass import AxialAddedMass
from nnhydro.physics.motion import Motion, tensor

LINKS = pytest.mark.parametrize("links", [1, 2, 3])
READING = pytest.mark.parametrize("reading", READINGS)
C_M, C_MX = 0.9, 0.07


def both(links, reading):
    return AddedMass((C_M,) * links, reading=reading), AxialAddedMass((C_MX,) * links, reading=reading)


def total(links, reading, motion):
    return sum(torque(term, arm(links), motion) for term in both(links, reading))


def water_energy(a):
    """Kinetic energy of the displaced water, two Gauss points per link: exact, for the velocity is linear along it."""
    L, D = tensor(a.L), tensor(a.D)
    mass = a.fluid.density_kg_m3 * pi * D**2 / 4 * L

    def energy(q, qd, u0):
        result = 0.0
        for share in (0.5 - 3**-0.5 / 2, 0.5 + 3**-0.5 / 2):
            def point(q, share=share):
                _, e, joint = joints_of(q, L)
                return joint + share * L[:, None] * e

            _, e, _ = joints_of(q, L)
            v = velocity_of(point, q, qd, u0)
            axial = (v * e).sum(-1)
            normal = -v[:, 0] * e[:, 1] + v[:, 1] * e[:, 0]
            result = result + (mass * (C_M * normal**2 + C_MX * axial**2)).sum() / 4
        return result

    return energy


@LINKS
def test_the_energy_reading_is_lagranges_equation_of_the_waters_energy(links):
    motion = states(links, seed=21)
    assert_close(total(links, "energy", motion), lagrange_torque(water_energy(arm(links)), motion), **AUTOGRAD)


def test_the_readings_of_one_link_differ_by_their_identities():
    motion = states(1, seed=22)
    flow = Flow(arm(1), motion)
    m_y, m_x = (c * 1000 * pi * flow.D**2 / 4 for c in (C_M, C_MX))
    A, B, u_x, L = flow.A, flow.B, flow.u_x, flow.L
    document = total(1, "document", motion)
    assert_close(total(1, "inertial", motion), document + m_y * u_x * A * L**2 / 2)
    assert_close(total(1, "energy", motion), document + (m_y - m_x) * u_x * B * L + m_y * u_x * A * L**2 / 2)


def test_on_a_hub_at_rest_the_readings_of_one_link_coincide():
    motion = hub_at_rest(states(1, seed=23))
    for reading in READINGS:
        assert_close(total(1, reading, motion), total(1, "document", motion))
        assert total(1, reading, motion).abs().max() > 1


@pytest.mark.parametrize("links", [2, 3])
def test_the_readings_of_several_links_differ(links):
    motion = hub_at_rest(states(links, seed=24))
    results = [total(links, reading, motion) for reading in READINGS]
    assert min((results[i] - results[i - 1]).abs().max() for i in range(3)) > 0.1


def test_only_the_energy_reading_has_the_munk_moment_of_an_oblique_tow():
    motion = Motion.at([[0.6]], 0.0, 0.0, 1.2)
    flow = Flow(arm(1), motion)
    m = 1000 * pi * flow.D**2 / 4
    munk = (C_M - C_MX) * m * flow.L * 1.2**2 * torch.sin(motion.q) * torch.cos(motion.q)
    assert_close(total(1, "energy", motion), munk)
    assert not total(1, "document", motion).any()
    assert not total(1, "inertial", motion).any()


@LINKS
@READING
def test_the_torque_is_linear_in_the_acceleration(links, reading):
    motion, other = states(links, seed=25), states(links, seed=26)
    sum_ = replace(motion, qdd=motion.qdd + 2 * other.qdd, du0=motion.du0 + 2 * other.du0)
    still = total(links, reading, without_acceleration(motion))
    only_other = total(links, reading, replace(motion, qdd=other.qdd, du0=other.du0)) - still
    assert_close(total(links, reading, sum_), total(links, reading, motion) + 2 * only_other)


@LINKS
@READING
def test_the_added_mass_matrix_is_symmetric_and_never_negative(links, reading):
    still = states(links, seed=27)
    still = hub_at_rest(replace(still, qd=torch.zeros_like(still.qd)))
    columns = [total(links, reading, replace(still, qdd=torch.zeros_like(still.qdd) + unit))
               for unit in torch.eye(links, dtype=torch.float64)]
    H = torch.stack(columns, dim=-1)
    assert_close(H, H.transpose(1, 2))
    assert (torch.linalg.eigvalsh(H) > 0).all()


def test_a_decelerating_link_is_pushed_on_by_the_water():
    braking = Motion.at([[0.0]], [[2.0]], [[-3.0]])
    L, D = arm(1).L[0], arm(1).D[0]
    assert_close(torque(AddedMass((C_M,)), arm(1), braking), tensor([[-C_M * 1000 * pi * D**2 / 4 * 3.0 * L**3 / 3]]))


def test_turning_at_constant_rate_in_a_constant_tow_still_needs_torque():
    motion = Motion.at([[0.6]], [[1.5]], 0.0, 0.8)
    alone = (Motion.at([[0.6]], [[1.5]], 0.0, 0.0), Motion.at([[0.6]], [[0.0]], 0.0, 0.8))
    term = AddedMass((C_M,))
    assert torque(term, arm(1), motion).abs() > 0.1
    assert not any(torque(term, arm(1), m).any() for m in alone)


@LINKS
def test_the_derivatives_in_the_links_frame_are_the_rates_of_the_velocities(links):
    motion, h = states(links, seed=28), 1e-5

    def at(s):
        t = s * h
        return Flow(arm(links), replace(motion, q=motion.q + motion.qd * t + motion.qdd * t**2 / 2, qd=motion.qd + motion.qdd * t,
                                        u0=motion.u0 + motion.du0 * t))

    flow = Flow(arm(links), motion)
    for name, rate in (("A", flow.M), ("B", flow.N), ("u_x", flow.du_x)):
        assert_close((getattr(at(1), name) - getattr(at(-1), name)) / (2 * h), rate, rtol=1e-7, atol=1e-7)  # error of differences, h^2


@pytest.mark.parametrize("term", [AddedMass, AxialAddedMass])
def test_an_unknown_reading_is_refused(term):
    with pytest.raises(ModelError, match="document, inertial, energy"):
        term((1.0,), reading="kinetic")
