"""Dynamics: forward undoes inverse, energy balances, steps give what whole runs give, and what cannot be stepped is refused."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, TINY, campaign, planted
from rigs import arm, run, states
from scipy.integrate import solve_ivp

import nnhydro
from nnhydro.deployment.step import MemoryStep, inputs_along
from nnhydro.dynamics.hub import hub_wrench
from nnhydro.dynamics.joint_model import joint_model
from nnhydro.dynamics.state import BASE, CURRENT
from nnhydro.effects.hypotheses.coulomb_friction import CoulombFriction
from nnhydro.effects.hypotheses.flow_memory import FlowMemory
from nnhydro.effects.hypotheses.wake_development import WakeDevelopment
from nnhydro.effects.hypotheses.wake_reentry import WakeReentry
from nnhydro.errors import ModelError
from nnhydro.fitting.network.train import train
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.axial_added_mass import AxialAddedMass
from nnhydro.physics.loads.history_force import HistoryForce
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Base, Motion, Water
from nnhydro.physics.travel.state_model import bspline_loads, state_loads

ROUNDING = 1e-10  # of the torque
STEPPED = 1e-9  # of the rms torque: the same recursions, their sums in another order
PAST = 2e-5  # of the rms torque: the boundary layer's past as a sum of exponentials


def theory(a, loads=None, instruments=()):
    return StripTheory(a, GIVEN, {}, "physics", planted(a) if loads is None else loads, tuple(instruments))


def conservative(a):
    """Rigid body and water whose added mass has a kinetic energy."""
    n = a.n_links
    return Loads({"rigid_body": RigidBody.of_arm(a), "added_mass": AddedMass((0.8,) * n, "energy"),
                  "axial_added_mass": AxialAddedMass((0.1,) * n, "energy")})


def along(model, motion):
    """The torques of a run that is stepped through time row by row, two copies side by side."""
    memory, found = None, []
    for k in range(len(motion)):
        at = [k, k]
        carried = StepMemory((motion.t[k] - motion.t[max(k - 1, 0)]).repeat(2), memory)
        row = Motion(motion.t[at], motion.q[at], motion.qd[at], motion.qdd[at], motion.u0[at], motion.du0[at], True, None, carried)
        torque = model.torque(row)
        assert bool((torque[0] == torque[1]).all())
        memory = carried.after
        found.append(torque[0])
    return torch.stack(found)


@pytest.fixture(scope="module")
def learned(hybrid):
    return nnhydro.Dynamics(hybrid)


@pytest.mark.slow
def test_forward_dynamics_gradients_and_memory_of_a_hybrid_with_a_trained_memory(with_memory):
    dynamics = nnhydro.Dynamics(with_memory)
    q, qd, qdd = np.random.default_rng(3).uniform(-1, 1, (3, 8, 2))
    tau = dynamics.inverse_dynamics(q, qd, qdd)
    found = dynamics.forward_dynamics(q, qd, tau)
    np.testing.assert_allclose(found, qdd, atol=1e-8)
    np.testing.assert_allclose(dynamics.inverse_dynamics(q, qd, found), tau, atol=ROUNDING)
    motion = run(2)
    steps = torch.stack([answer[0] for _, answer in inputs_along(MemoryStep(with_memory, False), motion)])
    np.testing.assert_allclose(steps, with_memory.torque(motion), atol=ROUNDING)
    state, h = dynamics.follow(dynamics.reset(q), q + 0.01, qd, 0.02), 1e-6
    found = dynamics.jacobians(q, qd, qdd, 0.3, state=state)
    for j in range(2):
        taus = [dynamics.inverse_dynamics(q, qd + sign * h * np.eye(2)[j], qdd, 0.3, state=state) for sign in (1, -1)]
        np.testing.assert_allclose(found.qd[..., j], (taus[0] - taus[1]) / (2 * h), atol=1e-5)


@pytest.mark.parametrize("links", [1, 2, 3])
@pytest.mark.parametrize("make", [planted, state_loads, conservative])
def test_forward_dynamics_undoes_inverse_dynamics(links, make):
    a = arm(links)
    dynamics = nnhydro.Dynamics(theory(a, make(a)))
    s = states(links, 20)
    given = [x.numpy() for x in (s.q, s.qd, s.qdd, s.u0, s.du0)]
    q, qd, qdd, u0, du0 = given
    tau = dynamics.inverse_dynamics(*given)
    np.testing.assert_allclose(dynamics.forward_dynamics(q, qd, tau, u0, du0), qdd, atol=ROUNDING)
    torque = np.einsum("njk,nk->nj", dynamics.mass_matrix(q, qd, u0=u0), qdd) + dynamics.bias(q, qd, u0, du0)
    np.testing.assert_allclose(torque, tau, atol=ROUNDING)


@pytest.mark.slow
def test_forward_dynamics_of_a_learned_model_undoes_its_inverse(learned):
    assert not learned.affine
    rng = np.random.default_rng(3)
    q, qd, qdd = rng.uniform(-1, 1, (3, 8, 2))
    tau = learned.inverse_dynamics(q, qd, qdd)
    found = learned.forward_dynamics(q, qd, tau)
    np.testing.assert_allclose(learned.inverse_dynamics(q, qd, found), tau, atol=ROUNDING)
    np.testing.assert_allclose(found, qdd, atol=1e-8)


@pytest.mark.slow
def test_the_mass_matrix_of_a_learned_model_is_the_slope_of_each_torque_over_each_acceleration(learned):
    q, qd, qdd = np.random.default_rng(8).uniform(-1, 1, (3, 4, 2))
    M, h = learned.mass_matrix(q, qd, qdd), 1e-4
    for k in range(2):
        ahead, behind = (learned.inverse_dynamics(q, qd, qdd + sign * h * np.eye(2)[k]) for sign in (1, -1))
        np.testing.assert_allclose(M[..., k], (ahead - behind) / (2 * h), atol=1e-6)
    assert np.abs(M - np.swapaxes(M, 1, 2)).max() > 1e-3, "else its transpose would do"


def test_the_torque_answers_for_every_change_of_energy():
    a = arm(2)
    loads = conservative(a)
    drag = NormalDrag((1.1, 0.9))
    dynamics = nnhydro.Dynamics(theory(a, loads.plus("normal_drag", drag)))
    tau, dt = np.array([1.0, -0.4]), 2e-3
    state = dynamics.reset(np.array([[0.2, 0.5], [-1.0, 0.8]]), np.array([[1.0, 0.7], [2.0, -3.0]]))

    def energy_and_power(s):
        M = dynamics.mass_matrix(s.q)
        flow = Flow(a, Motion.at(s.q, s.qd, 0.0))
        return np.einsum("nj,njk,nk->n", s.qd, M, s.qd) / 2, (s.qd * (tau - drag.torque(flow).numpy())).sum(-1)

    energies, powers = [], []
    for _ in range(51):
        energy, power = energy_and_power(state)
        energies.append(energy)
        powers.append(power)
        state = dynamics.step(state, tau, dt)
    weights = np.array([1.0, *([4.0, 2.0] * 24), 4.0, 1.0]) * dt / 3  # Simpson's rule
    work = weights @ np.array(powers)
    np.testing.assert_allclose(energies[-1] - energies[0], work, atol=1e-8 * np.max(energies))


def test_the_mass_matrix_of_an_arm_with_kinetic_energy_is_symmetric_and_positive():
    a = arm(3)
    M = nnhydro.Dynamics(theory(a, conservative(a))).mass_matrix(states(3, 20).q.numpy())
    np.testing.assert_allclose(M, np.swapaxes(M, 1, 2), atol=1e-12)
    assert np.linalg.eigvalsh(M).min() > 0


STEPPABLE = {
    "state": state_loads, "keep": lambda a: state_loads(a, at_reversal="keep"), "decay": lambda a: state_loads(a, at_reversal="decay"),
    "dwell": lambda a: state_loads(a, dwell_s=0.05), "B-splines": lambda a: bspline_loads(a, 5),
    "Keulegan and Carpenter": lambda a: state_loads(a, laws=("keulegan_carpenter",)),
    "a contact that bends": lambda a: planted(a).plus("rub", CoulombFriction(joint=1, level=(0.3,), bending=(0.05,))),
    "drag that lags": lambda a: planted(a).plus("lag", FlowMemory(share=(0.5,) * 2, response=(0.2,), travel=(0.3,))),
    "a velocity that lags": lambda a: planted(a).plus("lag", FlowMemory((0.5,) * 2, response=(0.2,), travel=(0.3,), velocity=(1.0,))),
    "its own wake": lambda a: planted(a).plus("again", WakeReentry((0.3,), (0.2,), (0.4,), (5.0,), (0.4,), (0.5,))),
    "its own wake at once": lambda a: planted(a).plus("again", WakeReentry((0.3,), (0.2,), (0.4,), (5.0,), (0.0,))),
    "a wake that develops": lambda a: planted(a).plus("grows", WakeDevelopment(*(((0.3 - 0.1 * k,)) for k in range(6)), reach=(8.0,))),
}


@pytest.mark.parametrize("name", STEPPABLE)
def test_a_run_of_steps_is_the_run_as_a_whole(name):
    a = arm(2)
    model = joint_model(theory(a, STEPPABLE[name](a)))
    motion = run(2, 75)
    want = model.torque(motion)
    far = (along(model, motion) - want).abs().max() / want.square().mean().sqrt()
    assert float(far) < STEPPED


@pytest.mark.parametrize("decay", [(), (2.0,)])
def test_the_boundary_layer_remembers_by_a_sum_of_exponentials(decay):
    a = arm(2)
    model = joint_model(theory(a, Loads({"history": HistoryForce((50.0, 50.0), decay)})))
    motion = run(2, 120)
    want = model.torque(motion)
    assert float((along(model, motion) - want).abs().max() / want.square().mean().sqrt()) < PAST


@pytest.mark.parametrize("sets", [("travel",), ("low-pass",), ("wake",)])
def test_features_with_memory_are_stepped(sets):
    a = arm(2)
    model = train(campaign(a, state_loads(a), 3, seconds=1.0, rate=50.0),
                  TINY.model_copy(update={"features": ("groups", *sets), "law": (), "epochs": 1}))
    motion = run(2)
    want = model.torque(motion)
    assert float((along(joint_model(model), motion) - want).abs().max() / want.square().mean().sqrt()) < STEPPED


def test_a_state_is_asked_with_its_memory():
    a = arm(2)
    dynamics = nnhydro.Dynamics(theory(a, state_loads(a)))
    state = dynamics.reset([0.0, 0.3])
    assert dynamics.remembers
    moved = dynamics.follow(state, [0.01, 0.31], [1.0, 0.5], 0.02)
    young, old = (dynamics.bias([0.01, 0.31], [1.0, 0.5], state=s) for s in (moved, None))
    assert np.all(np.abs(young) < 0.5 * np.abs(old)), "the wake of a link that has hardly moved gives little drag"
    again = dynamics.bias([0.01, 0.31], [1.0, 0.5], state=moved)
    np.testing.assert_array_equal(young, again)
    assert state.t == 0.0
    assert moved.t == 0.02


@pytest.mark.slow
def test_steps_converge_at_the_second_order_of_the_memory_or_better():
    a = arm(2)
    dynamics, ends = nnhydro.Dynamics(theory(a, state_loads(a))), []
    for count in (5, 10, 20):
        state = dynamics.reset([0.1, 0.4])
        for _ in range(count):
            state = dynamics.step(state, [1.0, -0.2], 0.2 / count)
        ends.append(state.q)
    assert np.abs(ends[1] - ends[2]).max() < np.abs(ends[0] - ends[1]).max() / 3


def test_steps_on_a_carriage_that_speeds_up_follow_it_to_the_fourth_order():
    a = arm(2)
    dynamics, tau, u0, du0 = nnhydro.Dynamics(theory(a, conservative(a))), np.array([1.0, -0.3]), 0.4, -1.5

    def slope(t, y):
        return np.concatenate([y[2:], dynamics.forward_dynamics(y[:2], y[2:], tau, u0 + du0 * t, du0)])

    start = np.array([0.3, -0.5, 0.6, 0.2])
    want = solve_ivp(slope, (0.0, 0.2), start, rtol=1e-10, atol=1e-12).y[:, -1]
    far = []
    for count in (4, 8):
        state = dynamics.reset(start[:2], start[2:], u0)
        for _ in range(count):
            state = dynamics.step(state, tau, 0.2 / count, du0)
        far.append(np.abs(np.concatenate([state.q, state.qd]) - want).max())
    assert far[1] < 1e-6
    assert far[1] < far[0] / 10
    assert state.u0 == pytest.approx(u0 + du0 * 0.2)
    assert state.t == pytest.approx(0.2)


def test_the_bias_holds_what_an_accelerating_and_turning_base_asks_for():
    dynamics = nnhydro.Dynamics(theory(arm(2)))
    q, qd, zero, base = [0.3, -0.5], [0.6, 0.2], [0.0, 0.0], {"base_yaw_rad": 0.4, "base_yaw_rad_s": 0.7, "dbase_yaw_rad_s2": -0.5}
    np.testing.assert_array_equal(dynamics.bias(q, qd, 0.2, 1.5, base=base), dynamics.inverse_dynamics(q, qd, zero, 0.2, 1.5, base=base))
    turned = dynamics.inverse_dynamics([0.7, -0.5], [1.3, 0.2], [-0.5, 0.0], 0.2, 1.5)
    np.testing.assert_allclose(dynamics.bias(q, qd, 0.2, 1.5, base=base), turned, atol=1e-12)


@pytest.mark.parametrize("name", ["state", "hybrid"])
def test_the_memory_follows_the_wake_of_a_moving_base_in_a_current(name, hybrid):
    model = theory(arm(2), state_loads(arm(2))) if name == "state" else hybrid
    motion, t = run(2, 75), run(2, 75).t
    sin, cos = torch.sin(t), torch.cos(t)
    base = Base(0.3 * sin, 0.3 * cos, 0.2 * (1 - cos), 0.2 * sin, 0.2 * cos)
    water = Water(torch.stack([0.2 * sin, 0.1 * sin], 1), torch.stack([0.2 * cos, 0.1 * cos], 1))
    dynamics, found, state = nnhydro.Dynamics(model), [], None
    for k in range(len(t)):
        columns = [base.vx, base.ax, base.heading, base.rate, base.acceleration, *water.velocity.T, *water.acceleration.T]
        around = {key: float(x[k]) for key, x in zip((*BASE, *CURRENT), columns, strict=True)}
        q, qd, qdd, u0, du0 = (getattr(motion, key)[k].numpy() for key in ("q", "qd", "qdd", "u0", "du0"))
        state = dynamics.follow(state, q, qd, float(t[k] - t[k - 1]), u0, base=around) if k else dynamics.reset(q, qd, u0, around)
        found.append(dynamics.inverse_dynamics(q, qd, qdd, u0, du0, state, around))
    want = dynamics.model.torque(replace(motion, base=base, current=water)).numpy()
    assert np.abs(np.array(found) - want).max() < STEPPED * np.sqrt((want**2).mean())
    assert np.abs(np.array(found) - dynamics.model.torque(motion).numpy()).max() > 0.1 * np.sqrt((want**2).mean())


def test_steps_on_an_accelerating_vehicle_are_those_on_a_carriage_that_moves_alike():
    """A base along +X under a heading of -90 degrees is a carriage along +Y, and a current is the base's motion the other way round."""
    dynamics, tau = nnhydro.Dynamics(theory(arm(2), state_loads(arm(2)))), [1.0, -0.3]
    carriage, vehicle = dynamics.reset([0.3, -0.5], [0.6, 0.2], 0.4), dynamics.reset(
        [0.3, -0.5], [0.6, 0.2], base={"base_x_m_s": 0.4, "base_yaw_rad": -np.pi / 2})
    for k in range(6):
        around = {"base_x_m_s": 0.4 - 0.6 * 0.02 * k, "dbase_x_m_s2": -0.6, "base_yaw_rad": -np.pi / 2}
        carriage, vehicle = dynamics.step(carriage, tau, 0.02, -0.6), dynamics.step(vehicle, tau, 0.02, base=around)
    np.testing.assert_allclose(vehicle.q, carriage.q, atol=1e-12)
    assert np.abs(dynamics.step(vehicle, tau, 0.5).q - dynamics.step(vehicle, tau, 0.5, base=around).q).max() > 1e-4


