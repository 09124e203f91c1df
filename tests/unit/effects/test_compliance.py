"""A compliant drive: an oscillator that the drive shakes, in closed form and against integration, where it rings, sags and buckles."""

from dataclasses import replace

import numpy as np
import pytest
from hypotheses import made, steady, view
from rigs import LINKS, arm, assert_close, run
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from nnhydro.effects.compliance import oscillator
from nnhydro.physics.motion import Motion, tensor


@pytest.mark.parametrize("ratio", [0.2, 0.7, 0.95, 1.0, 1.1, 2.0])
@pytest.mark.parametrize("zeta", [0.05, 0.3])
def test_a_compliant_drive_of_a_dry_link_is_an_oscillator_that_the_drive_shakes(ratio, zeta):
    """J q'' seen through a damped spring is J q'' (1 + 2 i zeta r) / (1 - r^2 + 2 i zeta r): below, at and above the resonance."""
    a, t, w = arm(1, density=0.0), np.linspace(0, 80, 8001), 5.0
    q, qd, qdd = (tensor(x)[:, None] for x in (np.cos(w * t), -w * np.sin(w * t), -w**2 * np.cos(w * t)))
    seen = view(a, Motion(tensor(t), q, qd, qdd, 0 * q[:, 0], 0 * q[:, 0]), "rigid")
    J = LINKS[0]["inertia_kg_m2"] + LINKS[0]["mass_kg"] * LINKS[0]["com_m"] ** 2
    read = made("joint_elasticity", a, 1, compliance=(ratio**2 / (J * w**2),), damping=(zeta,)).apply(seen)[:, 0].numpy()
    gain = (1 + 2j * zeta * ratio) / (1 - ratio**2 + 2j * zeta * ratio)
    settled = t > 60
    assert_close(read[settled], (-J * w**2 * (gain * np.exp(1j * w * t)).real)[settled], rtol=0.01, atol=0.01 * J * w**2 * abs(gain))


def test_a_compliant_drive_rings_as_its_equation_of_motion_says_where_the_inertia_changes_with_the_posture():
    """Against the equation of motion of joint 1 alone, integrated by scipy: a folding arm whose drive 1 turns in a tenth of a second."""
    a, t = arm(2, density=0.0), np.linspace(0, 4, 801)
    q1, q2 = 0.6 / (1 + np.exp(-40 * (t - 1))), 0.3 + 1.2 * np.sin(1.5 * t)
    paths = CubicSpline(t, np.stack([q1, q2], 1))
    still = tensor(0 * t)
    seen = view(a, Motion(tensor(t), *(tensor(paths(t, order)) for order in range(3)), still, still), "rigid")
    k, zeta = 200.0, 0.05
    drive = made("joint_elasticity", a, 1, compliance=(1 / k,), damping=(zeta,))
    J, D, S = (CubicSpline(t, seen.by_motion(channel, 1)[:, 0].numpy()) for channel in (2, 1, 0))
    tau, c = CubicSpline(t, seen.tau[:, 0].numpy()), 2 * zeta * np.sqrt(k * np.median(np.abs(J(t))))
    made_by = solve_ivp(lambda at, x: [x[1], (-tau(at) - (D(at) + c) * x[1] - (S(at) + k) * x[0]) / J(at)], (0, 4), [-tau(0) / k, 0.0],
                        t_eval=t, rtol=1e-9, atol=1e-12)
    spring = -(k * made_by.y[0] + c * made_by.y[1])
    read = drive.apply(seen)[:, 0].numpy()
    assert np.abs(read - spring).max() < 0.05 * np.abs(spring).max()
    assert np.abs(seen.tau[:, 0].numpy() - spring).max() > 0.2 * np.abs(spring).max(), "it rings"


@pytest.mark.parametrize("strain", [0.5, 1.0, 1.5])
def test_a_spring_that_stiffens_rings_as_its_cubic_equation_of_motion_says(strain):
    """J delta'' + c delta' + k delta (1 + (delta/delta_2)^2) = -J q'', integrated by scipy; `strain` is the largest twist over delta_2."""
    a, t, k, zeta = arm(1, density=0.0), np.linspace(0, 4, 1601), 60.0, 0.1
    q = 0.4 / (1 + np.exp(-25 * (t - 1))) - 0.5 / (1 + np.exp(-20 * (t - 2.5)))
    path, still = CubicSpline(t, q), tensor(0 * t)
    seen = view(a, Motion(tensor(t), *(tensor(path(t, order))[:, None] for order in range(3)), still, still), "rigid")
    J = LINKS[0]["inertia_kg_m2"] + LINKS[0]["mass_kg"] * LINKS[0]["com_m"] ** 2
    linear = made("joint_elasticity", a, 1, compliance=(1 / k,), hardening=(), damping=(zeta,))
    doubled, c = float(linear._twist(seen)[0].abs().max()) / strain, 2 * zeta * np.sqrt(k * J)
    moved = solve_ivp(lambda at, x: [x[1], -path(at, 2) - (c * x[1] + k * x[0] * (1 + (x[0] / doubled) ** 2)) / J], (0, 4), [0.0, 0.0],
                      t_eval=t, rtol=1e-9, atol=1e-12)
    spring = -(k * moved.y[0] * (1 + (moved.y[0] / doubled) ** 2) + c * moved.y[1])
    read = replace(linear, hardening=(1 / (k**3 * doubled**2),)).apply(seen)[:, 0].numpy()
    assert np.abs(read - spring).max() < 0.05 * np.abs(spring).max()
    assert np.abs(linear.apply(seen)[:, 0].numpy() - spring).max() > 0.1 * np.abs(spring).max()


