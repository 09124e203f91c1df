"""What a strip net looks at: free of dimension, odd and even in the mirror, and loads that are integrals over the link."""

import pytest
import torch
from rigs import arm, assert_close, mirrored_about_Y, run, scaled, states

from nnhydro.features.interference import shadow
from nnhydro.features.strip_law.state import StripView
from nnhydro.features.wake import stations
from nnhydro.models.baselines import BASELINES
from nnhydro.models.learned.strip_inputs import POINTS, StripInputs, _weights, arm_columns, drift, rigid_torque, sensor_torque
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, Water


def test_what_is_odd_turns_with_the_mirror_and_what_is_even_stays():
    a, motion = arm(2), run(2)
    here, there = (StripInputs.of(Flow(a, m)) for m in (motion, mirrored_about_Y(motion)))
    assert_close(there.x, -here.x, 1e-9, 1e-9)
    assert_close(there.r, here.r, 1e-9, 1e-9)
    assert_close(there.plain, -here.plain, 1e-9, 1e-9)
    assert_close(there.speeds[..., 0], here.speeds[..., 0], 1e-9, 1e-9)


def test_a_larger_arm_at_the_same_rates_looks_the_same_but_for_viscosity():
    small, large, motion = arm(2), scaled(arm(2), 2.0), states(2, u0=0.0)
    one, two = (StripInputs.of(Flow(a, motion)) for a in (small, large))
    assert_close(one.x, two.x, 1e-9, 1e-9)
    assert_close(one.plain[..., :2], two.plain[..., :2], 1e-9, 1e-9)
    assert bool((two.r > one.r)[..., 0][one.speeds[..., 0] > 0.1].all())
    assert_close(two.r[..., 1:3], one.r[..., 1:3], 1e-9, 1e-9)


def test_a_strip_sees_the_end_of_its_link_which_link_it_is_on_and_the_wakes_that_it_runs_into():
    a, motion = arm(2), run(2)
    place = StripInputs.of(Flow(a, motion)).r[..., 1:].unflatten(1, (2, len(POINTS)))
    assert_close(place[..., 1], torch.tensor([-1.0, 1.0], dtype=torch.float64)[:, None].expand(len(motion), -1, len(POINTS)))
    assert bool((place[..., 0].diff(dim=2) > 0).all()), "nearer to the outer end"
    assert float(place[..., 0].max()) < 1.0
    law = shadow(StripView(Flow(a, motion)))[..., POINTS].mT
    assert_close(place[..., 2:], law)
    assert float(law[:, 1].max()) > 0.1, "link 2 runs into the wake of link 1"
    assert not StripInputs.of(Flow(arm(1), run(1))).r[..., 3:].any(), "a single link runs into none"


def test_weights_integrate_cubics_along_the_link():
    x = (torch.tensor(POINTS, dtype=torch.float64) + 0.5) / 10
    for power in range(4):
        assert float(_weights() @ x**power) == pytest.approx(1 / (power + 1))


def test_a_load_alike_on_every_strip_acts_in_the_middle_of_the_link():
    a = arm(1)
    flow = Flow(a, states(1, 5))
    load = torch.ones(1, stations(flow)[:, POINTS].numel(), 1, dtype=torch.float64)
    force = flow.rho * float(flow.D[0]) ** 3 * float(flow.L[0])
    assert_close(sensor_torque(flow, load), torch.full((5, 1, 1), force * float(flow.L[0]) / 2, dtype=torch.float64))


def test_drift_is_the_square_of_the_speed_through_the_water():
    a, motion = arm(2), run(2)
    assert_close(drift(Flow(a, motion)), motion.u0**2)
    along = Water(torch.stack([torch.zeros_like(motion.u0), motion.u0], dim=1), torch.zeros(60, 2, dtype=torch.float64))
    assert_close(drift(Flow(a, motion, along)), torch.zeros(60, dtype=torch.float64))


@pytest.mark.parametrize("keys", [{}, {"gravity_m_s2": 9.81}, {"drive": {"kind": "remote", "pulley_ratio": 1.5}}])
def test_the_rigid_torque_is_that_of_the_dry_arm(keys):
    a, motion = arm(2, **keys), run(2)
    dry = StripTheory(a, None, {}, "rigid", BASELINES["rigid"].start(a))
    assert_close(rigid_torque(Flow(a, motion)), dry.torque(motion))


def test_friction_is_felt_at_every_drive_for_every_joint():
    flow = Flow(arm(2), run(2))
    friction = arm_columns(flow)[..., -12:]
    assert friction.shape[-1] == 2 * 3 * 2
    still = arm_columns(Flow(arm(2), Motion.at([[0.3, 0.2]], 0.0, 0.0)))[..., -12:]
    assert not still.any()
