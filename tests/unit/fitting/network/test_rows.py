"""The rows that a network is trained on."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch

from nnhydro.errors import CampaignError
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.network.rows import Rows, row_numbers, standardise, torque_rms, watched_units
from nnhydro.recordings.filtering.low_pass import LowPass


def segment(tau, keep=None, cutoff=None, dt=0.01):
    keep = np.ones(len(tau), dtype=bool) if keep is None else keep
    return SimpleNamespace(tau=tau, keep=keep, low_pass=None if cutoff is None else LowPass(cutoff), dt=dt)


def test_the_torques_size_is_its_root_mean_square_over_all_rows_that_are_compared():
    rng = np.random.default_rng(1)
    parts = [rng.standard_normal((n, 2)) * [1.0, 5.0] for n in (50, 80, 30)]
    keep = np.arange(80) % 2 == 0
    segments = [segment(parts[0]), segment(parts[1], keep)], [segment(parts[2])]
    units = [SimpleNamespace(segments=lambda found=found: found) for found in segments]
    every = np.concatenate([parts[0], parts[1][keep], parts[2]])
    np.testing.assert_allclose(torque_rms(units), np.sqrt((every**2).mean(axis=0)), rtol=1e-6)
    with pytest.raises(CampaignError, match="long enough to train on"):
        torque_rms([SimpleNamespace(segments=tuple)])


@pytest.mark.parametrize(("cutoff", "dt", "stride"), [(None, 0.01, 1), (5.0, 0.01, 5), (2.5, 0.01, 10), (2.5, 0.02, 5), (50.0, 0.01, 1)])
def test_a_network_is_trained_on_four_rows_a_period_of_the_cut_off(cutoff, dt, stride):
    keep = np.arange(200) >= 20
    np.testing.assert_array_equal(row_numbers(segment(np.zeros((200, 1)), keep, cutoff, dt)), np.arange(20, 200, stride))


def test_inputs_get_unit_spread_odd_ones_about_zero_and_their_range_holds_the_mirror_images():
    generator = torch.Generator().manual_seed(1)
    x = torch.randn(20000, 4, generator=generator) * torch.tensor([2.0, 3.0, 0.5, 1.0]) + torch.tensor([0.7, 5.0, -1.0, 0.0])
    x[:, 3] = 4.0  # tells nothing
    rows = Rows(x.clone(), torch.tensor([-1.0, 1.0, -1.0, 1.0]), torch.ones(1), torch.ones(1), torch.zeros(1))
    centre, spread, lowest, highest = standardise(rows)
    mean = x.double().mean(dim=0)
    torch.testing.assert_close(centre, torch.tensor([0.0, mean[1], 0.0, 4.0], dtype=torch.float64))
    want = torch.stack([x[:, 0].double().pow(2).mean().sqrt(), x[:, 1].double().std(unbiased=False), x[:, 2].double().pow(2).mean().sqrt()])
    torch.testing.assert_close(spread[:3], want)
    assert float(spread[3]) == 1e6
    torch.testing.assert_close(rows.x, ((x - centre) / spread).float())
    reach = rows.x[:, [0, 2]].abs().amax(dim=0).double()
    torch.testing.assert_close(highest[[0, 2]], reach, rtol=1e-5, atol=1e-6)
    torch.testing.assert_close(lowest[[0, 2]], -reach, rtol=1e-5, atol=1e-6)
    ends = torch.stack([rows.x[:, 1].amin(), rows.x[:, 1].amax()]).double()
    torch.testing.assert_close(torch.stack([lowest[1], highest[1]]), ends, rtol=1e-5, atol=1e-6)


def test_each_member_watches_its_own_share_of_the_recordings():
    units = [SimpleNamespace(name=f"run{k}", group=f"run{k}", steady=False) for k in range(20)]
    watched = watched_units(units, TrainingConfig(members=5, validation_share=0.2, seed=3))
    assert watched.shape == (5, 20)
    assert watched.sum(dim=1).tolist() == [4] * 5
    assert len({tuple(row.tolist()) for row in watched}) > 1
    again = watched_units(units, TrainingConfig(members=4, validation_share=0.2, seed=4))
    assert torch.equal(again, watched[1:]), "member k of seed s is member k - 1 of seed s + 1"