@pytest.mark.slow
def test_jacobians_are_the_slopes_of_the_torque(hybrid):
    rng = np.random.default_rng(4)
    q, qd, qdd = rng.uniform(-1, 1, (3, 5, 2))
    for model in (theory(arm(2), state_loads(arm(2))), hybrid):
        dynamics = nnhydro.Dynamics(model)
        state = dynamics.follow(dynamics.reset(q), q + 0.01, qd, 0.02)
        found, h = dynamics.jacobians(q, qd, qdd, 0.3, state=state), 1e-6
        for name, place in (("q", 0), ("qd", 1), ("qdd", 2)):
            for j in range(2):
                shift = h * np.eye(2)[j]
                ahead, behind = ([x + sign * shift if k == place else x for k, x in enumerate((q, qd, qdd))] for sign in (1, -1))
                taus = [dynamics.inverse_dynamics(*moved, 0.3, state=state) for moved in (ahead, behind)]
                np.testing.assert_allclose(getattr(found, name)[..., j], (taus[0] - taus[1]) / (2 * h), atol=1e-5)
        for slope, shift in ((found.u0, (h, 0.0)), (found.du0, (0.0, h))):
            taus = [dynamics.inverse_dynamics(q, qd, qdd, 0.3 + sign * shift[0], sign * shift[1], state) for sign in (1, -1)]
            np.testing.assert_allclose(slope, (taus[0] - taus[1]) / (2 * h), atol=1e-5)


