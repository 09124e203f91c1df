"""Closed forms, limits and rigid-body identities of single hypotheses."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
import torch
from hypotheses import made, steady
from rigs import LINKS, arm, assert_close, hub_at_rest, run, states
from scipy.integrate import quad, solve_ivp
from stepped import long_run

from nnhydro.effects.catalogue import candidates
from nnhydro.effects.effect import REGISTER
from nnhydro.effects.hypotheses.link_interference import shadow
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import term_of
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.strips import Strips
from nnhydro.physics.transmission import to_drives


def test_a_spring_pulls_to_its_rest_angle():
    spring = made("umbilical_stiffness", arm(2), 2, stiffness=(0.5,), preload=(-0.1,))
    tau = spring.torque(Flow(arm(2), steady([[1.0, 0.7], [1.0, 0.2]])))
    assert_close(tau, tensor([[0.0, 0.25], [0.0, 0.0]]))
    assert spring.quantities() == {"stiffness": Quantity(0.5, "N m/rad"), "rest_angle": Quantity(0.2, "rad")}
    said = spring.statement({"stiffness": (0.44, 0.56)})
    assert said == "A hose or cable pulls joint 2 towards 0.2 rad with a stiffness of 0.50 +- 0.06 N m/rad."


def test_a_hull_is_upright_where_its_weight_hangs_whatever_turn_it_is_counted_in():
    hull = made("righting_moment", arm(1), 1, cubic=(-2.0,), quintic=(0.5,))
    x = np.array([-0.8, -0.1, 0.0, 0.3, 1.2])
    for turn in (-2 * np.pi, 0.0, 2 * np.pi):
        tau = hull.torque(Flow(arm(1), steady((x - np.pi / 2 + turn)[:, None])))[:, 0]
        np.testing.assert_allclose(tau, -2.0 * x**3 + 0.5 * x**5, atol=1e-12)
    assert "softens" in hull.statement()
    assert "stiffens" in replace(hull, cubic=(2.0,)).statement()


@pytest.mark.parametrize(("depth", "direction"), [(0.3, 0.4), (2.0, 0.4), (0.3, 2.9)])
def test_a_wall_raises_drag_and_added_mass_by_what_the_integral_over_the_link_says(depth, direction):
    """One link that turns about its hub: tau_a = int c(x) exp(-(1 - x cos(q - d)/L) / depth) x dx."""
    a, q, qd, qdd = arm(1), 0.4, 1.5, 2.0
    L, D = LINKS[0]["length_m"], LINKS[0]["diameter_m"]
    wall = made("wall_proximity", a, 0, depth=(depth,), direction=(direction,))
    got = wall.columns(Flow(a, Motion.at([[q]], [[qd]], [[qdd]])))[0, 0].numpy()
    near = lambda x: np.exp((x * np.cos(q - direction) / L - 1) / depth)  # noqa: E731
    drag = quad(lambda x: 0.5 * a.fluid.density_kg_m3 * D * (qd * x) ** 2 * near(x) * x, 0, L)[0]
    inertia = quad(lambda x: a.fluid.density_kg_m3 * pi * D**2 / 4 * qdd * x * near(x) * x, 0, L)[0]
    np.testing.assert_allclose(got, [drag, inertia], rtol=0.005)


def bent(k, p, k2, k3):
    return made("umbilical_stiffness", arm(1), 1, stiffness=(k,), preload=(p,), quadratic=(k2,), cubic=(k3,))


def test_a_hose_is_the_same_about_any_angle():
    """k (q - r) about a is k x + k (a - r), x = q - a; its torque is odd about r."""
    k, rest = 1.3, -1.4
    motion = steady(np.linspace(-2.2, -0.9, 7)[:, None])
    about_zero = made("umbilical_stiffness", arm(1), 1, stiffness=(k,), preload=(-k * rest,), quadratic=(), cubic=())
    about_hanging = replace(about_zero, preload=(k * (-np.pi / 2 - rest),)).centre((-np.pi / 2,))
    np.testing.assert_allclose(about_hanging.torque(Flow(arm(1), motion)), about_zero.torque(Flow(arm(1), motion)), atol=1e-12)
    assert about_hanging.quantities()["rest_angle"].value == pytest.approx(rest)
    assert term_of(about_hanging.document()) == about_hanging


def test_a_hose_that_bends_lies_slack_where_its_torque_is_zero_and_is_as_stiff_there_as_its_slope():
    k, rest, hardening = 0.8, 0.3, 0.15  # k (d + 0.15 d^3), d = q - rest, multiplied out
    hose = bent(k * (1 + 3 * hardening * rest**2), -k * (rest + hardening * rest**3), -3 * k * hardening * rest, k * hardening)
    d = (q := np.linspace(-2, 2, 9)) - rest
    np.testing.assert_allclose(hose.torque(Flow(arm(1), steady(q[:, None])))[:, 0], k * (d + hardening * d**3), atol=1e-12)
    format_quantity = hose.quantities()
    assert (format_quantity["stiffness"].value, format_quantity["rest_angle"].value) == (pytest.approx(k), pytest.approx(rest))
    assert "stiffness grows away" in hose.statement()
    assert "stiffness falls away" in bent(1.0, 0.0, 0.0, -0.1).statement()
    assert "larger on one side of this angle than on the other" in bent(1.0, 0.0, 0.5, 0.1).statement()


@pytest.mark.parametrize(("zeros", "rest"), [((-0.4, 1.0, 2.0), -0.4), ((0.3, 2j, -2j), 0.3)])
def test_of_several_angles_a_hose_lies_slack_at_the_least_that_is_one_and_towards_which_it_pulls(zeros, rest):
    k3, k2, k, p = np.poly(zeros).real
    assert bent(k, p, k2, k3).quantities()["rest_angle"].value == pytest.approx(rest)


def test_a_hose_is_also_tried_as_a_linear_spring():
    effect = bent(1.0, 0.0, 0.0, 0.0)
    assert [len(law.linear_names()) for law in (effect, *effect.narrower())] == [4, 2]
    assert effect.linear
    assert not bent(1.0, 0.0, 0.0, 0.1).linear


@pytest.mark.parametrize(("values", "makes_sense"), [
    ((1.0, 0.5, 0.0, -0.1), True), ((1.0, -6.2, 0.0, 0.0), True), ((1.0, 6.4, 0.0, 0.0), False),  # a rest angle beyond a turn
    ((0.0, 0.5, 0.0, 0.0), False), ((0.0, 0.0, 0.0, 0.0), True), ((-1.0, 0.5, 0.0, 0.0), False),  # no pull; none; a push
    ((0.0, 0.5, 1.0, 0.0), False), ((0.0, 0.0, 0.0, -1.0), False), ((1.0, 0.0, 0.0, 1e-310), True),  # never slack; nothing cubic
    ((0.0, -1.0, 1.0, 0.0), False), ((0.001, 0.3, 0.0, 0.01), False),  # pushes on one side; a torque that hardly changes
    ((1.0, -0.39, 0.0, -1.0), False), ((1.7, -0.5, 0.3, 0.2), True)])
def test_a_hose_pulls_towards_an_angle_within_a_turn_and_bends_about_it(values, makes_sense):
    assert bent(*values).plausible() == makes_sense


@pytest.mark.parametrize("rest", [-1.6, -0.9, 0.9, 1.6])
def test_a_hose_that_lies_slack_far_from_zero_may_be_soft_there(rest):
    k3, k2, k, p = np.poly1d([-0.15, 0.0, 1.0, 0.0])(np.poly1d([1.0, -rest])).coef
    effect = bent(k, p, k2, k3)
    assert effect.plausible()
    assert all(low <= value <= high for value, (low, high) in zip(effect.linear_values(), effect.linear_bounds(), strict=True))


@pytest.mark.parametrize("law", [np.ones_like, lambda q: -np.cos(q)])
def test_a_bent_hose_is_no_name_for_a_constant_or_for_a_tilt_about_its_turning_point(law):
    rng, q, hits = np.random.default_rng(0), np.linspace(-0.8, 0.8, 600), 0
    for _ in range(100):
        k3, k2, k, p = np.polyfit(q, 0.3 * law(q) + 0.02 * rng.standard_normal(600), 3)
        hits += bent(k, p, k2, k3).plausible()
    assert hits <= 10


def test_models_of_before_know_the_linear_hose_alone():
    document = {"kind": "effect:umbilical_stiffness", "parameters": {"stiffness": [0.5], "preload": [-0.1]}, "options": {"joint": 1}}
    old = term_of(document)
    assert old == made("umbilical_stiffness", arm(1), 1, stiffness=(0.5,), preload=(-0.1,), quadratic=(), cubic=())
    assert term_of(old.document()) == old


def dragged(area, linear=()):
    return made("tip_drag", arm(1), drag_area=(area,), linear=linear)


def test_a_body_at_the_tip_drags_with_the_square_of_its_speed_and_some_in_proportion_to_it_besides():
    v = np.array([-0.8, 0.1, 0.4, 1.6])
    L = LINKS[0]["length_m"]
    flow = Flow(arm(1), steady(np.zeros((4, 1)), (v / L)[:, None]))
    plain, bent = (effect.torque(flow)[:, 0] for effect in (dragged(0.003), dragged(0.003, (0.5,))))
    assert_close(plain, tensor(0.5 * 1000 * 0.003 * np.abs(v) * v * L))
    assert_close(bent - plain, tensor(0.5 * v * L))
    assert [len(law.linear_names()) for law in (dragged(0.003, (0.5,)), *dragged(0.003, (0.5,)).narrower())] == [2, 1]


def test_drag_at_the_tip_takes_the_power_of_its_force_along_the_way_of_the_tip():
    a, motion = arm(2), hub_at_rest(run(2))
    flow, effect = Flow(a, motion), made("tip_drag", a, drag_area=(0.003,), linear=(0.5,))
    v = torch.hypot(flow.A[:, 1] * flow.L[1] + flow.B[:, 1], flow.u_x[:, 1])
    assert_close((effect.torque(flow) * motion.qd).sum(1), (0.5 * 1000 * 0.003 * v + 0.5) * v**2)


def test_a_law_with_another_power_of_the_speed_is_nearly_that_of_drag_at_the_tip_with_both_parts():
    v = np.linspace(0.05, 1.2, 60)
    law = v**1.85
    flow = Flow(arm(1), steady(np.zeros((60, 1)), (v / LINKS[0]["length_m"])[:, None]))
    X = dragged(0.003, (0.5,)).columns(flow)[:, 0].numpy()
    both, plain = (np.linalg.lstsq(X[:, :k], law, rcond=None)[0] for k in (2, 1))
    assert np.abs(X @ both - law).max() < 0.01 * law.max() < 0.025 * law.max() < np.abs(X[:, :1] @ plain - law).max()
    assert dragged(both[0], (both[1],)).plausible()


@pytest.mark.parametrize(("area", "linear", "makes_sense"), [
    (0.004, (), True), (0.0, (), True), (0.0, (0.1,), False), (0.004, (0.9,), True), (0.004, (1.1,), False), (0.004, (0.0,), True)])
def test_drag_at_the_tip_that_hardly_grows_faster_than_the_speed_is_no_bodys(area, linear, makes_sense):
    """At 0.5 m/s 1/2 rho C_D S |v| is 1 N s/m for 0.004 m^2: as much linear drag makes the power 1.5."""
    assert dragged(area, linear).plausible() == makes_sense


def test_drag_at_the_tip_is_told_with_its_linear_part_where_it_has_one_and_old_models_have_none():
    assert dragged(0.004).statement() == "A body at the tip adds drag: C_D times area is 0.004 m^2."
    assert "plus a linear part of 0.5 N s/m" in dragged(0.004, (0.5,)).statement()
    assert term_of({"kind": "effect:tip_drag", "parameters": {"drag_area": [0.004]}, "options": {"joint": 0}}) == dragged(0.004)


def test_a_ripple_of_any_whole_number_of_teeth_is_tried_as_its_neighbours_hardly_see_it():
    q = np.linspace(-1.5, 1.5, 400)
    angles = Flow(arm(1), steady(q[:, None], np.ones((400, 1))))
    tried = {effect.periods[0]: effect for effect in candidates(REGISTER["torque_ripple"], arm(1))}
    assert set(map(float, range(4, 60))) <= set(tried)
    for teeth in (9, 13, 31, 57):
        tau = np.cos(teeth * q + 1.0)
        for number, seen in ((teeth, True), (teeth - 1, False), (teeth + 1, False)):
            X = tried[number].columns(angles)[:, 0].numpy()
            assert (((tau - X @ np.linalg.lstsq(X, tau, rcond=None)[0]) ** 2).sum() < 0.3 * (tau**2).sum()) == seen


@pytest.mark.parametrize("beyond", [0.0, 0.05])
def test_a_mass_at_the_tip_or_beyond_it_is_a_point_mass_of_the_rigid_body(beyond):
    a = arm(2, gravity_m_s2=9.81)
    m, reach = 0.3, LINKS[1]["length_m"] + beyond
    tau = made("payload_mass", a, mass=(m,), beyond=(beyond,)).torque(Flow(a, states(2)))
    assert_close(tau, RigidBody((0.0, m), (0.0, m * reach), (0.0, m * reach**2)).torque(Flow(a, states(2))))


def test_the_rotor_behind_a_belt_is_felt_by_its_own_motor_alone():
    a = arm(2, drive={"kind": "remote", "pulley_ratio": 1.5})
    motion = run(2)
    for joint in (1, 2):
        at_motors = to_drives(made("rotor_inertia", a, joint, inertia=(0.1,)).torque(Flow(a, motion)), a)
        wanted = torch.zeros_like(at_motors)
        wanted[:, joint - 1] = 0.1 * (motion.qdd[:, 0] + (motion.qdd[:, 1] / 1.5 if joint == 2 else 0))
        assert_close(at_motors, wanted)


def test_drag_at_the_tip_of_a_swinging_link():
    tau = made("tip_drag", arm(1), drag_area=(0.01,), linear=()).torque(Flow(arm(1), steady([[0.3]], [[-2.0]])))
    assert_close(tau, tensor([[-0.5 * 1000 * 0.01 * 4.0 * 0.55**3]]))


def test_drag_at_the_tip_is_the_same_in_any_direction():
    effect, a = made("tip_drag", arm(1), drag_area=(0.01,), linear=()), arm(1)
    q = np.linspace(-3, 3, 9)[:, None]
    tau = effect.torque(Flow(a, steady(q, 0.0, 0.0, 0.8)))[:, 0]
    assert_close(tau, tensor(0.5 * 1000 * 0.01 * 0.64 * 0.55 * np.cos(q[:, 0])))


@pytest.mark.parametrize(("values", "force"), [
    ({"linear": 0.2}, lambda w, s: 0.2 * w), ({"cubic": 0.2}, lambda w, s: 0.2 * w**3), ({"taper": 0.2}, lambda w, s: 0.2 * s * w**2),
    ({"direction": 0.2}, lambda w, s: 0.2 * w**2),
])
def test_other_drag_laws_of_a_swinging_link(values, force):
    effect = made("drag_form", arm(1), **{name: (values.get(name, 0.0),) for name in ("linear", "cubic", "direction", "taper", "ends")})
    x = np.linspace(0, 0.55, 20001)
    tau = np.trapezoid(0.5 * 1000 * 0.07 * force(1.5 * x, 2 * x / 0.55 - 1) * x, x)  # s = -1 at the joint, 1 at the tip
    assert_close(effect.torque(Flow(arm(1), steady([[0.0]], [[1.5]]))), tensor([[tau]]), rtol=0.01)


def test_a_link_not_alike_fore_and_aft_has_one_drag_coefficient_in_each_direction():
    """C_D + d forwards, C_D - d backwards: what differs between the directions loads the joint to the same side in both."""
    a = arm(1)
    differing = replace(made("drag_form", a).narrower()[-1], direction=(0.3,))
    mean = NormalDrag(C_D=(1.1,))
    for rate, coefficient in ((1.5, 1.4), (-1.5, 0.8)):
        flow = Flow(a, steady([[0.0]], [[rate]]))
        assert_close(mean.torque(flow) + differing.torque(flow), NormalDrag(C_D=(coefficient,)).torque(flow), rtol=1e-3)  # 20 strips


def test_a_model_file_from_before_drag_could_differ_by_direction_is_read():
    a = arm(2)
    document = made("drag_form", a, linear=(0.2,)).document()
    del document["parameters"]["direction"]
    flow = Flow(a, run(2))
    assert_close(term_of(document).torque(flow), made("drag_form", a, linear=(0.2,)).torque(flow))


def test_relief_at_the_ends_leaves_an_even_flow_its_torque_and_takes_that_of_a_swing():
    effect = made("drag_form", arm(1), linear=(0.0,), cubic=(0.0,), direction=(0.0,), taper=(0.0,), ends=(-0.4,))
    assert_close(effect.torque(Flow(arm(1), steady([[0.0]], 0.0, 0.0, 0.8))), tensor([[0.0]]), rtol=0, atol=2e-3)
    x = np.linspace(0, 0.55, 20001)
    law = -0.4 * (3 * (2 * x / 0.55 - 1) ** 2 - 1) / 2
    swing = np.trapezoid(0.5 * 1000 * 0.07 * law * (1.5 * x) ** 2 * x, x)
    assert_close(effect.torque(Flow(arm(1), steady([[0.0]], [[1.5]]))), tensor([[swing]]), rtol=0.02)


def test_of_a_link_that_only_swings_taper_and_relief_are_one_torque():
    """int z^3 s dz = 0.15, int z^3 (3 s^2 - 1)/2 dz = 0.05: 1 of the one and -3 of the other cancel, so both may come out large."""
    effect = made("drag_form", arm(1), linear=(0.0,), cubic=(0.0,), direction=(0.0,), taper=(-1.6,), ends=(4.8,))
    part = made("drag_form", arm(1), linear=(0.0,), cubic=(0.0,), direction=(0.0,), taper=(-1.6,), ends=(0.0,))
    swings = Flow(arm(1), steady(np.zeros((9, 1)), np.linspace(-2, 2, 9)[:, None]))
    assert float(effect.torque(swings).abs().max()) < 0.02 * float(part.torque(swings).abs().max())
    within = {f.name: f.metadata["bounds"] for f in type(effect).parameters()}
    assert within["ends"][1] > 4.8


@pytest.mark.parametrize(("frequency", "damping"), [(0.8, 0.08), (3.0, 0.5)])
def test_a_mass_that_swings_obeys_its_equation_of_motion_and_a_stiff_one_moves_with_the_link(frequency, damping):
    t = np.linspace(0, 6, 1201)
    q, w, a = 0.4 * (1 - np.cos(2 * t)), 0.8 * np.sin(2 * t), 1.6 * np.cos(2 * t)
    motion = Motion(*map(tensor, (t, q[:, None], w[:, None], a[:, None], 0 * t, 0 * t)))
    rig, omega = arm(1), 2 * pi * frequency
    length = float(rig.L[0])

    def fall(time, x):
        """y' = s - L w, s' = -omega^2 y - 2 zeta omega y'."""
        slip = x[1] - length * 0.8 * np.sin(2 * time)
        return [slip, -(omega**2) * x[0] - 2 * damping * omega * slip]

    x = solve_ivp(fall, (0, 6), [0.0, 0.0], t_eval=t, rtol=1e-10, atol=1e-12).y
    s = -(omega**2) * x[0] - 2 * damping * omega * (x[1] - length * w)
    swings = made("oscillating_mass", rig, 1, mass=(1.5,), frequency=(frequency,), damping=(damping,))
    assert_close(swings.torque(Flow(rig, motion))[:, 0], tensor(1.5 * length * (s - length * a)), atol=2e-4)
    stiff = made("oscillating_mass", rig, 1, mass=(1.5,), frequency=(50.0,), damping=(0.7,))
    late = slice(200, None)
    assert float(stiff.torque(Flow(rig, motion))[late].abs().max()) < 0.01 * 1.5 * length**2 * 1.6


