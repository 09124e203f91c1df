"""Curves over the travel, link by link."""

import pytest
import torch
from rigs import arm, assert_close, run

from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.travel_added_mass import StateAddedMass
from nnhydro.physics.loads.travel_drag import BsplineDrag, StateDrag
from nnhydro.physics.motion import tensor
from nnhydro.physics.travel.spline_terms import BsplineTerm, SplineTerm
from nnhydro.physics.travel.state_model import bspline_loads, state_loads


@pytest.mark.parametrize("term", [StateDrag, StateAddedMass])
def test_on_two_links_each_has_the_curve_of_its_own_ordinates(term):
    names = [f.name for f in term.parameters() if f.metadata["linear"]]
    one, two = (dict.fromkeys(names, value) for value in ((0.3,), (0.9,)))
    both = {name: (*one[name], *two[name]) for name in names}
    at, tau_s = tensor([2.0, 5.0, 30.0]), (8.0,)
    for link, alone in enumerate((one, two)):
        torch.testing.assert_close(term(**both, tau_s=tau_s).curve(at, link), term(**alone, tau_s=tau_s).curve(at))
        torch.testing.assert_close(term(**alone, tau_s=tau_s).curve(at, link), term(**alone, tau_s=tau_s).curve(at)), "one for all links"


@pytest.mark.parametrize("loads", [state_loads(arm(2)), bspline_loads(arm(2), 6)], ids=["spline", "B-splines"])
def test_columns_times_ordinates_are_the_load_times_the_curve(loads):
    flow = Flow(arm(2), run(2))
    for term in loads.terms.values():
        if isinstance(term, SplineTerm | BsplineTerm):
            state = term.state(flow)
            curves = torch.stack([term.curve(s, link) for link, s in enumerate(state.s_over_D.unbind(1))], dim=1)
            want = state.strips.to_joints(term.unit_load(state, term.added_mass) * curves).sum(-1)
            assert_close(term.columns(flow) @ term.linear_values(), want)


def test_a_curve_is_constant_from_its_travel_scale_on_and_made_of_cubic_pieces():
    for term in (StateDrag.at_start(arm(1)), BsplineDrag((0.1, 0.9, 0.4, 0.7), (6.0,))):
        end, count = term.pieces()
        assert end == term.tau_s[0]
        beyond = term.curve(tensor([end, end + 1.0, 1e6]))
        assert_close(beyond, beyond[:1].expand(3))
        for k in range(count):  # fourth differences of a cubic vanish
            inside = term.curve(tensor([end * (k + x) / count for x in (0.1, 0.3, 0.5, 0.7, 0.9)]))
            assert float(inside.diff(n=4).abs().max()) < 1e-12
