"""The concealed tank against numbers it has never seen, its symmetries, and what each hidden cause must look like."""

import json
from dataclasses import replace
from functools import cache
from itertools import cycle
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from nnhydro.blind_tests.truth import registry
from nnhydro.blind_tests.truth.campaign import Wish, draw_campaign
from nnhydro.blind_tests.truth.flow import STRIPS, frames_of, rigid_torque, water_torque
from nnhydro.blind_tests.truth.hidden_friction import bristle, direction
from nnhydro.blind_tests.truth.hidden_mount import hub_force
from nnhydro.blind_tests.truth.hidden_transmission import play, stiff_twist
from nnhydro.blind_tests.truth.memory import follow, since_reversal
from nnhydro.blind_tests.truth.motions import Plan, carry_out
from nnhydro.blind_tests.truth.sensors import TrueSensors
from nnhydro.blind_tests.truth.tank import brisk_torque, joint_torque, motor_torque, plain_torque, read
from nnhydro.blind_tests.truth.visibility import FACTORS, reference
from nnhydro.blind_tests.truth.world import TrueArm, TrueLink, TrueRun

GOLDEN = Path(__file__).parents[1] / "golden"
STRIP_SUM = 2e-4  # 60 midpoint strips against the integral, relative to the larger of the torque and 1 N m; second order
ARM = TrueArm((TrueLink(0.5, 0.06, 2.0, 0.24, 0.05, 1.0, 0.9), TrueLink(0.4, 0.05, 1.1, 0.19, 0.02, 1.1, 0.8)))


def instant(state):
    q, qd, qdd = (np.array([[state[f"{d}theta1"], state[f"{d}theta2"]]]) for d in ("", "d", "dd"))
    return TrueRun("golden", np.zeros(1), q, qd, qdd, np.array([state["u0"]]), np.array([state["du0"]]))


def motion(kind="fourier", speed=0.0, seed=4, folded=False, seconds=8.0, start=9 * 3600.0):
    return carry_out(Plan(kind, speed, folded, seconds, seed), 2, 200.0, "run", start, seed)


def draft(name, seed=0, **wanted):
    """The first draft of `name` whose cause has the wanted attributes (shape, joint) at amount `low`."""
    for k in range(seed, seed + 60):
        made = registry.makers()[name](np.random.default_rng(k), ARM)
        cause = made.make(made.low)
        if all(getattr(cause, key) == value for key, value in wanted.items()):
            return made
    raise AssertionError(f"no {name} with {wanted}")


def extra(cause, run, arm=ARM):
    """What the torque sensors read more with the cause than without."""
    return read(run, arm, [cause]).tau - read(run, arm).tau


@pytest.mark.parametrize(("name", "C_D", "C_M"), [("drag", 1, 0), ("inertia", 0, 1)])
def test_constant_coefficients_give_the_golden_torques(name, C_D, C_M):
    file = json.loads((GOLDEN / f"{name}.json").read_text())
    par = file["parameters"]
    links = tuple(TrueLink(par[f"L{i}"], par[f"D{i}"], 1.0, 0.1, 0.1, par.get(f"C_Dy{i}", 0.0) * C_D, par.get(f"C_My{i}", 0.0) * C_M)
                  for i in (1, 2))
    for case in file["random_cases"] + file["edge_cases"]:
        torque = water_torque(instant(case["state"]), TrueArm(links, par["rho"]), strips=4 * STRIPS)[0]
        pinned = case["document"] if C_M else case
        axial = pinned["links"][1]["f_x" if C_M else "f_x_total"] * par["L1"] * np.sin(case["state"]["theta2"])  # not in a healthy arm
        wanted = np.array(pinned["tau_joint"]) - [axial, 0.0]
        assert np.abs(torque - wanted).max() < STRIP_SUM / 8 * max(1.0, np.abs(wanted).max()), case["state"]


