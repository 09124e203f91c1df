"""Belt, gear and hub: virtual work and power are kept, and what the sensor reads can be undone."""

from dataclasses import replace

import pytest
import torch
from rigs import arm, assert_close, states

from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.axial_drag import AxialDrag
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.motion import tensor
from nnhydro.physics.transmission import drive_rates, gear_factor, joint_torque, sensed_columns, sensor_torque, to_drives
from nnhydro.recordings.arm import Gear

RATIOS = pytest.mark.parametrize("ratio", [1.0, 1.5, 0.6])
GEAR = {"ratio": 25.0, "efficiency": 0.8, "torque_at": "motor"}


def belt(ratio=1.0, **keys):
    return arm(2, drive={"kind": "remote", "pulley_ratio": ratio}, **keys)


def torques(seed, links=2):
    return states(links, seed=seed).qdd, states(links, seed=seed).qd


@RATIOS
def test_the_belt_keeps_the_virtual_work(ratio):
    tau, _ = torques(31)
    psi = torch.tensor([0.3, -0.7], dtype=torch.float64)  # displacements of the motors
    q = torch.stack([psi[0], ratio * (psi[1] - psi[0])])
    assert_close(to_drives(tau, belt(ratio)) @ psi, tau @ q)


@RATIOS
def test_the_belt_keeps_the_power(ratio):
    tau, qd = torques(32)
    a = belt(ratio)
    assert_close((to_drives(tau, a) * drive_rates(qd, a)).sum(-1), (tau * qd).sum(-1))


def test_with_the_second_motor_stopped_the_second_link_keeps_its_direction():
    qd = torch.tensor([[1.3, -1.3]], dtype=torch.float64)
    assert_close(drive_rates(qd, belt()), tensor([[1.3, 0.0]]))


def test_link_2s_own_moment_never_reaches_motor_1():
    tau = torch.tensor([[5.0, 5.0]], dtype=torch.float64)  # a pure moment on link 2 loads both joints alike
    assert_close(to_drives(tau, belt()), tensor([[0.0, 5.0]]))


def test_elbow_friction_reaches_motor_1_with_the_opposite_sign():
    motion = states(2, seed=33)
    tau = CoulombTerm((0.0, 0.05)).torque(Flow(belt(), motion))
    drives = to_drives(tau, belt())
    assert_close(drives[:, 1], tau[:, 1])
    assert_close(drives[:, 0], -tau[:, 1])
    assert tau.abs().max() > 0.049


ARMS = [arm(2), belt(1.5), arm(2, gear=GEAR), belt(1.5, gear=GEAR), belt(gear={**GEAR, "torque_at": "output"}), arm(1, gear=GEAR),
        arm(3, gear=GEAR)]


@pytest.mark.parametrize("a", ARMS)
def test_what_the_sensor_reads_can_be_undone(a):
    tau, qd = torques(34, a.n_links)
    assert_close(joint_torque(sensor_torque(tau, qd, a), qd, a), tau)


@pytest.mark.parametrize("a", ARMS)
def test_sensed_columns_add_up_to_the_sensed_torque(a):
    motion = states(a.n_links, seed=35)
    term = NormalDrag((1.1,) * a.n_links)
    flow = Flow(a, motion)
    columns = sensed_columns(term.columns(flow), term.torque(flow), motion.qd, a)
    assert_close(columns @ term.linear_values(), sensor_torque(term.torque(flow), motion.qd, a))


@pytest.mark.parametrize("a", [arm(2, gear=GEAR), belt(1.5, gear=GEAR)])
def test_the_gear_only_takes_energy(a):
    tau, qd = torques(36)
    drive, rate = to_drives(tau, a), drive_rates(qd, a)
    motor_power = sensor_torque(tau, qd, a) * 25.0 * rate
    assert (motor_power >= drive * rate).all()
    driving = drive * rate > 0
    assert_close(motor_power[driving], (drive * rate / 0.8)[driving])
    assert_close(motor_power[~driving], (drive * rate * 0.8)[~driving])


def test_each_joint_has_the_factor_of_its_own_gear():
    a = arm(2)
    geared = a.model_copy(update={"links": (a.links[0].model_copy(update={"gear": Gear(**GEAR)}), a.links[1])})
    tau, qd = torques(1)
    told, plain, both = (gear_factor(tau, qd, x) for x in (geared, a, arm(2, gear=GEAR)))
    assert_close(told, torch.stack([both[:, 0], plain[:, 1]], dim=1))
    assert not torch.allclose(told, plain)


def test_a_gear_at_rest_loses_nothing():
    tau, qd = torques(37)
    assert_close(sensor_torque(tau, 0 * qd, arm(2, gear=GEAR)), tau / 25)


def test_the_gear_factor_keeps_full_precision():
    tau, qd = torques(38)
    assert gear_factor(tau, qd, arm(2, gear=GEAR)).dtype == torch.float64


@pytest.mark.parametrize("links", [1, 2, 3])
def test_hub_and_joints_supply_all_the_power_that_the_loads_take(links):
    a, motion = arm(links), states(links, seed=39)
    flow = Flow(a, motion, hub=True)
    normal, axial = NormalDrag((1.0,) * links), AxialDrag((1.0,) * links)
    (force, moment), along = normal.loads(flow), axial.loads(flow)
    tau = normal.torque(flow) + axial.torque(flow)
    supplied = (tau[:, :links] * motion.qd).sum(-1) + tau[:, links + 1] * motion.u0
    taken = (force * flow.B + moment * flow.A + along * flow.u_x).sum(-1)
    assert_close(supplied, taken)


def test_the_hub_force_of_one_link_is_its_load_turned_into_world_axes():
    a, motion = arm(1), replace(states(1, seed=40), q=torch.full((50, 1), torch.pi / 2, dtype=torch.float64))
    force = torch.ones(50, 1, dtype=torch.float64)
    flow = Flow(a, motion, hub=True)
    hub = (flow.normal_columns(2 * force, force) + flow.axial_columns(3 * force)).sum(-1)[:, 1:]
    assert_close(hub, tensor([[-2.0, 3.0]]).expand(50, 2))
