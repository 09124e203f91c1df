"""What the dry frictions share: a contact that bends before it slips, and a step as wide as the joint is fast."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypotheses import made, view
from rigs import arm, assert_close

from nnhydro.effects.catalogue import candidates
from nnhydro.effects.effect import REGISTER
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor


@pytest.mark.parametrize("name", ["coulomb_friction", "stribeck_friction", "load_friction"])
def test_dry_friction_of_a_joint_ten_times_as_slow_is_the_same_law_of_a_tenth_of_the_rate(name):
    a, qd = arm(1), torch.linspace(-0.002, 0.002, 41, dtype=torch.float64)[:, None]

    def columns(pace):
        """The columns at rates that are `pace` times as fast, of the law for joints as fast as that."""
        law = candidates(REGISTER[name], a, (5.0,), (0.1 * pace,))[0]
        flow = Flow(a, Motion(*(torch.zeros(41, 1, dtype=torch.float64) if x is None else x for x in (
            torch.arange(41, dtype=torch.float64), None, pace * qd, None)), torch.zeros(41), torch.zeros(41)))
        return (law.columns(flow) if name != "load_friction" else law.columns(view(a, flow.motion))[..., 1:])

    assert_close(columns(0.1), columns(1.0))
    assert float((columns(0.1) - columns(1e3)).abs().max()) > 0.1, "beyond a tenth of a radian a second the step is as wide at any rate"


def swept(rows=6000, step=0.002):
    """One joint that swings with several reversals and pauses: the flow and its velocity (n,) rad/s."""
    t = np.arange(rows) * step
    qd = 0.8 * np.sin(2 * np.pi * 0.5 * t) * np.cos(2 * np.pi * 0.11 * t) * (np.sin(2 * np.pi * 0.2 * t) > -0.8)
    q, qdd, still = np.cumsum(qd)[:, None] * step, np.gradient(qd, step)[:, None], np.zeros(rows)
    return Flow(arm(1), Motion(*(tensor(x) for x in (t, q, qd[:, None], qdd, still, still)))), qd


@pytest.mark.parametrize("bending", [0.006, 0.02])
def test_a_contact_that_bends_before_it_slips_is_dahls(bending):
    flow, qd = swept()
    tau = made("coulomb_friction", arm(1), 1, level=(0.3,), bending=(bending,)).torque(flow)[:, 0].numpy()
    z = np.zeros(len(qd))  # dz/dt = qd - |qd| z / z_0, by Euler's rule in parts of a step
    for k in range(1, len(qd)):
        z[k] = z[k - 1]
        for part in range(20):
            rate = qd[k - 1] + (part + 0.5) / 20 * (qd[k] - qd[k - 1])
            z[k] += 0.002 / 20 * (rate - abs(rate) * z[k] / bending)
    assert np.abs(tau - 0.3 * z / bending).max() < 0.015, "but for the width of the turn, as Dahl has it"
    assert np.abs(tau).max() <= 0.3 * (1 + 1e-12)


def test_a_contact_that_bends_little_is_dry_friction_and_gives_back_no_more_than_was_bent():
    flow, qd = swept()
    stiff, soft = (made("coulomb_friction", arm(1), 1, level=(0.3,), bending=(b,)).torque(flow)[:, 0].numpy() for b in (1e-7, 0.02))
    plain = made("coulomb_friction", arm(1), 1, level=(0.3,)).torque(flow)[:, 0].numpy()
    turning = np.abs(qd) > 0.02
    np.testing.assert_allclose(stiff[turning], plain[turning], atol=5e-4)
    work = np.cumsum(soft * qd) * 0.002
    assert work.min() > -1e-9, "begun unbent it never gives more than it took"
    assert np.diff(work).min() < 0, "a little of what was bent comes back"
    still = np.flatnonzero(np.diff(qd) == 0)
    np.testing.assert_allclose(soft[still + 1], soft[still], err_msg="at rest it stays bent")


@pytest.mark.parametrize("name", ["coulomb_friction", "stribeck_friction", "load_friction"])
@pytest.mark.parametrize(("low", "told"), [(0.004, True), (0.0, False)])
def test_a_contact_that_may_be_rigid_is_not_told_to_bend(name, low, told):
    law = made(name, arm(1), 1, bending=(0.01,))
    statement = law.statement({"bending": (low, 0.02)})
    assert (statement == replace(law, bending=(0.0,)).statement()) != told