@pytest.mark.slow
def test_the_moment_on_the_base_is_the_torque_of_joint_1_but_for_friction_and_what_is_learned(hybrid):
    motion, mechanical = run(2), joint_model(hybrid)
    physics = joint_model(hybrid.baseline)
    learned = (mechanical.torque(motion) - physics.torque(motion))[:, 0]
    friction = sum(tau[:, 0] for name, tau in hybrid.baseline.loads.by_term(Flow(arm(2), motion)).items() if name.endswith("friction"))
    assert learned.abs().max() > 1e-3
    torch.testing.assert_close(mechanical.torque(motion)[:, 0] + hub_wrench(mechanical, motion).total[:, 2], learned + friction,
                               rtol=0.0, atol=1e-10)


def test_a_tensor_s_gradient_through_a_learned_model_is_its_jacobian(learned):
    q, qd, qdd = np.random.default_rng(5).uniform(-1, 1, (3, 6, 2))
    moved = torch.tensor(q, requires_grad=True)
    learned.inverse_dynamics(moved, qd, qdd)[:, 1].sum().backward()
    np.testing.assert_allclose(moved.grad, learned.jacobians(q, qd, qdd).q[:, 1], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["hybrid", "with_memory"])
def test_a_gradient_at_rest_is_the_mean_of_the_slopes_on_both_sides(name, request):
    dynamics, h = nnhydro.Dynamics(request.getfixturevalue(name)), 1e-7
    rest = [torch.zeros(1, 2, dtype=torch.float64, requires_grad=True) for _ in range(3)]
    dynamics.inverse_dynamics(*rest).sum().backward()
    for place, x in enumerate(rest):
        shift, still = h * torch.eye(2, dtype=torch.float64), torch.zeros(2, 2, dtype=torch.float64)
        shifted = [[sign * shift if k == place else still for k in range(3)] for sign in (1, -1)]
        high, low = (dynamics.inverse_dynamics(*columns).sum(dim=1) for columns in shifted)
        torch.testing.assert_close(x.grad[0], (high - low) / (2 * h), rtol=1e-4, atol=1e-5)


