"""What the water remembers: first-order memories."""

import numpy as np
import pytest
import torch
from rigs import assert_close

from nnhydro.physics.motion import tensor
from nnhydro.physics.travel.wake_memory import lags_behind, overtaking, relax, share_missed


def test_a_memory_joined_by_doubling_is_the_step_by_step_recursion():
    rng = np.random.default_rng(3)
    target, rate = tensor(rng.standard_normal((77, 2, 3))), tensor(rng.uniform(0, 2, (77, 1, 1)))
    said, m = relax(target, rate, target[0]), target[0].clone()
    for k in range(1, 77):
        m = target[k] + (m - target[k]) * torch.exp(-rate[k])
        assert_close(said[k], m)


def test_a_memory_of_a_step_fades_exponentially_and_one_that_never_changes_stays():
    rate = torch.full((50, 1), 0.1, dtype=torch.float64)
    ones = torch.ones(50, 1, dtype=torch.float64)
    found = relax(ones, rate, torch.zeros(1, dtype=torch.float64))
    assert_close(found[:, 0], -torch.expm1(-0.1 * torch.arange(50, dtype=torch.float64)))
    assert torch.equal(relax(ones, rate, torch.ones(1, dtype=torch.float64)), ones)


def test_behind_a_ramp_the_memory_lags_by_its_length():
    rate = torch.full((400, 1), 0.05, dtype=torch.float64)
    ramp = 0.3 * torch.arange(400, dtype=torch.float64)[:, None]
    late, twice = lags_behind([ramp, 2 * ramp], rate)
    assert float(late[-1, 0]) == pytest.approx(0.3 / 0.05, rel=1e-6)
    assert_close(late[:5], ramp[:5] - _followed(ramp, 0.05)[:5])
    assert_close(twice, 2 * late)


def _followed(ramp, rate):
    """The memory of a target that is linear between the rows, integrated finely."""
    m, found = ramp[0, 0].item(), [ramp[0, 0].item()]
    for a, b in zip(ramp[:-1, 0].tolist(), ramp[1:, 0].tolist(), strict=True):
        m = b - (b - a) / rate + (m - a + (b - a) / rate) * np.exp(-rate)
        found.append(m)
    return tensor(found)[:, None]


def test_what_is_missed_of_a_rise_is_all_of_it_over_no_time():
    rates = tensor([0.0, 1e-9, 1.0, 700.0])
    assert_close(share_missed(rates), tensor([1.0, 1.0 - 0.5e-9, 1 - np.exp(-1.0), 1 / 700]))


def test_a_wake_settles_over_its_length_and_goes_on_when_the_link_has_stopped():
    t = torch.linspace(0, 4, 4001, dtype=torch.float64)
    w = torch.where(t < 2, 0.5, 0.0)[:, None, None]
    w[0] = 0.0
    v = overtaking(t, w, tensor([[0.1]]))[:, 0, 0]
    assert float(v[1999]) == pytest.approx(0.5, rel=1e-3), "a metre is ten lengths"
    assert 0.01 < float(v[-1]) < 0.1, "it spreads as slowly as it moves: v = 1/(1/v_0 + t/length)"
    assert float(v[-1]) == pytest.approx(1 / (1 / float(v[2000]) + 2.0 / 0.1), rel=0.01)
    fading = overtaking(t, w, tensor([[0.1]]), fading=3.0)[:, 0, 0]
    assert float(fading[-1]) < 0.02 * float(v[-1])