@pytest.mark.parametrize("place", [0.4, 0.75])
def test_a_mass_that_swings_at_a_place_on_the_link_does_so_at_the_end_of_a_link_that_ends_there(place):
    rig, motion = arm(2), long_run(400, dt=0.01)
    short = rig.model_copy(update={"links": (rig.links[0], rig.links[1].model_copy(update={"length_m": place * rig.L[1]}))})
    law = made("oscillating_mass", rig, 2, mass=(0.8 * place**2,), frequency=(1.3,), damping=(0.1,), place=(place,))
    at_end = made("oscillating_mass", rig, 2, mass=(0.8,), frequency=(1.3,), damping=(0.1,))
    assert_close(law.torque(Flow(rig, motion)), at_end.torque(Flow(short, motion)), rtol=1e-9, atol=1e-12)
    assert law.quantities()["mass"].value == pytest.approx(0.8)


def test_a_mass_that_swings_is_the_same_stepped_through_time_as_over_a_run():
    rig = arm(2)
    t = torch.arange(400, dtype=torch.float64) * 0.01
    motion = long_run(400, dt=0.01)
    law = made("oscillating_mass", rig, 2, mass=(1.0,), frequency=(1.3,), damping=(0.1,))
    whole, carried, stepped = law.torque(Flow(rig, motion)), None, []
    for k in range(len(t)):
        memory = StepMemory(torch.full((1,), 0.01, dtype=torch.float64), carried)
        row = Motion(*(x[k:k + 1] for x in (motion.t, motion.q, motion.qd, motion.qdd, motion.u0, motion.du0)), carried=memory)
        stepped.append(law.torque(Flow(rig, row)))
        carried = memory.after
    assert_close(torch.cat(stepped), whole, atol=1e-9)