def test_to_third_order_a_hardening_is_what_the_twist_lacks_per_torque_cubed():
    a = arm(1, density=0.0, gravity_m_s2=9.81)
    seen = view(a, steady([[0.3]]), "rigid")
    weight, c, h = float(seen.tau[0, 0]), 1e-4, 1e-8
    twist = made("joint_elasticity", a, 1, compliance=(c,), hardening=(h,))._twist(seen)[0]
    assert float(twist[0]) == pytest.approx(-c * weight + h * weight**3, rel=1e-2 * h * weight**2 / c + 2e-3)


def test_the_column_of_the_hardening_is_what_it_changes_of_the_reading():
    a = arm(1, density=0.0, gravity_m_s2=9.81)
    seen, c, h = view(a, steady([[0.3], [1.2]]), "rigid"), 1e-5, 1e-10
    soft, stiffening = (made("joint_elasticity", a, 1, compliance=(c,), hardening=(x,)) for x in (0.0, h))
    changed = (stiffening.apply(seen) - soft.apply(seen)) / h
    assert_close(changed, stiffening.columns(seen)[..., 1], rtol=0.02)


def test_a_compliant_drive_that_holds_a_weight_sags_and_does_not_ring():
    a, t, k = arm(1, density=0.0, gravity_m_s2=9.81), np.linspace(0, 4, 401), 200.0
    still = tensor(np.zeros((401, 1)))
    seen = view(a, Motion(tensor(t), still + 0.3, still, still, still[:, 0], still[:, 0]), "rigid")
    read = made("joint_elasticity", a, 1, compliance=(1 / k,), damping=(0.05,)).apply(seen)[:, 0].numpy()
    assert np.ptp(read) < 1e-9 * np.abs(read).max()
    weight = LINKS[0]["mass_kg"] * 9.81 * LINKS[0]["com_m"]
    assert read[0] == pytest.approx(weight * np.cos(0.3 - read[0] / k), rel=0.01), "where it has sagged to"


def test_a_spring_too_soft_for_the_weight_above_it_runs_away_from_no_reading():
    a, t = arm(1, density=0.0, gravity_m_s2=9.81), np.linspace(0, 20, 2001)
    q, qd, qdd = (tensor(x)[:, None] for x in (np.pi / 2 + 0.1 * np.sin(t), 0.1 * np.cos(t), -0.1 * np.sin(t)))  # upright
    seen = view(a, Motion(tensor(t), q, qd, qdd, 0 * q[:, 0], 0 * q[:, 0]), "rigid")
    weight = LINKS[0]["mass_kg"] * 9.81 * LINKS[0]["com_m"]
    read = made("joint_elasticity", a, 1, compliance=(2 / weight,), damping=(0.05,)).apply(seen)
    assert float(read.abs().max()) < 3 * weight


def test_the_drives_from_which_a_search_starts_are_the_same_behind_a_belt():
    motion = run(2)
    direct, belt = (made("joint_elasticity", a, 2, compliance=(1e-3,)).extra_starts(view(a, motion))
                    for a in (arm(2), arm(2, drive={"kind": "remote", "pulley_ratio": 1.5})))
    for one, other in zip(direct, belt, strict=True):
        assert one.compliance == pytest.approx(other.compliance)
    at_rest = view(arm(2), steady([[0.2, 1.0]], [[0.0, 0.0]], 0.0, [0.7]))
    assert made("joint_elasticity", arm(2), 2, compliance=(1e-3,)).extra_starts(at_rest) == ()


@pytest.mark.parametrize("phase", [0.5, 1.5, 2.5])
def test_a_resonance_near_the_sampling_rate_rings_with_its_own_period(phase):
    """Against the same equation integrated by scipy, `phase` radians of the resonance a row: steps of a row would slow it."""
    t = np.arange(400) * 0.01
    k, c = (phase / 0.01) ** 2, 0.02 * phase / 0.01
    load = np.exp(-((t - 0.5) / 0.01) ** 2)
    curve, one = CubicSpline(t, load), np.ones_like(t)
    exact = solve_ivp(lambda at, x: [x[1], curve(at) - c * x[1] - k * x[0]], (0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-15).y[0]
    x, _, _ = oscillator(t, one, c * one, k * one, load)
    near = t < 0.8
    assert np.abs(x - exact)[near].max() < 0.3 * np.abs(exact).max()
