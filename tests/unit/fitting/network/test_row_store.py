"""Rows that exceed the memory budget lie in files, and nothing else changes."""

import numpy as np
import pytest
import torch
from campaigns import GIVEN, TINY, campaign, planted, same_tensors
from rigs import arm

from nnhydro.errors import CampaignError
from nnhydro.fitting.network.row_store import RowStore
from nnhydro.fitting.network.rows import standardise, torque_rms, training_rows
from nnhydro.fitting.network.train import train
from nnhydro.recordings.splitting import units

ALL = 2**62


def small():
    return campaign(arm(2), planted(arm(2)), 4, noise=0.02, seconds=2.0, rate=50.0)


def parts(seed=1, count=7):
    rng = np.random.default_rng(seed)
    return [(torch.from_numpy(rng.standard_normal((m, 3)).astype(np.float32)), torch.arange(m)) for m in rng.integers(1, 50, count)]


@pytest.mark.parametrize("budget", [0, 1000, 3000, ALL])
def test_rows_come_back_in_order_whatever_the_budget(budget, tmp_path):
    given = parts()
    with RowStore(budget, tmp_path) as store:
        for part in given:
            store.append(part)
        assert store.mapped == (budget < ALL)
        for k, column in enumerate(store.columns()):
            assert torch.equal(column, torch.cat([part[k] for part in given]))


def test_the_files_vanish_with_the_store_even_after_an_error(tmp_path):
    def interrupted():
        with RowStore(0, tmp_path) as store:
            store.append(parts()[0])
            assert len(list(tmp_path.iterdir())) == 1
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not list(tmp_path.iterdir())


def test_an_empty_store_says_what_is_missing():
    with RowStore(0) as store, pytest.raises(CampaignError, match="nnhydro check"):
        store.columns()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["network", "hybrid"])
def test_training_from_mapped_rows_gives_the_very_same_weights(kind, tmp_path):
    held = train(small(), TINY.model_copy(update={"model": kind}))
    mapped = train(small(), TINY.model_copy(update={"model": kind, "memory_mb": 1e-3}), tmp_path / "state.safetensors")
    assert same_tensors(held, mapped)
    assert [path.name for path in tmp_path.iterdir()] == ["state.safetensors"]


def test_rows_are_standardised_in_place_piece_by_piece(monkeypatch):
    whole = small()
    chosen = units(whole, GIVEN)
    rows = training_rows(chosen, whole.arm, TINY, 0.1 * torque_rms(chosen), None)
    before = rows.x.double().clone()
    monkeypatch.setattr("nnhydro.fitting.network.rows.CHUNK", 37)
    centre, spread, lowest, highest = standardise(rows)
    odd = rows.parity < 0
    assert not centre[odd].any()
    assert torch.allclose(centre[~odd], before[:, ~odd].mean(0))
    assert torch.allclose(rows.x, ((before - centre) / spread).float())
    assert bool((rows.x <= highest.float() + 1e-6).all())
    assert torch.equal(lowest[odd], -highest[odd])


def test_rows_that_exceed_the_budget_lie_in_files_and_those_that_just_fit_do_not():
    part = (torch.arange(6.0).reshape(3, 2), torch.arange(3))
    size = 6 * 4 + 3 * 8
    for budget, mapped in ((2 * size, False), (2 * size - 1, True), (0, True)):
        with RowStore(budget) as store:
            store.append(part)
            store.append(part)
            assert store.mapped == mapped
            x, k = store.columns()
            assert torch.equal(x, torch.cat([part[0]] * 2))
            assert torch.equal(k, torch.cat([part[1]] * 2))
