"""Comparators are honest models: they learn what can be learned, and take part on request alone."""

import warnings

import numpy as np
import pytest
import torch
from campaigns import GIVEN, TINY, campaign, planted
from rigs import arm, run

from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.evaluation.comparators import gp
from nnhydro.evaluation.comparators.comparator import comparators, raw_states, thin_rows
from nnhydro.evaluation.entries import all_names, default_names
from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.model_errors import misfit_of
from nnhydro.recordings.splitting import units

FEW = TINY.model_copy(update={"features": ("morison", "groups", "angles"), "hidden": (16,)})
LEAST = {"gp": 0.05, "boosted-trees": 0.6, "mlp-raw": 0.9}  # error on motions not shown: five short recordings are little for a tree


@pytest.fixture(autouse=True)
def few_rows(monkeypatch):
    """The Gaussian process on a hundred rows: its cost is cubic."""
    monkeypatch.setattr(gp, "MOST", 100)


def fitted(name, count=6, links=1):
    a = arm(links)
    chosen = units(campaign(a, planted(a), count, seconds=4.0, rate=25.0), GIVEN)
    return comparators()[name].fit(chosen[:-1], a, GIVEN, FEW), chosen[-1]


def test_the_catalogue_holds_the_three_of_the_table():
    assert {"gp", "boosted-trees", "mlp-raw"} <= set(comparators())


@pytest.mark.parametrize("name", sorted(comparators()))
@pytest.mark.parametrize("links", [1, 2])
def test_a_rival_gives_finite_torques_for_every_row(name, links):
    model, _ = fitted(name, count=3, links=links)
    tau = model.torque(run(links))
    assert tau.shape == (60, links)
    assert bool(torch.isfinite(tau).all())
    std = model.std(run(links))
    assert std is None or (std.shape == tau.shape and bool((std > 0).all()))


@pytest.mark.parametrize("name", sorted(LEAST))
def test_a_rival_learns_from_the_recordings(name):
    model, held_out = fitted(name)
    assert Misfit.total([misfit_of(model, held_out)]).error < LEAST[name]


@pytest.mark.slow
def test_rivals_take_part_where_they_are_asked_for():
    a = arm(2)
    assert not set(default_names(a)) & set(comparators())
    assert set(comparators()) <= set(all_names(a))
    whole = campaign(a, planted(a), 4, seconds=2.0, rate=25.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = BenchmarkOptions(["all"], 2, config=FEW).benchmark(whole)
    assert set(result.standings) == set(all_names(a))
    assert "coverage" in result.document()["models"]["gp"]


def test_raw_states_are_raw():
    motion = run(2)
    x, scale = raw_states(arm(2), motion)
    assert x.shape == (60, 8)
    assert np.array_equal(x[:, 2:4], motion.qd.numpy())
    assert bool((scale == 1).all())


@pytest.mark.parametrize("count", [1, 999, 1000, 1001, 12345])
def test_thinning_keeps_at_most_so_many(count):
    kept = len(range(count)[thin_rows(count, 1000)])
    assert min(count, 500) <= kept <= 1000