@pytest.mark.slow
def test_a_dynamics_is_pickled(hybrid):
    for model in (theory(arm(2), state_loads(arm(2))), hybrid):
        again = pickle.loads(pickle.dumps(nnhydro.Dynamics(model)))
        state = again.step(again.reset([0.1, 0.2]), [0.2, 0.0], 0.01)
        assert np.isfinite(state.q).all()


def test_what_is_no_dynamics_is_said():
    a = arm(2)
    with pytest.raises(ModelError, match="correction of torques that were simulated elsewhere"):
        nnhydro.Dynamics(CorrectedSimulation(a, GIVEN, {}, None, theory(a), theory(a)))
    with pytest.raises(ModelError, match="is not a model"):
        nnhydro.Dynamics(3)
    dynamics = nnhydro.Dynamics(theory(a))
    with pytest.raises(ModelError, match="last axis must have 2"):
        dynamics.bias([0.1, 0.2, 0.3], [0.0, 0.0])
    with pytest.raises(ModelError, match="NaN"):
        dynamics.bias([0.1, np.nan], [0.0, 0.0])
    with pytest.raises(ModelError, match="leading axes"):
        dynamics.bias(np.zeros((3, 2)), np.zeros((4, 2)))
    with pytest.raises(ModelError, match="one positive step"):
        dynamics.step(dynamics.reset([0.0, 0.0]), [0.0, 0.0], 0.0)
    massless = nnhydro.Dynamics(theory(a, Loads({"normal_drag": NormalDrag((1.0, 1.0))})))
    with pytest.raises(ModelError, match="no inertia"):
        massless.forward_dynamics([0.1, 0.2], [0.0, 0.0], [1.0, 1.0])