def test_newton_and_euler_give_the_golden_rigid_body_torques():
    file = json.loads((GOLDEN / "rigid_body.json").read_text())
    par, inertia = file["parameters"], file["derived"]
    arm = TrueArm(tuple(TrueLink(par[f"L{i}"], par[f"D{i}"], par[f"m{i}"], par[f"Lc{i}"], inertia[f"I{i}_centroid_transverse"])
                        for i in (1, 2)))
    for case in file["random_cases"] + file["edge_cases"]:
        tau = rigid_torque(instant(case["state"]), arm)
        np.testing.assert_allclose(tau[0], case["tau_joint"], rtol=1e-12, atol=1e-12)
        motors = motor_torque(tau, replace(arm, belt=True))[0]
        np.testing.assert_allclose(motors, case["base_motor_torque_belt_1to1"], rtol=1e-12, atol=1e-12)


def test_steady_tows_give_the_golden_matrix():
    file = json.loads((GOLDEN / "tow_matrix.json").read_text())
    par = file["parameters"]
    arm = TrueArm(tuple(TrueLink(par[f"L{i}"], par[f"D{i}"], 1.0, 0.1, 0.1, par[f"C_Dy{i}"], 0.0) for i in (1, 2)), par["rho"])
    rows = np.array([row for row in file["rows"] if row[1] in (0, 180, -180)])  # stretched: no axial load at joint 1
    still = np.zeros((len(rows), 2))
    run = TrueRun("tow", np.arange(float(len(rows))), np.radians(rows[:, :2]), still, still, rows[:, 2], 0 * rows[:, 2])
    np.testing.assert_allclose(water_torque(run, arm), rows[:, 3:5], atol=STRIP_SUM * np.abs(rows[:, 3]).max())


@pytest.mark.slow
def test_the_strip_sum_converges_at_second_order():
    run = motion("bang", 0.4)
    exact = water_torque(run, ARM, strips=16 * STRIPS)
    errors = [np.abs(water_torque(run, ARM, strips=STRIPS * k) - exact).mean() for k in (1, 2)]
    assert 3.3 < errors[0] / errors[1] < 4.7


def test_the_motion_is_the_integral_of_its_own_derivatives():
    for kind in ("bang", "jerk", "fourier", "slow"):
        run = motion(kind, 0.5)
        inner = slice(2, -2)
        np.testing.assert_allclose(np.gradient(run.q, run.dt, axis=0)[inner], run.qd[inner], atol=0.01)
        np.testing.assert_allclose(np.gradient(run.qd, run.dt, axis=0)[inner], run.qdd[inner], atol=2.5)  # a ramp of 60 ms turns 12 steps
        assert not run.qd[0].any()
        assert run.u0[0] == 0.0


def test_water_at_rest_only_takes_energy_by_drag():
    arm = replace(ARM, links=tuple(replace(k, C_M=0.0) for k in ARM.links))
    run = motion("fourier")
    assert (np.sum(water_torque(run, arm) * run.qd, axis=1) >= -1e-12).all()


@pytest.mark.parametrize(("quick", "left"), [(40.0, -1.0), (0.02, 0.0)])
def test_a_mass_that_swings_stays_behind_quick_motions_and_goes_with_slow_ones(quick, left):
    """Its inertia m L^2 is taken off the joint where the link moves far quicker than it swings; where far slower, nothing changes."""
    cause = draft("oscillating_mass", joint=2).make(0.3)
    omega = quick * 2 * np.pi * cause.parameters["frequency"][0]
    t = np.linspace(0, 6 * 2 * np.pi / omega, 6001)
    still, a = np.zeros_like(t), 0.1 * np.sin(omega * t)
    both = [np.column_stack([still, x]) for x in (a, 0.1 * omega * np.cos(omega * t), -(omega**2) * a)]
    more = cause.load(TrueRun("swing", t, *both, still, still), np.zeros((len(t), 2)))
    inertia = 0.3 * ARM.links[1].length ** 2 * both[2][:, 1]
    np.testing.assert_allclose(more[1000:, 1], left * inertia[1000:], atol=0.05 * np.abs(inertia).max())


def mirrored(run):
    q = np.column_stack([np.pi - run.q[:, 0], *-run.q[:, 1:].T])
    return replace(run, q=q, qd=-run.qd, qdd=-run.qdd)


