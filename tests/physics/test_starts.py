"""Where fits start and how far they may go: figures of the sources, typed here, and what physics allows."""

import pytest
import torch
from rigs import arm, run
from scipy.interpolate import CubicSpline

from nnhydro.fitting.travel.travel_scale import COARSE
from nnhydro.physics.coefficients.keulegan_carpenter import added_mass_coefficient, drag_ratio
from nnhydro.physics.coefficients.law import law_of
from nnhydro.physics.coefficients.travel_spline import KNOTS, basis, cardinal_matrix, curve
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import term_kinds
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.travel_added_mass import BsplineAddedMass, StateAddedMass
from nnhydro.physics.loads.travel_drag import BsplineDrag, StateDrag
from nnhydro.physics.motion import tensor
from nnhydro.physics.travel.state_model import bspline_loads, state_loads

FINE = torch.linspace(0, 12, 1201, dtype=torch.float64)  # diameters


def test_fits_start_within_what_physics_allows():
    for kind, term in term_kinds().items():
        for f in term.parameters():
            low, high = f.metadata["bounds"]
            assert low <= f.metadata["start"] <= high, (kind, f.name)
            assert all(low <= value <= high for value in f.metadata["grid"]), (kind, f.name)


def test_drag_starts_from_the_curve_of_figure_7():
    """McLain & Rock (1998): C_D rises from 0 to 1.03 after 3.7 diameters, falls to 0.745 and stays at 0.78."""
    C_D = StateDrag.at_start(arm(1)).curve(FINE)
    top = int(C_D.argmax())
    assert (float(FINE[top]), float(C_D[top])) == pytest.approx((3.70, 1.030), abs=0.006)
    assert bool((C_D[:top].diff() > 0).all())
    low = top + int(C_D[top:].argmin())
    assert (float(FINE[low]), float(C_D[low])) == pytest.approx((6.4, 0.745), abs=0.06)
    assert float(C_D[133]) == pytest.approx(0.43, abs=0.002), "after a sixth of 8 diameters"
    assert bool((C_D[FINE >= 8.0] - 0.78).abs().max() < 1e-9)
    assert float(C_D[0]) == 0.0


def test_added_mass_starts_from_the_curve_of_figure_7():
    """McLain & Rock (1998): C_M falls from 1 to 0.2 after 4.2 diameters and comes back to 0.36."""
    term = StateAddedMass.at_start(arm(1))
    C_M = term.curve(FINE) + curve(FINE, term.tau_s[0], 1.0, torch.zeros(KNOTS, dtype=torch.float64))
    low = int(C_M.argmin())
    assert (float(FINE[low]), float(C_M[low])) == pytest.approx((4.20, 0.200), abs=0.006)
    assert bool((C_M[:low].diff() < 0).all())
    assert [float(C_M[k]) for k in (0, 133, 667)] == pytest.approx([1.0, 0.84, 0.332], abs=0.002)
    assert bool((C_M[FINE >= 8.0] - 0.36).abs().max() < 1e-9)


def test_the_curve_is_the_cubic_spline_without_bend_at_rest_and_without_slope_at_the_end():
    cardinal_matrix.cache_clear()
    u = torch.linspace(0, 1.3, 200, dtype=torch.float64)
    for k in range(KNOTS + 1):
        ordinates = torch.eye(KNOTS + 1, dtype=torch.float64)[k]
        spline = CubicSpline(torch.linspace(0, 1, KNOTS + 1, dtype=torch.float64), ordinates, bc_type=((2, 0.0), (1, 0.0)))
        want = tensor(spline(u.clamp(max=1.0)))
        if k:
            torch.testing.assert_close(basis(5 * u, 5.0)[:, k - 1], want, rtol=0, atol=1e-12)
        torch.testing.assert_close(curve(5 * u, 5.0, float(ordinates[0]), ordinates[1:]), want, rtol=0, atol=1e-12)
    ordinates = torch.arange(1.0, 7.0, dtype=torch.float64)
    at_knots = curve(torch.arange(7, dtype=torch.float64), 6.0, -2.0, ordinates)
    assert at_knots.tolist() == pytest.approx([-2.0, 1, 2, 3, 4, 5, 6])


def test_sums_start_from_the_travel_of_their_terms():
    for loads, term in ((state_loads(arm(2)), StateDrag), (bspline_loads(arm(2)), BsplineDrag)):
        own = [t.tau_s for t in loads.terms.values() if hasattr(t, "tau_s")]
        assert own == [term.at_start(arm(2)).tau_s] * 3
    splines = bspline_loads(arm(2), 5).terms
    for name, term in (("bspline_drag", BsplineDrag), ("bspline_added_mass", BsplineAddedMass)):
        assert splines[name].c == term.at_start(arm(2)).c * 5


def test_drag_and_added_mass_share_a_travel_scale_and_the_room_of_their_curves():
    def bounds(term, name):
        return next(f.metadata["bounds"] for f in term.parameters() if f.name == name)

    for drag, mass, names in ((StateDrag, StateAddedMass, ("d1", "m1")), (BsplineDrag, BsplineAddedMass, ("c", "c"))):
        assert bounds(drag, "tau_s") == bounds(mass, "tau_s")
        assert bounds(drag, names[0]) == bounds(mass, names[1])
        for term, name in zip((drag, mass), names, strict=True):
            started, least = term.at_start(arm(1)), bounds(drag, names[0])[0]
            assert [low for low, _ in started.linear_bounds()] == [least] * len(started.linear_values()), name
            assert float(started.with_linear(least * torch.ones(len(started.linear_values()))).curve(tensor([1e9]))) == pytest.approx(least)
        low, high = bounds(drag, "tau_s")
        assert low <= COARSE[0] < COARSE[-1] <= high, "what is searched lies within"


def test_what_is_not_known_yet_is_ideal_flow_and_bounds_leave_room_for_what_was_measured():
    ideal = AddedMass.at_start(arm(2))
    assert ideal.C_M == (1.0, 1.0), "a cylinder in ideal flow carries the water that it displaces"
    bounds = {f.name: f.metadata["bounds"] for term in (AddedMass, RigidBody) for f in term.parameters()}
    assert bounds["C_M"][0] == 0.0, "no water is carried by a link that nothing pushes"
    assert bounds["mass"][0] == 0.0, "nothing is lighter than nothing, and a link may come near to it"
    low, high = {f.name: f.metadata["bounds"] for f in BsplineDrag.parameters()}["c"]
    assert low < 0 < high, "coefficients of splines, other than drag itself, may be negative"


def test_a_cylinder_is_smooth_where_nobody_says_that_it_is_rough():
    law, state = law_of("keulegan_carpenter"), StateDrag.at_start(arm(2)).state(Flow(arm(2), run(2)))
    torch.testing.assert_close(law.drag(state), drag_ratio(state.KC))
    torch.testing.assert_close(law.added_mass(state), added_mass_coefficient(state.KC))
    assert not torch.equal(law_of("keulegan_carpenter=1").drag(state), law.drag(state))
