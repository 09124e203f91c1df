"""The wrench on the base: momentum balance of the links and of the water they carry, and brute-force strips written out in numpy."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted, recording
from rigs import arm, run

import nnhydro
from nnhydro.cli.main import run as run_command
from nnhydro.dynamics.hub import hub_wrench
from nnhydro.dynamics.joint_model import joint_model
from nnhydro.effects.hypotheses.ambient_current import AmbientCurrent
from nnhydro.effects.hypotheses.payload_mass import PayloadMass
from nnhydro.errors import ModelError
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.storage import save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.axial_added_mass import AxialAddedMass
from nnhydro.physics.loads.axial_drag import AxialDrag
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.water_pressure import WaterPressure
from nnhydro.physics.motion import Base, Water
from nnhydro.physics.travel.state_model import state_loads


def model(a, loads, instruments=()):
    return joint_model(StripTheory(a, GIVEN, {}, "physics", loads, tuple(instruments)))


def moving(a, rows=4001):
    """A run on a base that goes along X and Y and turns, sampled finely."""
    m = run(a.n_links, rows)
    t = m.t
    heading, rate, yaw = 0.4 * torch.sin(0.9 * t), 0.36 * torch.cos(0.9 * t), -0.324 * torch.sin(0.9 * t)
    return replace(m, base=Base(0.3 * torch.sin(1.1 * t), 0.33 * torch.cos(1.1 * t), heading, rate, yaw))


def geometry(a, m):
    """Hub position, joint positions (n, links, 2) from the hub, unit vectors and rates of the links, all written out."""
    phi = np.cumsum(m.q.numpy(), axis=1) + m.base.heading.numpy()[:, None]
    rate = np.cumsum(m.qd.numpy(), axis=1) + m.base.rate.numpy()[:, None]
    e, n = np.stack([np.cos(phi), np.sin(phi)], -1), np.stack([-np.sin(phi), np.cos(phi)], -1)
    hub = np.stack([m.base.vx.numpy(), m.u0.numpy()], -1)
    joints, speeds = [np.zeros_like(hub)], [hub]
    for i in range(a.n_links):
        joints.append(joints[-1] + a.L[i] * e[:, i])
        speeds.append(speeds[-1] + a.L[i] * rate[:, i, None] * n[:, i])
    return joints, speeds, e, n, rate, hub


def cross(x, y):
    return x[..., 0] * y[..., 1] - x[..., 1] * y[..., 0]


def balanced(wrench, t, momentum, spin, hub):
    """Force and moment on the base against d/dt of momentum and of spin about the moving hub, away from the ends."""
    force = -np.gradient(momentum, t, axis=0, edge_order=2)
    moment = -np.gradient(spin, t, edge_order=2) - cross(hub, momentum)
    inside = slice(5, -5)
    scale = np.abs(force).max()
    np.testing.assert_allclose(wrench[inside, :2], force[inside], atol=2e-5 * scale)
    np.testing.assert_allclose(wrench[inside, 2], moment[inside], atol=2e-5 * scale)


@pytest.mark.parametrize("links", [1, 2, 3])
def test_the_rigid_part_balances_the_momentum_of_the_links(links):
    a = arm(links)
    m = moving(a)
    wrench = hub_wrench(model(a, Loads({"rigid_body": RigidBody.of_arm(a)})), m)
    joints, speeds, e, n, rate, hub = geometry(a, m)
    momentum, spin = np.zeros_like(hub), np.zeros(len(m))
    for i, link in enumerate(a.links):
        place, speed = joints[i] + link.com_m * e[:, i], speeds[i] + link.com_m * rate[:, i, None] * n[:, i]
        momentum += link.mass_kg * speed
        spin += link.mass_kg * cross(place, speed) + link.inertia_kg_m2 * rate[:, i]
    assert not wrench.fluid.any()
    balanced(wrench.rigid.numpy(), m.t.numpy(), momentum, spin, hub)


@pytest.mark.parametrize("links", [1, 2])
def test_the_water_s_part_balances_the_momentum_of_the_water_that_is_carried(links):
    a = arm(links)
    m = moving(a)
    C, Cx = 0.8, 0.2
    loads = Loads({"added_mass": AddedMass((C,) * links, "energy"), "axial_added_mass": AxialAddedMass((Cx,) * links, "energy")})
    wrench = hub_wrench(model(a, loads), m)
    joints, speeds, e, n, rate, hub = geometry(a, m)
    momentum, spin = np.zeros_like(hub), np.zeros(len(m))
    x, weight = np.polynomial.legendre.leggauss(4)
    for i in range(links):
        mass = 1000 * np.pi * a.D[i]**2 / 4
        for share, part in zip((x + 1) / 2, weight / 2, strict=True):
            place, speed = joints[i] + share * a.L[i] * e[:, i], speeds[i] + share * a.L[i] * rate[:, i, None] * n[:, i]
            across, axial = ((speed * axis[:, i]).sum(-1)[:, None] * axis[:, i] for axis in (n, e))
            carried = mass * a.L[i] * part * (C * across + Cx * axial)
            momentum += carried
            spin += cross(place, carried)
    balanced(wrench.fluid.numpy(), m.t.numpy(), momentum, spin, hub)


def through(velocity, m):
    """A base that moves with `velocity` (n, 2) through still water, its acceleration that of a linear growth, in the motion `m`."""
    zero, slope = torch.zeros_like(m.t), torch.tensor([0.4, -0.7], dtype=torch.float64).expand(len(m), 2)
    return replace(m, u0=velocity[:, 1], du0=slope[:, 1], base=Base(velocity[:, 0], slope[:, 0], zero, zero, zero)), slope


def test_the_base_feels_the_motion_through_the_water_and_the_pressure_of_water_that_speeds_up():
    """Galilei and Froude-Krylov: water that moves past a held base loads it as towing does, but for the displaced mass times dv/dt."""
    a, m = arm(2), run(2, 40)
    loads = Loads({"drag": NormalDrag((1.1, 0.9)), "skin": AxialDrag((0.03, 0.02)), "added_mass": AddedMass((0.8, 0.7), "energy"),
                   "along": AxialAddedMass((0.2, 0.1), "energy")})
    first, second = (0.15, -0.1), (-0.4, 0.25)
    measured = torch.stack([0.2 * torch.sin(m.t), 0.1 * torch.cos(m.t)], dim=1)
    towed, slope = through(-measured - torch.tensor([first, second], dtype=torch.float64).sum(0), m)
    held = replace(m, u0=0 * m.t, du0=0 * m.t, current=Water(measured, -slope))
    currents = [AmbientCurrent(*((v,) for v in velocity)) for velocity in (first, second)]
    want = hub_wrench(model(a, loads), towed).fluid.numpy()
    np.testing.assert_allclose(hub_wrench(model(a, loads, currents), held).fluid, want, rtol=1e-12, atol=1e-12)
    for fewer in (currents[:1], currents[1:]):
        assert np.abs(hub_wrench(model(a, loads, fewer), held).fluid.numpy() - want).max() > 0.1
    pushed = hub_wrench(model(a, loads.plus("pressure", WaterPressure()), currents), held).fluid.numpy() - want
    for k, (q, accelerates) in enumerate(zip(m.q.numpy(), -slope.numpy(), strict=True)):
        joint, force, moment = np.zeros(2), np.zeros(2), 0.0
        for length, D, phi in zip(a.L, a.D, np.cumsum(q), strict=True):
            e = np.array([np.cos(phi), np.sin(phi)])
            push = 1000 * np.pi * D**2 / 4 * length * accelerates
            force, moment, joint = force + push, moment + cross(joint + length / 2 * e, push), joint + length * e
        np.testing.assert_allclose(pushed[k], [*force, moment], rtol=1e-10, atol=1e-10)


def test_a_corrected_simulation_loads_the_base_as_the_simulation_and_what_was_found():
    a, m = arm(2), run(2, 30)
    simulated, before = planted(a), Loads({"rigid_body": RigidBody.of_arm(a), "drag": NormalDrag((1.0, 1.0))})
    after = before.plus("load", PayloadMass((0.4,), (0.05,)))
    theories = [StripTheory(a, GIVEN, {}, "physics", loads) for loads in (simulated, before, after)]
    corrected = joint_model(CorrectedSimulation(a, GIVEN, {}, *theories))
    got, want = hub_wrench(corrected, m), hub_wrench(model(a, simulated.plus("load", PayloadMass((0.4,), (0.05,)))), m)
    np.testing.assert_allclose(got.rigid, want.rigid, atol=1e-12)
    np.testing.assert_allclose(got.fluid, want.fluid, atol=1e-12)
    np.testing.assert_allclose(got.total[:, 2], -corrected.torque(m)[:, 0], atol=1e-12)


def test_drag_on_the_base_is_the_sum_over_many_strips():
    a = arm(2)
    m = moving(a, 50)
    loads = Loads({"normal_drag": NormalDrag((1.1, 0.9)), "axial_drag": AxialDrag((0.03, 0.02)), "rub": CoulombTerm((0.5, 0.5))})
    current = (0.15, -0.1)
    wrench = hub_wrench(model(a, loads, [AmbientCurrent((current[0],), (current[1],))]), m).fluid.numpy()
    joints, speeds, e, n, rate, _ = geometry(a, m)
    want = np.zeros((len(m), 3))
    for i, (C, Cx) in enumerate(((1.1, 0.03), (0.9, 0.02))):
        for s in (np.arange(4000) + 0.5) / 4000:
            place = joints[i] + s * a.L[i] * e[:, i]
            speed = speeds[i] + s * a.L[i] * rate[:, i, None] * n[:, i] - np.array(current)
            w, along = (speed * n[:, i]).sum(-1), (speed * e[:, i]).sum(-1)
            across, axial = C * (np.abs(w) * w)[:, None] * n[:, i], Cx * (np.abs(along) * along)[:, None] * e[:, i]
            on_link = -0.5 * 1000 * a.D[i] * a.L[i] / 4000 * (across + axial)
            want[:, :2] += on_link
            want[:, 2] += cross(place, on_link)
    np.testing.assert_allclose(wrench, want, atol=1e-6 * np.abs(want).max())


@pytest.mark.parametrize("make", [planted, state_loads, lambda a: planted(a).plus("load", PayloadMass((0.4,), (0.05,)))])
def test_the_moment_is_the_torque_of_joint_1_without_friction(make):
    a, m = arm(2), run(2)
    physics = model(a, make(a))
    np.testing.assert_allclose(hub_wrench(physics, m).total[:, 2], -physics.torque(m)[:, 0], atol=1e-12)
    rubbing = model(a, make(a).plus("rub", CoulombTerm((0.5, 0.5))))
    np.testing.assert_allclose(hub_wrench(rubbing, m).total, hub_wrench(physics, m).total)


def test_the_force_that_the_hub_supplies_is_that_on_the_base_turned_round():
    a, m = arm(2), run(2, 200)
    loads = state_loads(a)
    loads = loads.plus("rubbing", CoulombTerm((0.2, 0.1)))
    base = hub_wrench(model(a, loads), m).total
    assert float(base[:, :2].abs().max()) > 1.0
    torch.testing.assert_close(loads.hub_force(Flow(a, m)), -base[:, :2], rtol=1e-9, atol=1e-9)


def test_a_payload_weighs_on_the_base_too():
    a = arm(1, gravity_m_s2=9.81)
    loads = Loads({"rigid_body": RigidBody.of_arm(a), "load": PayloadMass((0.5,), (0.0,))})
    dynamics = nnhydro.Dynamics(StripTheory(a, GIVEN, {}, "physics", loads))
    wrench = dynamics.hub_wrench([0.0], [0.0], [0.0])
    np.testing.assert_allclose(wrench.rigid, [0.0, -1.1 * 9.81, -1.1 * 0.27 * 9.81], atol=1e-9)
    np.testing.assert_allclose(wrench.fluid, [0.0, -0.5 * 9.81, -0.5 * 0.55 * 9.81], atol=1e-9)


def test_a_base_that_turns_is_a_first_joint_that_turns():
    a = arm(2)
    dynamics = nnhydro.Dynamics(StripTheory(a, GIVEN, {}, "physics", planted(a)))
    q, qd, qdd = np.array([0.3, -0.5]), np.array([0.7, 0.2]), np.array([1.0, -2.0])
    turned = dynamics.inverse_dynamics(q - [0.1, 0], qd - [0.4, 0], qdd - [0.6, 0],
                                       base={"base_yaw_rad": 0.1, "base_yaw_rad_s": 0.4, "dbase_yaw_rad_s2": 0.6})
    np.testing.assert_allclose(turned, dynamics.inverse_dynamics(q, qd, qdd), atol=1e-12)
    back = dynamics.forward_dynamics(q, qd, turned, base={"base_x_m_s": 0.5, "dbase_x_m_s2": 0.2})
    np.testing.assert_allclose(dynamics.inverse_dynamics(q, qd, back, base={"base_x_m_s": 0.5, "dbase_x_m_s2": 0.2}), turned, atol=1e-10)
    with pytest.raises(ModelError, match="unknown key"):
        dynamics.bias(q, qd, base={"speed": 1.0})
    assert Flow(a, run(2), hub=True).lever_normal.shape[1] == 4


def test_the_file_of_predict_holds_the_wrench_row_for_row(tmp_path, capsys):
    a = arm(2)
    physics = StripTheory(a, GIVEN, {}, "physics", planted(a))
    save_model(physics, tmp_path / "model")
    motion = recording(a, planted(a), seconds=1.0, speed=0.3)
    columns = {"t_s": motion.t, "u0_m_s": motion.u0, "du0_m_s2": motion.du0}
    for j in range(2):
        columns |= {f"q{j + 1}_rad": motion.q[:, j], f"dq{j + 1}_rad_s": motion.qd[:, j], f"ddq{j + 1}_rad_s2": motion.qdd[:, j]}
    table = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / "swing.csv", table, fmt="%.17g", delimiter=",", header=",".join(columns), comments="")
    assert run_command(["predict", str(tmp_path / "model"), str(tmp_path / "swing.csv"), "--hub", "--out", str(tmp_path / "out")]) == 0
    got = np.genfromtxt(tmp_path / "out" / "swing.csv", delimiter=",", names=True)
    want = nnhydro.Dynamics(physics).hub_wrench(motion.q, motion.qd, motion.qdd, u0=motion.u0, du0=motion.du0).total
    for k, name in enumerate(("hub_Fx_N", "hub_Fy_N", "hub_Mz_Nm")):
        np.testing.assert_allclose(got[name], want[:, k], rtol=1e-5, atol=1e-6 * np.abs(want[:, k]).max())
    np.testing.assert_allclose(got["hub_Mz_Nm"], -got["tau1_Nm"], rtol=1e-5, atol=1e-6)
    assert "hub_Mz_Nm" not in "".join(capsys.readouterr())
    rubbing = replace(physics, loads=planted(a).plus("rub", CoulombTerm((0.5, 0.5))))
    save_model(rubbing, tmp_path / "rubbing")
    assert run_command(["predict", str(tmp_path / "rubbing"), str(tmp_path / "swing.csv"), "--hub", "--out", str(tmp_path / "out2")]) == 0
    rubbed = np.genfromtxt(tmp_path / "out2" / "swing.csv", delimiter=",", names=True)
    np.testing.assert_allclose(rubbed["hub_Mz_Nm"], got["hub_Mz_Nm"], rtol=1e-5, atol=1e-6)
    apart = np.sqrt(((rubbed["tau1_Nm"] + rubbed["hub_Mz_Nm"]) ** 2).mean())
    assert f"hub_Mz_Nm differs from -tau1_Nm by {apart:.3g} N m rms" in "".join(capsys.readouterr())