SYMMETRIC = ("wake_development", "flow_memory", "wake_reentry", "history_force", "reynolds_drag", "axial_drag", "tip_drag", "drag_form",
             "added_mass", "rotor_inertia", "payload_mass", "link_interference", "coulomb_friction", "viscous_friction", "load_friction",
             "stribeck_friction", "joint_elasticity", "backlash", "torque_gain", "torque_crosstalk", "torque_saturation", "sensor_timing")


@pytest.mark.parametrize("name", ["healthy", *SYMMETRIC])
def test_the_mirrored_motion_gives_the_mirrored_torque(name):
    run = motion("fourier", 0.3)
    causes = [] if name == "healthy" else [draft(name).make(0.1 if name != "torque_saturation" else 5.0)]
    torque, other = read(run, ARM, causes).tau, read(mirrored(run), ARM, causes).tau
    np.testing.assert_allclose(other, -torque, atol=1e-9)


@pytest.mark.parametrize("name", ["ambient_current", "buoyancy_tilt", "umbilical_stiffness", "torque_bias", "wall_proximity"])
def test_what_knows_a_direction_breaks_the_mirror(name):
    run, cause = motion("fourier", 0.3), draft(name).make(0.2)
    assert np.abs(read(run, ARM, [cause]).tau + read(mirrored(run), ARM, [cause]).tau).max() > 1e-3


@pytest.mark.parametrize("name", ["coulomb_friction", "viscous_friction", "stribeck_friction", "load_friction"])
@pytest.mark.parametrize("shape", ["plain", "other"])
def test_friction_takes_energy_and_acts_at_its_joint_alone(name, shape):
    run, cause = motion(), draft(name, shape=shape, joint=2).make(0.2)
    torque = extra(cause, run)
    assert not torque[:, 0].any()
    power = torque[:, 1] * run.qd[:, 1]
    assert power.sum() > 0
    if (name, shape) != ("coulomb_friction", "other"):  # a bristle gives a little back
        assert power.min() >= -1e-12


def test_dry_friction_knows_the_sign_of_the_rate_alone():
    run, cause = motion(), draft("coulomb_friction", shape="plain", joint=1).make(0.2)
    moving = np.abs(run.qd[:, 0]) > 1e-3
    np.testing.assert_allclose(extra(cause, run)[moving, 0], 0.2 * np.sign(run.qd[moving, 0]))
    assert direction(np.array([0.0, 0.5, 0.0, -1.0, 0.0])).tolist() == [0.0, 1.0, 0.5, -1.0, -0.5]


def test_a_bristle_turns_within_its_own_length_and_keeps_its_force_at_rest():
    v = np.concatenate([np.full(500, 0.5), np.zeros(100), np.full(500, -0.5)])
    z = bristle(v, 0.001, 0.01)
    assert z[499] == pytest.approx(1.0)
    assert z[598] == pytest.approx(z[502])
    assert z[-1] == pytest.approx(-1.0)


def test_a_bias_is_constant_and_a_drift_moves_over_the_campaign():
    run = motion()
    bias = extra(draft("torque_bias", joint=2).make(0.3), run)
    np.testing.assert_allclose(np.abs(bias[:, 1]), 0.3)
    warming = draft("torque_drift", joint=1, shape="plain").make(0.3)
    early, late = (np.abs(extra(warming, replace(run, start=9 * 3600.0 + s))[:, 0]) for s in (0.0, 5000.0))
    assert early.max() < 0.01
    assert 0.25 < late.min() < late.max() < 0.3


def test_saturation_only_clips():
    run = motion("bang")
    tau = read(run, ARM).tau[:, 0]
    cause = draft("torque_saturation", joint=1, shape="plain").make(3.0)
    level = cause.parameters["level"][0]
    assert level < np.abs(tau).max()
    np.testing.assert_allclose(read(run, ARM, [cause]).tau[:, 0], tau.clip(-level, level))


