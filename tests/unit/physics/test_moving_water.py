"""Water that moves: a current, and waves that meet every link where it is."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
import torch
from hypotheses import made, steady, view
from rigs import LINKS, arm, assert_close, run

from nnhydro.effects.catalogue import candidates, catalogue
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Base, Motion, Water, tensor


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.3), (0.2, 0.0), (-0.1, 0.25)])
def test_a_current_is_a_velocity_relative_to_the_water(x, y):
    a, motion = arm(2), run(2)
    seen = view(a, motion)
    tau = made("ambient_current", a, current_X=(x,), current_Y=(y,)).apply(seen)
    flow = Flow(a, motion)
    n = torch.stack([-torch.sin(flow.phi), torch.cos(flow.phi)], dim=-1)
    wet = seen.flow.in_water(tensor([[x, y]]).expand(60, 2), torch.zeros(60, 2, dtype=torch.float64))
    assert_close(wet.B, flow.B - n @ tensor([x, y]))
    assert_close(tau, seen.torque_of(wet))
    if x == 0:
        assert_close(tau, seen.torque_of(Flow(a, replace(motion, u0=motion.u0 - y))))


def test_the_acceleration_in_moving_water_is_the_derivative_of_the_velocity_through_it():
    a, t = arm(2), np.linspace(0, 6, 60001)
    motion = run(2, rows=60001)
    water = Water(tensor(np.stack([0.3 * np.sin(2 * t), 0.2 * np.cos(t)], 1)), tensor(np.stack([0.6 * np.cos(2 * t), -0.2 * np.sin(t)], 1)))
    flow = Flow(a, motion, water)
    for velocity, acceleration in ((flow.B, flow.N), (flow.u_x, flow.du_x)):
        (slope,) = torch.gradient(velocity, spacing=(motion.t,), dim=0)
        assert_close(acceleration[1:-1], slope[1:-1], rtol=1e-6, atol=1e-6)


def test_a_wave_pushes_a_fixed_link_as_Morison_says():
    a, t = arm(1), np.linspace(0, 8, 801)
    still = torch.zeros(801, 1, dtype=torch.float64)
    seen = view(a, Motion(tensor(t), still, still, still, still[:, 0], still[:, 0]), "textbook")
    wave = made("wave_orbital", a, cosine=(0.4,), sine=(0.0,), frequency=(0.5,), direction=(pi / 2,))
    v, dv = 0.4 * np.cos(pi * t), -0.4 * pi * np.sin(pi * t)
    force = 0.5 * 1000 * 0.07 * 1.2 * np.abs(v) * v + (1 + 1.0) * 1000 * pi / 4 * 0.07**2 * dv  # inertia coefficient 1 + C_M
    assert_close(wave.apply(seen)[:, 0], tensor(-force * 0.55**2 / 2))


def test_the_middle_of_a_link_is_half_its_length_from_where_it_hangs():
    assert_close(Flow(arm(3), steady([[0.0, pi / 2, 0.0]])).middle[0], tensor(
        [[LINKS[0]["length_m"] / 2, 0.0], [LINKS[0]["length_m"], LINKS[1]["length_m"] / 2],
         [LINKS[0]["length_m"], LINKS[1]["length_m"] + LINKS[2]["length_m"] / 2]]), atol=1e-12)


@pytest.mark.parametrize("direction", [2.1, pi / 2])
def test_the_acceleration_of_a_wave_is_that_of_its_water_however_the_link_moves(direction):
    a, motion = arm(2), run(2)
    wave = made("wave_orbital", a, frequency=(0.6,), direction=(direction,))
    velocity, acceleration = wave._waves(view(a, motion))
    later = wave._waves(view(a, replace(motion, t=motion.t + 1e-5)))[0]  # the same places a moment later
    assert_close((later - velocity) / 1e-5, acceleration, rtol=1e-3, atol=1e-3)


def test_a_wave_runs_through_the_tank_and_not_with_the_carriage():
    a, t = arm(2), np.linspace(0, 8, 801)
    still, towed = torch.zeros(801, 2, dtype=torch.float64), torch.full((801,), 0.4, dtype=torch.float64)
    wave = made("wave_orbital", a, frequency=(0.7,), direction=(pi / 2,))
    met = wave._waves(view(a, Motion(tensor(t), still, still, still, towed, 0 * towed)))[0]
    omega = 2 * pi * 0.7
    assert_close(met[:, 0, 0], tensor(np.cos(omega * t - omega**2 / 9.81 * 0.4 * t)))


@pytest.mark.parametrize("direction", [0.3, -2.0])
def test_a_link_meets_a_wave_where_it_is(direction):
    a, t = arm(2), np.linspace(0, 8, 801)
    q = tensor(np.tile([0.4, 0.9], (801, 1)))
    flow = Flow(a, Motion(tensor(t), q, 0 * q, 0 * q, 0 * q[:, 0], 0 * q[:, 0]))
    velocity, _ = made("wave_orbital", a, frequency=(0.7,), direction=(direction,))._waves(view(a, flow.motion))
    omega, d = 2 * pi * 0.7, np.array([np.cos(direction), np.sin(direction)])
    x = (np.arange(400) + 0.5) / 200 - 1  # from the inner end to the outer
    along = flow.unit_along[0].numpy() @ d * flow.L.numpy() / 2
    late = omega**2 / 9.81 * ((flow.middle[0].numpy() @ d)[:, None] + along[:, None] * x)
    weighted = ((1 + x) * np.cos(omega * t[:, None, None] - late)).mean(axis=2)  # by the lever about the link's own joint
    assert_close(velocity[..., 0], tensor(weighted), atol=1e-5)
    assert np.ptp(late) > 0.1


@pytest.mark.parametrize("z", [0.0, 1e-4, 0.02, -0.7, 1.5])
def test_what_a_link_meets_of_a_wave_is_its_mean_weighted_by_the_lever_of_the_load(z):
    j0, j1 = catalogue()["wave_orbital"]._means(tensor([z]))
    x = (np.arange(20000) + 0.5) / 10000 - 1
    assert j0.item() - 1j * j1.item() == pytest.approx(((1 + x) * np.exp(-1j * z * x)).mean(), abs=1e-7)


def test_a_wave_along_a_long_held_link_turns_it_as_its_strips_are_turned():
    a = arm(1)
    L, D, f, q = 0.55, a.links[0].diameter_m, 1.1, 0.9  # a third of the wavelength
    t, x = np.arange(100) / 50, (np.arange(4000) + 0.5) * 0.55 / 4000
    at = tensor(np.full((len(t), 1), q))
    seen = view(a, Motion(tensor(t), at, 0 * at, 0 * at, tensor(0 * t), tensor(0 * t)), "textbook")
    wave = made("wave_orbital", a, cosine=(0.01,), sine=(0.0,), frequency=(f,), direction=(pi / 2,))
    omega = 2 * pi * f
    psi = omega * t[:, None] - omega**2 / 9.81 * np.sin(q) * x
    slope = -0.01 * omega * np.sin(psi) * np.cos(q)
    inertial = -(1 + 1.0) * 1000 * pi / 4 * D**2 * (slope @ x) * L / 4000
    read = wave.apply(seen)[:, 0].numpy() - seen.tau[:, 0].numpy()
    assert np.abs(read - inertial).max() < 0.06 * np.abs(inertial).max(), "the rest is drag"


def test_waves_are_sought_from_everywhere():
    angles = np.sort([effect.direction[0] for effect in candidates(catalogue()["wave_orbital"], arm(2)) if effect.frequency == (0.5,)])
    np.testing.assert_allclose(np.diff([*angles, angles[0] + 2 * pi]), pi / 2)


def test_a_wave_is_met_besides_the_water_that_moves_already():
    a, motion = arm(2), run(2)
    stream = torch.full((60, 2), 0.2, dtype=torch.float64)
    seen = view(a, motion)
    inside = replace(seen, flow=replace(seen.flow, water=Water(stream, 0 * stream)))
    wet = inside.flow.in_water(stream, 0 * stream)
    assert_close(wet.B, Flow(a, motion, Water(2 * stream, 0 * stream)).B)


def test_a_wave_and_the_one_that_runs_the_other_way_differ_but_where_they_are_long():
    a, motion = arm(2), run(2)
    seen = view(a, motion)

    def difference(frequency):
        one, other = (made("wave_orbital", a, frequency=(frequency,), direction=(d,)).columns(seen) for d in (0.5, 0.5 - pi))
        return float((one + other).norm() / one.norm())

    assert difference(0.8) > 0.3
    assert difference(0.1) < 0.05


def test_water_that_moves_link_by_link_adds_to_water_that_moves_alike():
    a, motion = arm(2), run(2)
    stream = torch.full((60, 2), 0.2, dtype=torch.float64)
    each = torch.arange(60 * 4, dtype=torch.float64).reshape(60, 2, 2) / 100
    both = Water(stream, 0 * stream) + Water(each, -each)
    assert_close(both.velocity, each + 0.2)
    assert_close(both.acceleration, -each)
    alike = Water(stream[:, None, :].expand(60, 2, 2), 0 * each)
    assert_close(Flow(a, motion, alike).N, Flow(a, motion, Water(stream, 0 * stream)).N)
    assert_close(Flow(a, motion, alike).B, Flow(a, motion, Water(stream, 0 * stream)).B)


KINEMATICS = ("phi", "A", "M", "B", "N", "u_x", "du_x", "lever_normal", "lever_axial", "middle")


@pytest.mark.parametrize("hub", [False, True])
def test_a_flow_that_takes_over_what_is_known_of_another_is_the_flow_made_anew(hub):
    a, motion = arm(3), run(3)
    motion = replace(motion, base=Base(*(0.1 * torch.sin(k * motion.t) for k in range(1, 6))))
    v, dv = torch.stack([torch.sin(motion.t), torch.cos(motion.t)], 1), torch.stack([torch.cos(motion.t), -torch.sin(motion.t)], 1)
    flow, terms = Flow(a, motion, hub=hub), (RigidBody.of_arm(a), NormalDrag((1.0, 0.8, 1.2)), AddedMass((1.0, 0.5, 0.7)))
    before = [term.torque(flow) for term in terms]
    for known, anew in ((flow.in_water(v, dv), Flow(a, motion, Water(v, dv), hub)), (flow.again(), Flow(a, motion, hub=hub))):
        for name in KINEMATICS:
            assert_close(getattr(known, name), getattr(anew, name))
        for term in terms:
            assert_close(term.torque(known), term.torque(anew))
    wet = [term.torque(flow.in_water(v, dv)) for term in terms]
    assert [torch.equal(one, other) for one, other in zip(before, wet, strict=True)] == [True, False, False]
    memo = flow.memo
    assert flow.again().memo is not memo