def test_a_step_or_a_state_that_cannot_be_is_refused_in_words():
    a = arm(2)
    dynamics, other = nnhydro.Dynamics(theory(a, state_loads(a))), nnhydro.Dynamics(theory(a))
    state = dynamics.reset([0.0, 0.0])
    for dt in ("a", np.array([0.1, 0.2]), np.nan, np.inf, -1.0):
        for move in (lambda dt=dt: dynamics.step(state, [0.0, 0.0], dt), lambda dt=dt: dynamics.follow(state, [0.1, 0.1], [1.0, 1.0], dt)):
            with pytest.raises(ModelError, match="one positive step"):
                move()
    refusals = [(other.reset([0.0, 0.0]), "of another model"), ({"q": 1}, "reset, step or follow"), (None, "reset, step or follow")]
    for wrong, message in refusals:
        with pytest.raises(ModelError, match=message):
            dynamics.step(wrong, [0.0, 0.0], 0.1)
    with pytest.raises(ModelError, match="of another model"):
        other.bias([0.0, 0.0], [0.0, 0.0], state=state)
    assert repr(dynamics) == "Dynamics(physics, 2 joint(s), with memory)"


@pytest.mark.parametrize("kind", ["physics", "hybrid"])
def test_a_step_that_is_too_long_or_a_torque_that_is_too_large_is_no_missing_mass(kind, hybrid):
    dynamics = nnhydro.Dynamics(theory(arm(2)) if kind == "physics" else hybrid)
    state = dynamics.reset([0.3, 0.2], [3.0, -2.0])

    def steps():
        after = state
        for _ in range(12):
            after = dynamics.step(after, [5.0, 1.0], 10.0)

    with pytest.raises(ModelError, match="shorten dt"):
        steps()
    for qd, qdd in (([1e200, 0.0], [0.0, 0.0]), ([0.0, 0.0], [1e308, 1e308])):
        with pytest.raises(ModelError, match="check their units"):
            dynamics.inverse_dynamics([0.1, 0.2], qd, qdd)
    if kind == "hybrid":
        with pytest.raises(ModelError, match=r"the acceleration becomes .*rad/s\^2: a torque"):
            dynamics.forward_dynamics([0.0, 0.0], [0.0, 0.0], [1e12, 0.0])
    with pytest.raises(ModelError, match=r"q is not given \(None\)"):
        dynamics.bias(None, [0.0, 0.0])