def test_what_acts_in_a_part_is_read_there_as_if_it_always_acted_and_elsewhere_as_if_it_never_did():
    run = motion()
    rubs, offset = draft("coulomb_friction", joint=2).make(0.5), draft("encoder_offset", joint=1, shape="plain").make(0.1)
    other, share = draft("torque_crosstalk", joint=2).make(0.1), np.clip(run.t - 3.0, 0.0, 1.0)
    for cause in (rubs, offset):
        with_it, without, local = (read(run, ARM, causes) for causes in (
            [cause, other], [other], [replace(cause, share=lambda run: share), other]))
        for name in ("q", "qd", "tau"):
            one, none, told = (getattr(reading, name) for reading in (with_it, without, local))
            np.testing.assert_array_equal(told[share == 1], one[share == 1])
            np.testing.assert_array_equal(told[share == 0], none[share == 0])
        assert np.abs(with_it.tau - without.tau).max() + np.abs(with_it.q - without.q).max() > 0.01


def test_a_delay_shifts_both_channels_and_a_lag_keeps_the_area():
    run = motion()
    tau, late = read(run, ARM).tau, read(run, ARM, [draft("sensor_timing", shape="plain").make(4 * run.dt)]).tau
    np.testing.assert_allclose(late[4:], tau[:-4], atol=1e-9)
    step = follow(np.where(np.arange(2000) >= 100, 1.0, 0.0), 0.001, 0.05)
    assert step[150] == pytest.approx(1 - np.exp(-1), abs=0.01)


def test_gain_and_crosstalk_are_shares_of_the_torque():
    run = motion()
    tau = read(run, ARM).tau
    gain, leak = draft("torque_gain", joint=1, shape="plain").make(0.1), draft("torque_crosstalk", joint=2).make(0.1)
    np.testing.assert_allclose(read(run, ARM, [gain]).tau[:, 0], tau[:, 0] * gain.parameters["gain"][0])
    np.testing.assert_allclose(extra(leak, run)[:, 1], leak.parameters["leak"][0] * tau[:, 0])


def test_an_encoder_offset_leaves_the_torque_and_moves_the_angle():
    run, cause = motion(), draft("encoder_offset", joint=2, shape="plain").make(0.1)
    seen = read(run, ARM, [cause])
    np.testing.assert_allclose(np.abs(seen.q[:, 1] - run.q[:, 1]), 0.1)
    np.testing.assert_allclose(seen.tau, read(run, ARM).tau)


def test_a_soft_drive_runs_ahead_of_the_link_by_torque_over_stiffness():
    run = motion("slow")
    cause = draft("joint_elasticity", joint=1, shape="plain").make(0.01)
    seen, tau = read(run, ARM, [cause]), plain_torque(run, ARM)
    settles = 0.03 * 0.01 * np.abs(tau[:, 0]).max()  # within 12 ms, while the torque goes on changing
    np.testing.assert_allclose(seen.q[:, 0] - run.q[:, 0], 0.01 * tau[:, 0], atol=settles)
    assert not (seen.q[:, 1] - run.q[:, 1]).any()


def test_play_is_half_a_gap_to_the_side_that_carries():
    tau = np.concatenate([np.full(400, 1.0), np.full(400, -1.0)])
    delta = play(tau, 0.002, 0.04, 500.0, 2.0)
    assert delta[399] == pytest.approx(0.02 + 1 / 500, rel=0.02)
    assert delta[-1] == pytest.approx(-delta[399], rel=0.02)
    assert np.diff(delta).max() < 0.04


def test_ripple_is_periodic_in_the_angle_and_a_hose_knows_the_angle_alone():
    run = motion()
    ripple = draft("torque_ripple", joint=1, shape="plain").make(0.2)
    turned = replace(run, q=run.q + np.array([2 * np.pi / ripple.parameters["per_turn"][0], 0.0]))
    np.testing.assert_allclose(extra(ripple, run), extra(ripple, turned), atol=1e-9)
    hose = draft("umbilical_stiffness", joint=2).make(0.3)
    faster = replace(run, qd=2 * run.qd, qdd=4 * run.qdd)
    np.testing.assert_allclose(extra(hose, run), extra(hose, faster), atol=1e-9)