def test_a_developing_wake_tells_its_change_from_the_start_to_a_quarter_of_the_reach():
    wake = made("wake_development", arm(1), d0=(-1.5,), d1=(0.2,), d2=(0.1,), m0=(0.7,), m1=(0.0,), m2=(0.1,), reach=(8.0,))
    told = {name: quantity.value for name, quantity in wake.quantities().items()}
    for symbol, start in (("C_D", -1.5), ("C_M", 0.7)):
        assert told[f"{symbol}_change_at_start"] == start
        assert told[f"{symbol}_change"] == pytest.approx(told[f"{symbol}_change_early"] - start)
    raised = replace(wake, d0=(-0.5,), d1=(1.2,), d2=(1.1,)).quantities()["C_D_change"].value
    assert raised == pytest.approx(told["C_D_change"], abs=0.3), "what is added to all of it is no change, but for the last curve"


def test_a_tilted_plane_pulls_as_gravity_would():
    a = arm(2, density=0.0, gravity_m_s2=9.81)
    level = arm(2, density=0.0)
    motion = steady(np.random.default_rng(3).uniform(-3, 3, (20, 2)))
    masses = [link["mass_kg"] for link in LINKS[:2]]
    centred = [m * link["length_m"] / 2 for m, link in zip(masses, LINKS, strict=False)]
    weight = RigidBody(masses, centred, [0.0, 0.0])
    tilt = made("buoyancy_tilt", level, force_X=(0.0, 0.0), force_Y=tuple(-9.81 * m for m in masses))
    assert_close(tilt.torque(Flow(level, motion)), weight.torque(Flow(a, motion)))
    assert tilt.quantities()["direction"].value == pytest.approx(-pi / 2)


