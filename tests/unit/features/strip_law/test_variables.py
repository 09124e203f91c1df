"""Variables of a strip's state, in closed form."""

import math

import pytest
import torch
from rigs import arm, assert_close, run

from nnhydro.features.strip_law.state import StripView
from nnhydro.features.strip_law.variables import bend, memory, reynolds, span
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion


def view(links, motion=None):
    return StripView(Flow(arm(links), motion or run(links)))


def test_where_the_flow_has_lasted_the_memory_is_one_and_nothing():
    """Both memories m are then the speed w: 2 m w / (m^2 + w^2) = 1 and (w^2 - m^2) / (m^2 + w^2) = 0."""
    z = memory(view(1, Motion.at([[0.2]], [[2.0]], 0.0, 0.5)))
    assert_close(z[:, :, 0::2], torch.ones_like(z[:, :, 0::2]), 1e-3, 1e-3)
    assert_close(z[:, :, 1::2], torch.zeros_like(z[:, :, 1::2]), 1e-3, 1e-3)


def test_from_rest_the_memory_lags_behind_the_speed():
    z = memory(view(1))
    assert z.shape[2] == 4
    moving = view(1).w.abs() > 0.1
    assert float(z[:, :, 1][moving].max()) > 0.5


def test_the_reynolds_number_enters_by_its_logarithm():
    seen = view(2)
    Re = seen.w.abs() * torch.tensor([0.07, 0.06], dtype=torch.float64)[:, None] / 1e-6
    assert_close(reynolds(seen)[:, :, 0], torch.log10(1 + Re / 1e3) - 1)
    assert float(reynolds(view(1, Motion.at([[0.2]], 0.0, 0.0))).max()) == -1.0


def test_the_place_of_a_strip_runs_along_the_link_and_along_the_arm():
    z = span(view(3))[0]
    assert_close(z[:, 1], (torch.arange(10, dtype=torch.float64) + 0.5).expand(3, 10) / 10)
    assert z[:, 2, 0].tolist() == [-1.0, 0.0, 1.0]
    L, D = 0.55, 0.07
    assert float(z[0, 0, -1]) == pytest.approx(math.exp(-L / 20 / D))
    assert float(span(view(1))[0, 0, 2].abs().max()) == 0.0


def test_the_bend_is_the_mean_cosine_of_the_angles_with_the_neighbours():
    q = torch.tensor([[0.7, 0.3, -1.2]], dtype=torch.float64)
    z = bend(view(3, Motion.at(q, 0.0, 0.0)))[0, :, 0, 0]
    assert_close(z, torch.tensor([math.cos(0.3), (math.cos(0.3) + math.cos(1.2)) / 2, math.cos(1.2)], dtype=torch.float64))
    assert bool((bend(view(1)) == 1).all())
