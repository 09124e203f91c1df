"""The water as the links meet it: what they feel of its acceleration is the time derivative of what they feel of its velocity."""

import torch
from rigs import arm, assert_close, run

from nnhydro.physics.flow import Flow, joint_by_joint, sum_over_links
from nnhydro.physics.motion import Water


def test_accelerations_through_moving_water_are_the_time_derivatives_of_the_velocities():
    motion, w = run(3, rows=3001), torch.tensor([1.7, 2.3], dtype=torch.float64)
    phase = w * motion.t[:, None]
    flow = Flow(arm(3), motion, Water(torch.sin(phase), w * torch.cos(phase)))
    for speed, acceleration in ((flow.B, flow.N), (flow.u_x, flow.du_x)):
        assert_close(torch.gradient(speed, spacing=(motion.t,), dim=0)[0][1:-1], acceleration[1:-1], rtol=1e-4, atol=2e-4)
    still = Flow(arm(3), motion)
    n = torch.stack([-torch.sin(flow.phi), torch.cos(flow.phi)], dim=-1)
    assert_close(still.B - flow.B, (n * torch.sin(phase)[:, None]).sum(-1))


def test_rows_of_a_joint_lie_side_by_side_so_that_operations_run_along_them():
    flow = Flow(arm(3), run(3, rows=50))
    wet = flow.in_water(torch.ones(50, 2, dtype=torch.float64), torch.zeros(50, 3, 2, dtype=torch.float64))
    for x in (flow.phi, flow.A, flow.M, flow.B, flow.N, flow.u_x, flow.du_x, flow.lever_normal, flow.lever_axial, wet.B, wet.N,
              flow.normal_columns(flow.B, flow.N), joint_by_joint(torch.zeros(50, 2, 3))):
        assert x.stride(0) == 1


def test_the_sum_over_links_is_that_of_all_columns():
    columns = torch.randn(20, 2, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    assert_close(sum_over_links(columns), columns.sum(-1))
    assert torch.equal(sum_over_links(columns[..., :1]), columns[..., 0])
