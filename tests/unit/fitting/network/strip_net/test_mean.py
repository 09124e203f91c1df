"""The mean of strip nets."""

from dataclasses import replace

import torch
from rigs import arm, run
from strip_nets import net

from nnhydro.fitting.network.strip_net.mean import mean_of
from nnhydro.physics.flow import Flow


def test_the_mean_of_nets_gives_the_mean_of_their_torques():
    flow, first = Flow(arm(2), run(2)), net(arm(2))
    scales = {name: getattr(first, name) for name in ("spread", "middle", "wide", "lowest", "highest", "drift")}
    nets = [replace(net(arm(2), seed), **scales) for seed in (0, 1, 2)]
    want = torch.stack([each.torque(flow) for each in nets]).mean(dim=0)
    assert torch.allclose(mean_of(nets).torque(flow), want, rtol=0, atol=1e-11 * float(want.abs().max()))


def test_the_mean_of_a_net_and_itself_is_that_net():
    flow, one = Flow(arm(2), run(2)), net(arm(2))
    assert torch.allclose(mean_of([one, one]).torque(flow), one.torque(flow), rtol=1e-9)