def test_the_displaced_water_lifts_each_link_by_its_weight_at_the_links_middle():
    """A link pointing along +X is carried by rho pi/4 D^2 L g L/2; upright it needs none; a level or dry arm has no such law."""
    a = arm(1, gravity_m_s2=9.81)
    lift = made("buoyancy_tilt", a, force_X=(), force_Y=(), lift=(0.8,))
    L, D = LINKS[0]["length_m"], LINKS[0]["diameter_m"]
    moment = 0.8 * 1000.0 * pi / 4 * D**2 * L * 9.81 * L / 2
    assert_close(lift.torque(Flow(a, steady([[0.0], [pi / 2], [1.1]]))), tensor([[-moment], [0.0], [-moment * np.cos(1.1)]]), atol=1e-12)
    assert lift.standard
    assert not made("buoyancy_tilt", a, force_X=(1.0,), force_Y=(0.0,)).standard
    assert lift.acts_on(a)
    assert not lift.acts_on(arm(1))
    assert not lift.acts_on(arm(1, density=0.0, gravity_m_s2=9.81))
    assert "the weight in air alone" in lift.statement()


def test_viscous_friction_may_differ_between_the_directions_and_says_so_only_where_it_does():
    law = made("viscous_friction", arm(2), 2, coefficient=(0.5,), asymmetry=(0.2,))
    motion = steady(np.zeros((2, 2)), [[0.3, 2.0], [0.3, -2.0]])
    assert_close(law.torque(Flow(arm(2), motion)), tensor([[0.0, 1.2], [0.0, -0.8]]))
    assert "forwards it is larger by the share" in law.statement({"coefficient": (0.4, 0.6), "asymmetry": (0.1, 0.3)})
    assert "forwards" not in law.statement({"coefficient": (0.4, 0.6), "asymmetry": (-0.1, 0.5)})
    assert "forwards" not in replace(law, asymmetry=()).statement()


