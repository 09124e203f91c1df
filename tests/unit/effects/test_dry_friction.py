"""Dry friction, with load or without: levels, presliding, grip that is lost with speed, and steps in proportion to the rate."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypotheses import made, steady, view
from rigs import arm, assert_close, hub_at_rest, run

from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor


def test_dry_friction_has_its_level_at_a_hundredth_of_a_radian_a_second():
    grips = {"sliding": (0.1,), "excess": (0.1,), "speed": (3.0,)}
    for name, values in (("coulomb_friction", {"level": (0.2,)}), ("stribeck_friction", grips)):
        tau = made(name, arm(1), 1, **values).torque(Flow(arm(1), steady([[0.0]] * 2, [[0.01], [-0.01]])))[:, 0]
        assert_close(tau, tensor([0.2, -0.2]), rtol=0.04)


def swept(rows=6000, step=0.002):
    """One joint that swings with several reversals and pauses: the flow and its velocity (n,) rad/s."""
    t = np.arange(rows) * step
    qd = 0.8 * np.sin(2 * np.pi * 0.5 * t) * np.cos(2 * np.pi * 0.11 * t) * (np.sin(2 * np.pi * 0.2 * t) > -0.8)
    q, qdd, still = np.cumsum(qd)[:, None] * step, np.gradient(qd, step)[:, None], np.zeros(rows)
    return Flow(arm(1), Motion(*(tensor(x) for x in (t, q, qd[:, None], qdd, still, still)))), qd


def test_stribeck_friction_breaks_away_high_and_slides_low():
    effect = made("stribeck_friction", arm(1), 1, sliding=(0.2,), excess=(0.3,), speed=(0.3,))
    tau = effect.torque(Flow(arm(1), steady([[0.0]] * 3, [[0.06], [3.0], [0.3]])))[:, 0]
    assert_close(tau, tensor([0.2 + 0.3 * np.exp(-0.04), 0.2, 0.2 + 0.3 / np.e]) * torch.tanh(tensor([12.0, 600.0, 60.0])))


@pytest.mark.parametrize("peak", [1.2, 2.4])
def test_the_breakaway_of_a_joint_that_grips_as_sharply_as_it_turns_is_told(peak):
    t = np.arange(4000) * 0.005
    qd = peak * np.sin(2 * np.pi * 0.35 * t) * np.cos(2 * np.pi * 0.06 * t)
    tau, effect = (0.2 + 0.3 / (1 + (qd / 0.15) ** 2)) * np.sign(qd), made("stribeck_friction", arm(1), 1, tail=(1.0,))
    fits = []
    for speed in np.linspace(0.05, 0.3, 51):
        X = replace(effect, speed=(speed,)).columns(Flow(arm(1), steady(np.zeros((4000, 1)), qd[:, None])))[:, 0].numpy()
        values = np.linalg.lstsq(X, tau, rcond=None)[0]
        fits.append((((tau - X @ values) ** 2).sum(), speed, values.sum()))
    _, speed, breakaway = min(fits)
    assert speed == pytest.approx(0.15, rel=0.1)
    assert breakaway == pytest.approx(0.5, rel=0.06)


@pytest.mark.parametrize(("tail", "grip"), [((), lambda x: np.exp(-(x**2))), ((0.0,), lambda x: np.exp(-(x**2))),
                                            ((1e-6,), lambda x: np.exp(-(x**2))), ((0.5,), lambda x: (1 + x**2 / 2) ** -2),
                                            ((1.0,), lambda x: 1 / (1 + x**2))])
def test_a_grip_is_lost_as_Gauss_or_Lorentz_say_or_between_them(tail, grip):
    effect = made("stribeck_friction", arm(1), 1, sliding=(0.2,), excess=(0.3,), speed=(0.4,), tail=tail)
    qd = np.array([0.2, -0.4, 1.0, 2.0])
    tau = effect.torque(Flow(arm(1), steady([[0.0]] * 4, qd[:, None])))[:, 0]
    assert_close(tau, tensor((0.2 + 0.3 * grip(np.abs(qd) / 0.4)) * np.tanh(qd / 0.005)), rtol=1e-5)


@pytest.mark.parametrize("level", [(), (0.3,)])
def test_friction_under_load_is_a_level_and_a_share_of_the_torque_carried(level):
    a, motion = arm(1), hub_at_rest(run(1))
    seen = view(a, motion)
    extra = made("load_friction", a, 1, coefficient=(0.1,), level=level).apply(seen) - seen.tau
    assert_close(extra, 0.1 * seen.tau.abs() * torch.tanh(motion.qd / 0.02) + sum(level) * torch.tanh(motion.qd / 0.005))


def test_friction_under_load_sets_in_as_the_contact_bends():
    flow, _ = swept(rows=2000)
    seen = view(arm(1), flow.motion)
    law = made("load_friction", arm(1), 1, coefficient=(0.2,), level=(0.3,), bending=(0.02,))
    z = made("coulomb_friction", arm(1), 1, level=(1.0,), bending=(0.02,)).torque(flow)
    assert_close(law.apply(seen) - seen.tau, (0.3 + 0.2 * seen.tau.abs()) * z, atol=1e-9)
    assert law.statement().endswith("The friction reaches its level 0.02 rad after a reversal (presliding).")