def test_a_rotor_feels_its_own_joint_and_a_payload_is_a_heavier_tip():
    run = motion()
    np.testing.assert_allclose(extra(draft("rotor_inertia", joint=2).make(0.1), run)[:, 1], 0.1 * run.qdd[:, 1], atol=1e-12)
    tip = TrueLink(ARM.links[1].length, 0.05, 1.1 + 0.5, (1.1 * 0.19 + 0.5 * 0.4) / 1.6, 0.02 + 1.1 * 0.5 / 1.6 * 0.21**2)
    heavier = rigid_torque(run, replace(ARM, links=(ARM.links[0], tip))) - rigid_torque(run, ARM)
    np.testing.assert_allclose(extra(draft("payload_mass", shape="plain").make(0.5), run), heavier, atol=1e-9)


def test_a_current_along_the_tow_is_a_slower_tow():
    run = replace(motion("fourier"), u0=np.full(1600, 0.5))
    with_the_tow = SimpleNamespace(uniform=lambda low, high: np.pi / 2, random=lambda: 0.9)
    cause = registry.makers()["ambient_current"](with_the_tow, ARM).make(0.2)
    np.testing.assert_allclose(water_torque(run, ARM, [cause.water]), water_torque(replace(run, u0=run.u0 - 0.2), ARM), atol=1e-9)


def test_a_drive_that_stiffens_gives_way_as_its_cubic_says():
    delta = np.linspace(-0.3, 0.3, 61)
    y = stiff_twist(delta, 0.02)
    np.testing.assert_allclose(y + y**3 / 0.02**2, delta, rtol=1e-12, atol=1e-15)


@cache
def healthy_run():
    """A motion and the torque that the healthy arm takes for it."""
    run = motion("fourier")
    return run, plain_torque(run, ARM)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", sorted(registry.makers()))