def test_folding_back_changes_the_sheltered_links_drag_alone():
    a = arm(2)
    drag = NormalDrag((0.0, 1.0)).torque
    effect = made("link_interference", a, 2, shelter=(-0.4,), side=(0.0,), power=(1.0,))
    flow = Flow(a, steady([[0.2, pi], [0.2, 0.0], [0.2, pi / 2]], [[0.0, 0.0]] * 3, 0.0, [0.7, 0.7, 0.7]))
    share = tensor([[-0.4], [0.0], [-0.2]])
    assert_close(effect.torque(flow), share * drag(flow), rtol=2e-3, atol=1e-9)


def test_of_a_short_lag_share_times_response_is_known_where_neither_is():
    law = made("flow_memory", arm(1), share=(1.3,), response=(0.005,), travel=(0.0,))
    q = law.quantities()
    assert q["late[1]"] == Quantity(1.3 * 0.005, "s")
    assert q["behind[1]"] == Quantity(0.0, "1")
    assert "0.0065 s" in law.statement()


def test_a_strip_lies_in_the_shadow_exactly_where_its_way_meets_the_neighbour():
    a = arm(2)
    rng = np.random.default_rng(7)
    n = 200
    q, qd = rng.uniform(-3, 3, (n, 2)), rng.uniform(-1, 1, (n, 2))
    u0 = tensor(rng.uniform(-1, 1, n))
    flow = Flow(a, Motion(tensor(np.arange(n) * 0.01), tensor(q), tensor(qd), tensor(0 * q), u0, 0 * u0))
    L, D = np.array([link.length_m for link in a.links]), np.array([link.diameter_m for link in a.links])
    strips = Strips.of(flow, 20)
    shaded, free = [0, 0], [0, 0]
    for link in (0, 1):
        share = shadow(flow, strips, link, 10.0).numpy()
        phi = np.cumsum(q, axis=1)
        e = np.stack([np.cos(phi), np.sin(phi)], axis=2)  # (n, links, 2)
        start = np.stack([np.zeros((n, 2)), L[0] * e[:, 0]], axis=1)
        for k in range(0, n, 10):
            for s in range(0, 20, 3):
                x = float(strips.x[link, s])
                normal = np.array([-e[k, link, 1], e[k, link, 0]])
                v = float(flow.u_x[k, link]) * e[k, link] + float(strips.w[k, link, s]) * normal
                here = start[k, link] + x * e[k, link]
                z = np.linspace(-0.3, 1.3, 321)[:, None] * L[1 - link]
                to = start[k, 1 - link] + z * e[k, 1 - link] - here
                beside = np.abs(to[:, 0] * v[1] - to[:, 1] * v[0]) / np.linalg.norm(v)
                met = (beside < 0.006 * L[1 - link]) & (to @ v > 0)
                within = (z[:, 0] > 0.1 * L[1 - link]) & (z[:, 0] < 0.9 * L[1 - link])
                if not met.any():
                    free[link] += 1
                    assert share[k, s] < 1e-3
                if (met & within).any():
                    shaded[link] += 1
                    assert share[k, s] > 0.0
                    assert share[k, s] == pytest.approx(1 / (1 + np.linalg.norm(to[met & within][0]) / (10 * D[1 - link])), rel=0.35)
    assert min(shaded) >= 5
    assert min(free) >= 5


