"""Each link cut into strips: where they lie, what is exact, and the order of convergence."""

from math import log2

import pytest
import torch
from rigs import arm, assert_close, states

from nnhydro.errors import ConfigError
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.strips import Strips

LINKS = pytest.mark.parametrize("links", [1, 2, 3])
C_D = 1.1


def strip_drag(flow, per_link):
    """Joint torques (n, joints, links) of quadratic drag, strip by strip."""
    strips = Strips.of(flow, per_link)
    return strips.to_joints(0.5 * flow.rho * C_D * flow.D[:, None] * strips.w.abs() * strips.w)


@LINKS
def test_the_strip_sum_converges_at_second_order_where_the_velocity_keeps_its_sign(links):
    a = arm(links)
    flow = Flow(a, states(links, rows=400, seed=11))
    ends = torch.stack([flow.B, flow.A * flow.L + flow.B])
    smooth = (ends[0] * ends[1] > 0).all(-1) & (flow.A.abs() > 0.1).all(-1)  # each link: one sign, and not a plain tow
    exact = (C_D * NormalDrag((1.0,) * links).columns(flow))[smooth]
    assert len(exact) > 20
    off = [(strip_drag(flow, n)[smooth] - exact)[:, range(links), range(links)].abs() for n in (10, 20, 40)]
    for coarse, fine in ((off[0], off[1]), (off[1], off[2])):
        order = torch.log2(coarse / fine)
        assert ((order > 1.8) & (order < 2.2)).all(), f"order of convergence between {order.min():.3f} and {order.max():.3f}"


@LINKS
def test_the_strip_sum_converges_at_second_order_on_average_over_all_motions(links):
    flow = Flow(arm(links), states(links, rows=400, seed=12))
    exact = C_D * NormalDrag((1.0,) * links).columns(flow)
    off = [float((strip_drag(flow, n) - exact).norm()) for n in (10, 20, 40)]
    assert all(1.8 < log2(off[i] / off[i + 1]) < 2.2 for i in (0, 1))


def test_strips_are_as_wide_as_they_say_and_lie_at_their_middles():
    flow = Flow(arm(2), states(2, rows=3))
    strips = Strips.of(flow, 4)
    assert strips.w.shape == strips.dw.shape == (3, 2, 4)
    assert_close(strips.ds * 4, flow.L)
    assert_close(strips.x[:, 0], strips.ds / 2)
    assert_close(strips.w[:, :, 0], flow.A * strips.x[:, 0] + flow.B)
    assert_close(strips.dw[:, :, -1], flow.M * strips.x[:, -1] + flow.N)


def test_a_load_that_is_even_along_the_link_is_summed_exactly():
    flow = Flow(arm(2), states(2, rows=3))
    force, moment = Strips.of(flow, 7).force_moment(torch.ones(3, 2, 7, dtype=torch.float64))
    assert_close(force, flow.L.expand(3, 2))
    assert_close(moment, (flow.L**2 / 2).expand(3, 2))


def test_no_strips_at_all_are_refused():
    with pytest.raises(ConfigError, match="at least 1 is needed"):
        Strips.of(Flow(arm(1), states(1)), 0)