def test_one_state_goes_on_under_many_torques_and_no_arm_gives_no_torque(learned):
    a = arm(2)
    dynamics, tau = nnhydro.Dynamics(theory(a, state_loads(a))), np.array([[0.5, 0.1], [-1.0, 0.2], [2.0, 0.0]])
    state = dynamics.follow(dynamics.reset([0.2, 0.3]), [0.21, 0.32], [0.5, 0.4], 0.02)
    many = dynamics.step(dynamics.step(state, tau, 0.01), tau, 0.01)
    for k in range(3):
        one = dynamics.step(dynamics.step(state, tau[k], 0.01), tau[k], 0.01)
        np.testing.assert_allclose(many.q[k], one.q, rtol=1e-14)
        np.testing.assert_allclose(dynamics.bias(many.q, many.qd, state=many)[k], dynamics.bias(one.q, one.qd, state=one), rtol=1e-12)
    none = np.zeros((0, 2))
    assert learned.forward_dynamics(none, none, none).shape == (0, 2)


@pytest.mark.slow
def test_the_gradient_of_a_learned_acceleration_is_its_slope(learned):
    h, given = 1e-4, [torch.tensor(x, requires_grad=True) for x in np.random.default_rng(6).uniform(-1, 1, (3, 2))]
    learned.forward_dynamics(*given)[1].backward()
    shifts = h * torch.eye(6, dtype=torch.float64)
    ahead, behind = (learned.forward_dynamics(*(torch.cat([x.detach() for x in given]) + sign * shifts).split(2, dim=1))[:, 1]
                     for sign in (1, -1))
    torch.testing.assert_close(torch.cat([x.grad for x in given]), (ahead - behind) / (2 * h), rtol=1e-4, atol=1e-4)


def test_a_model_that_cannot_be_stepped_is_refused():
    a = arm(2)

    class Whole(type(theory(a)).__mro__[1]):
        kind = "whole"

        def torque(self, motion):
            return motion.qd.cumsum(0)

        def document(self):
            return {}

    with pytest.raises(ModelError, match="cannot be stepped"):
        nnhydro.Dynamics(Whole(a, GIVEN, {}))
    assert replace(theory(a)).name == "physics"
