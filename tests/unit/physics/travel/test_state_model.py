"""The state-dependent loads: McLain & Rock's golden slews, limits, symmetry and convergence."""

from math import pi

import numpy as np
import pytest
import torch
from mclain import ARM, golden, golden_slew, slew, swing, twelve_slews
from rigs import arm, assert_close, half_turned, mirrored_about_X, mirrored_about_Y, run, states

from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import tensor
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.state_model import (
    added_mass_curve,
    bspline_loads,
    drag_curve,
    has_travel_scale,
    state_loads,
    with_tau_s,
)
from nnhydro.physics.travel.term import unit_drag, unit_inertia

SLEWS = golden("slews")["slews"]
MODELS = [state_loads, bspline_loads]


@pytest.mark.parametrize("document", SLEWS, ids=["30", "60", "120"])
def test_the_load_on_a_slew_is_minus_the_golden_torque_of_the_water(document):
    tau = state_loads(ARM).torque(golden_slew(document))[:, 0]
    wanted = -tensor(document["T_hyd_n10"])
    assert float((tau - wanted).abs().max()) < 1e-10 * float(wanted.abs().max())


@pytest.mark.parametrize("document", SLEWS, ids=["30", "60", "120"])
def test_many_strips_come_to_the_golden_continuum(document):
    flow = golden_slew(document)
    wanted = -tensor(document["T_hyd_continuum"])
    error = [float((state_loads(ARM, per_link=n).torque(flow)[:, 0] - wanted).abs().max() / wanted.abs().max()) for n in (10, 20, 40)]
    assert error[2] < 5e-4
    assert 3.4 < error[0] / error[1] < 4.6, "second order"


@pytest.mark.parametrize("document", SLEWS, ids=["30", "60", "120"])
@pytest.mark.parametrize(("key", "C_D", "C_M"), [("levesque_richard_Cd1.1_Cm0", 1.1, 0.0), ("standard_Cd1.2_Cm1", 1.2, 1.0)])
def test_constant_coefficients_on_ten_strips_are_the_golden_comparison_models(document, key, C_D, C_M):
    strips = Strips.of(golden_slew(document))
    tau = strips.to_joints(C_D * unit_drag(strips) + C_M * unit_inertia(strips))[:, 0, 0]
    assert_close(tau, -tensor(document[f"T_hyd_n10_{key}"]), rtol=1e-10, atol=1e-12)


def test_the_twelve_slews_are_those_of_the_golden_identification():
    document = golden("identification")
    tau = [state_loads(ARM).torque(flow) for flow in twelve_slews()]
    assert [len(t) for t in tau] == document["points_per_slew"]
    assert_close(tau[0][:10, 0], -tensor(document["torque_checksum_first_slew_first10"]))
    every = torch.cat(tau)
    assert float(every.abs().sum()) == pytest.approx(document["sum_abs_torque"], rel=1e-12)
    assert float(every.square().mean().sqrt()) == pytest.approx(document["rms_torque"], rel=1e-12)


@pytest.mark.parametrize("links", [1, 2, 3])
def test_a_steady_flow_has_the_steady_coefficients(links):
    a = arm(links)
    flow = Flow(a, states(links))
    loads = state_loads(a, per_link=400)
    constant = Loads({"rigid_body": RigidBody.of_arm(a), "drag": NormalDrag((0.78,) * links), "mass": AddedMass((0.36,) * links)})
    assert_close(loads.torque(flow), constant.torque(flow), rtol=1e-4, atol=2e-3)


@pytest.mark.parametrize("links", [1, 2, 3])
def test_before_the_wake_forms_the_water_is_ideal(links):
    """With an endless travel scale the load is that of C_D = 0, C_M = 1."""
    a = arm(links)
    flow = Flow(a, run(links))
    loads = with_tau_s(state_loads(a, per_link=400), 1e9)
    ideal = Loads({"rigid_body": RigidBody.of_arm(a), "mass": AddedMass((1.0,) * links)})
    assert_close(loads.torque(flow), ideal.torque(flow), rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("make", MODELS)
@pytest.mark.parametrize("mirror", [mirrored_about_X, mirrored_about_Y])
def test_the_mirrored_motion_gives_the_mirrored_torque(make, mirror):
    a, motion = arm(2), run(2)
    assert_close(make(a).torque(Flow(a, mirror(motion))), -make(a).torque(Flow(a, motion)), atol=1e-8)
    assert_close(make(a).torque(Flow(a, half_turned(motion))), make(a).torque(Flow(a, motion)), atol=1e-8)


def test_a_slew_the_other_way_has_the_opposite_torque():
    assert_close(state_loads(ARM).torque(slew(12.0, 0.6, sign=-1.0)), -state_loads(ARM).torque(slew(12.0, 0.6)))


def test_the_coefficients_do_not_know_how_fast_the_arm_moves():
    """The same arc in half the time: the travel is the same row by row, so every load is four times as large."""
    slow, fast = slew(3.0, 0.8, rate=500.0), slew(12.0, 0.4, rate=1000.0)
    assert_close(state_loads(ARM).torque(fast), 4 * state_loads(ARM).torque(slow))


def test_curves_of_a_link_of_their_own_are_the_arms_where_they_are_equal():
    a, motion = arm(2), run(2)
    shared, own = state_loads(a), state_loads(a, curve_per_link=True)
    assert len(own.linear()["state_drag"].linear_values()) == 12
    assert_close(own.torque(Flow(a, motion)), shared.torque(Flow(a, motion)))


@pytest.mark.parametrize("make", MODELS)
def test_the_sum_stores_and_loads_itself_and_says_its_curves(make):
    loads = make(arm(2), at_reversal="decay", memory=3.0, laws=("aspect_ratio",))
    again = Loads.parse(loads.document())
    assert again.terms == loads.terms
    assert has_travel_scale(loads)
    s = tensor([0.0, 1e9])
    assert float(drag_curve(loads, s)[0]) == 0.0
    assert float(added_mass_curve(loads, s)[0]) == 1.0
    with pytest.raises(ModelError, match="state_loads"):
        drag_curve(Loads({}), s)


def test_reset_at_a_reversal_lowers_the_drag_against_a_kept_wake():
    t = np.linspace(0, 2, 1001)
    w = pi
    flow = swing(t, 1 - np.cos(w * t), w * np.sin(w * t), w**2 * np.cos(w * t))
    early = (t > 1.06) & (t < 1.18)
    reset, keep = (state_loads(ARM, at_reversal=rule).terms["state_drag"].torque(flow)[early, 0] for rule in ("reset", "keep"))
    assert (reset.abs() < keep.abs()).all()
