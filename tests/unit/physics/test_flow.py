"""The water as the links meet it: what they feel of its acceleration is the time derivative of what they feel of its velocity."""

import torch
from rigs import arm, assert_close, run

from nnhydro.physics.flow import Flow
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