def test_no_cause_knows_the_torque_that_is_still_to_come(name, seed):
    """A drive has one stiffness and a sensor one scale: neither is set by the largest torque of the run it is in."""
    drafted, (run, tau) = draft(name, 7 * seed), healthy_run()
    cause, half, later = drafted.make(drafted.high), len(run.t) // 2, tau.copy()
    later[3 * half // 2:] *= 5
    for law in (cause.load, cause.drive, cause.sense, cause.angle):
        if law is not None:
            np.testing.assert_allclose(law(run, later)[:half], law(run, tau)[:half], rtol=1e-9, atol=1e-12)


def test_a_wave_and_a_street_have_the_phase_of_their_run():
    run = motion("fourier", 0.5)
    for name in ("wave_orbital", "vortex_shedding"):
        cause = draft(name).make(0.1)
        assert cause.chance
        one, other = extra(cause, run), extra(cause, replace(run, seed=run.seed + 1))
        np.testing.assert_allclose(extra(cause, run), one)
        assert np.abs(one - other).max() > 0.1 * np.abs(one).max()


@pytest.mark.parametrize("shape", ["plain", "other"])
def test_a_link_that_is_held_in_a_wave_takes_morison_s_load_at_the_places_it_is_towed_through(shape):
    link = TrueLink(0.6, 0.06, 2.0, 0.3, 0.05, C_D=1.2, C_M=0.9)
    arm, t, q = TrueArm((link,)), np.arange(300) * 0.01, 0.7
    still, tow = np.zeros((len(t), 1)), 0.2
    run = TrueRun("wave", t, still + q, still, still, np.full(len(t), tow), 0 * t, seed=5)
    cause = next(c for c in (registry.makers()["wave_orbital"](np.random.default_rng(k), arm).make(0.15) for k in range(60))
                 if c.shape == shape)
    (a, _), (f, _), (angle, _) = (cause.parameters[key] for key in ("speed", "frequency", "direction"))
    omega, ahead = 2 * np.pi * f, np.array([np.cos(angle), np.sin(angle)])
    phase = np.random.default_rng([run.seed, 13]).uniform(0, 2 * np.pi)
    axis, normal = np.array([np.cos(q), np.sin(q)]), np.array([-np.sin(q), np.cos(q)])
    x = (np.arange(4000) + 0.5) * link.length / 4000
    place = x[:, None] * axis + np.stack([0 * t, tow * t], axis=-1)[:, None]  # (n, s, 2)

    def water(later):  # along the normal, at fixed places; a crest passes them towards `ahead`
        run_up = omega**2 / 9.81 * (place @ ahead) - omega * (t + later)[:, None] + phase
        return a * (np.cos(run_up) + (0.25 if shape == "other" else 0.0) * np.cos(2 * run_up)) * (ahead @ normal)

    w, rate = tow * normal[1] - water(0.0), (water(1e-4) - water(-1e-4)) / 2e-4
    load = 0.5 * arm.rho * link.C_D * link.diameter * np.abs(w) * w - arm.rho * np.pi * link.diameter**2 / 4 * (1 + link.C_M) * rate
    wanted = (x * load).sum(axis=1) * link.length / len(x)
    np.testing.assert_allclose(water_torque(run, arm, [cause.water], strips=4000)[:, 0], wanted, atol=1e-5 * np.abs(wanted).max())


def test_a_drive_is_measured_by_the_closed_form_torque_of_a_brisk_swing():
    link = ARM.links[0]
    square = 0.5 * ARM.rho * link.C_D * link.diameter * 1.5**2 * link.length**4 / 4
    inertia = link.inertia + link.mass * link.com**2 + ARM.rho * np.pi * link.diameter**2 / 4 * link.C_M * link.length**3 / 3
    assert brisk_torque(TrueArm((link,)), 1) == pytest.approx(square + 3.0 * inertia, rel=STRIP_SUM)


def test_travel_counts_from_the_last_reversal():
    w = np.array([[1.0], [1.0], [-1.0], [-1.0], [0.0], [-1.0], [2.0]])
    assert since_reversal(w, 1.0)[:, 0].tolist() == [1.0, 2.0, 0.0, 1.0, 1.0, 2.0, 0.0]


def test_a_young_wake_drags_less_and_an_old_one_as_before():
    t = np.arange(2000) * 0.01
    still = np.zeros((len(t), 2))
    run = TrueRun("tow", t, still, still, still, np.full(len(t), 0.5), 0 * t)
    torque = water_torque(run, ARM, [draft("wake_development", shape="plain").make(0.6).water])
    steady = water_torque(run, replace(ARM, links=tuple(replace(k, C_M=0.0) for k in ARM.links)))
    assert torque[3, 0] < 0.6 * steady[3, 0]
    np.testing.assert_allclose(torque[-1], steady[-1], rtol=1e-3)


def test_the_shielded_link_loses_drag_in_tow_only_where_the_other_is_ahead():
    t, n = np.arange(10) * 0.01, 10
    still = np.zeros((n, 2))
    folded = np.tile([0.0, 3.0], (n, 1))  # link 2 back along link 1, on its +Y or -Y side
    cause = draft("link_interference", joint=2).make(0.8)
    tau = []
    for side in (1.0, -1.0):
        run = TrueRun("tow", t, folded * np.array([1.0, side]), still, still, np.full(n, 0.5), 0 * t)
        tau.append(np.abs(water_torque(run, ARM, [cause.water])[0, 1] / water_torque(run, ARM)[0, 1]))
    assert min(tau) < 0.8
    assert max(tau) == pytest.approx(1.0, abs=0.02)


def test_lambda_grows_with_the_size_and_a_change_of_c_d_has_none():
    sensors = TrueSensors(100.0, "all", "white", 0.01, 0.0, 1e-5, False)
    runs = (motion("fourier", 0.3), motion("bang", 0.0, 5), motion("slow", 0.0, 6))
    measure = reference(runs, ARM, 0.02, sensors, np.array([0.02, 0.01]))
    made = draft("viscous_friction", shape="plain")
    small, large = (measure.size([made.make(a)]) for a in (0.05, 0.1))
    assert large == pytest.approx(2 * small, rel=1e-6)
    rougher = replace(ARM, links=(replace(ARM.links[0], C_D=1.2), ARM.links[1]))
    more_drag = [water_torque(run, rougher) - water_torque(run, ARM) for run in runs]
    x = measure.weigh(more_drag)
    left = x - measure.basis @ (measure.basis.T @ x)
    assert np.linalg.norm(left) < 0.02 * np.linalg.norm(x)  # the columns have half the strips


def test_causes_on_the_joint_leave_the_water_alone():
    run = motion()
    cause = draft("viscous_friction").make(0.1)
    plain = plain_torque(run, ARM)
    np.testing.assert_allclose(joint_torque(run, ARM, [cause], plain), joint_torque(run, ARM, [cause]))


@pytest.mark.usefixtures("no_rivals")
@pytest.mark.slow(seconds=1)
@pytest.mark.parametrize(("name", "strength"), list(zip(registry.names(), cycle(["strong", "weak"]), strict=False)))
def test_every_effect_reaches_the_strength_asked_for(name, strength):
    made = draw_campaign(21, 0, Wish(name, strength, None if name in registry.names("", 1) else 2, 1, "small"))
    (entry,) = made.answer["effects"]
    low, high = FACTORS[strength]
    assert entry["effect"] == name
    assert 0.7 * low <= entry["over_limit"] <= 1.4 * high
    for file, columns in made.files.items():
        assert all(np.isfinite(x).all() for x in columns.values()), file


@pytest.mark.usefixtures("no_rivals")
@pytest.mark.slow(seconds=1)
@pytest.mark.parametrize("effects", [2, 3])
def test_several_effects_are_each_visible_beside_the_others(effects):
    made = draw_campaign(5, 1, Wish("random", "strong", 2, effects, "small"))
    entries = made.answer["effects"]
    assert len({entry["effect"] for entry in entries}) == effects
    assert min(entry["over_limit"] for entry in entries) >= 0.7 * FACTORS["strong"][0]


@pytest.mark.slow
def test_dry_friction_is_nearest_to_the_other_frictions_and_the_answer_says_how_near():
    made = draw_campaign(8, 0, Wish("coulomb_friction", "strong", 2, 1, "small"))
    (entry,) = made.answer["effects"]
    assert min(entry["rivals"], key=entry["rivals"].get) in ("viscous_friction", "stribeck_friction", "load_friction")
    assert 0 < min(entry["rivals"].values()) < max(entry["rivals"].values()) <= entry["lambda"] + 0.1


def test_a_mount_shaken_far_above_its_frequency_moves_as_a_free_mass_and_leaves_the_carriage():
    """There M y'' = -F - (M - m) du0: the push of the arm, and the inertia of the mount alone as the carriage shakes."""
    cause = draft("flexible_mount").make(0.05)
    omega = 40 * 2 * np.pi * cause.parameters["frequency"][0]
    t = np.linspace(0, 6 * 2 * np.pi / omega, 6001)
    still, none = np.zeros_like(t), np.zeros((len(t), 2))
    for turned, towed in ((1e-3, 0.0), (0.0, 1e-4)):
        wave = [np.sin(omega * t), omega * np.cos(omega * t), -(omega**2) * np.sin(omega * t)]
        both = [np.column_stack([turned * x, still]) for x in wave]
        run = TrueRun("quick", t, *both, towed * wave[1], towed * wave[2])
        freely = -0.05 * hub_force(run, ARM)[:, 1] - (1 - 0.05 * sum(link.mass for link in ARM.links)) * run.du0
        more = cause.load(run, none)
        expected = plain_torque(replace(run, du0=run.du0 + freely), ARM) - plain_torque(run, ARM)
        np.testing.assert_allclose(more[1000:], expected[1000:], atol=0.12 * np.abs(expected).max())


def test_the_force_that_the_hub_supplies_moves_the_centre_of_mass_of_a_dry_arm():
    dry = replace(ARM, rho=0.0)
    run = motion("fourier", 0.5)
    frames = frames_of(run, dry)
    place = sum(link.mass * (frames.P[:, i] + link.com * frames.e[:, i]) for i, link in enumerate(dry.links))
    twice = np.gradient(np.gradient(place, run.dt, axis=0), run.dt, axis=0)
    inner = slice(5, -5)
    np.testing.assert_allclose(hub_force(run, dry)[inner], twice[inner], atol=0.02 * np.abs(twice).max())