def test_narrower_laws_of_drag_hold_the_columns_that_the_whole_law_has_for_them():
    a = arm(2)
    flow, whole = Flow(a, run(2)), made("drag_form", a)
    every = dict(zip(whole.linear_names(), whole.columns(flow).unbind(-1), strict=True))
    laws = whole.narrower()
    speed, direction, taper, ends = ({"linear", "cubic"}, *({f"{name}[1]", f"{name}[2]"} for name in ("direction", "taper", "ends")))
    assert [set(law.linear_names()) for law in laws] == [speed | taper | ends, taper | ends, taper, speed | direction, speed, direction]
    for law in laws:
        for name, column in zip(law.linear_names(), law.columns(flow).unbind(-1), strict=True):
            assert_close(column, every[name])
        assert_close(law.with_linear(torch.ones(len(law.linear_names()))).torque(flow), law.columns(flow).sum(-1))
        assert set(law.quantities()) == set(law.linear_names())


def test_the_sentence_of_interference_says_which_link_shelters_which():
    first, second = (made("link_interference", arm(2), joint, shadow=(-0.6,)).statement() for joint in (1, 2))
    assert first.startswith("Link 1 runs into the wake of link 2: there, its C_D changes by ")
    assert second.startswith("Link 2 runs into the wake of link 1: there, its C_D changes by ")
    assert "While link 2 moves towards link 1, " in second
