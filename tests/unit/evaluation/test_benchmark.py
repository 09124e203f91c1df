"""One object holds the choices of a benchmark; Python and the command line hand every one of them on."""

from functools import partial
from inspect import signature
from types import SimpleNamespace

import pytest
from campaigns import TINY, campaign, planted, write_folder
from rigs import arm

import nnhydro
from nnhydro.cli.main import run
from nnhydro.errors import CampaignError, ConfigError
from nnhydro.evaluation import benchmark as evaluation
from nnhydro.evaluation.benchmark import BenchmarkOptions, honest
from nnhydro.evaluation.entries import ModelEntry
from nnhydro.evaluation.protocols.protocol import Fold, Split
from nnhydro.recordings.splitting import Unit
from nnhydro.runtime.workers import Workers

TAKEN = signature(nnhydro.benchmark).parameters


@pytest.fixture(scope="module")
def tank(tmp_path_factory):
    """A folder with a short campaign of one link."""
    a = arm(1)
    return write_folder(campaign(a, planted(a), 3, seconds=2.0, rate=25.0), tmp_path_factory.mktemp("b") / "tank")


@pytest.fixture
def handed_on(monkeypatch):
    """What reaches the benchmark in place of its work."""
    given = []
    monkeypatch.setattr(BenchmarkOptions, "benchmark", lambda options, *others: given.append((options, *others)))
    return given


@pytest.mark.parametrize("name", list(vars(BenchmarkOptions())))
def test_an_option_is_an_argument_of_the_api_with_the_same_default(name):
    assert TAKEN[name].default == vars(BenchmarkOptions())[name]


def test_every_choice_of_the_api_reaches_the_benchmark(handed_on, tank):
    chosen = {"models": ["constant"], "folds": 2, "seed": 7, "config": TINY, "protocol": "learning-curve"}
    assert set(chosen) == set(vars(BenchmarkOptions()))
    nnhydro.benchmark(tank, **chosen, report=print, workers=Workers(2))
    ((options, _, report, workers),) = handed_on
    assert (options, report, workers) == (BenchmarkOptions(**chosen), print, Workers(2))


def test_every_choice_of_the_command_reaches_the_benchmark(monkeypatch, handed_on, tank, tmp_path):
    monkeypatch.setattr("nnhydro.report.benchmark.page.write_benchmark", lambda result, out: [])
    monkeypatch.setattr("nnhydro.cli.benchmark.emit", lambda document: None)
    monkeypatch.setattr(evaluation.BenchmarkOptions, "benchmark",
                        lambda options, *others: handed_on.append((options, *others)) or SimpleNamespace(document=dict))
    words = ["--models", "constant,rigid", "--folds", "2", "--seed", "7", "--protocol", "learning-curve", "--json"]
    assert run(["benchmark", str(tank), "--out", str(tmp_path / "out"), *words]) == 0
    options = handed_on[0][0]
    assert (list(options.models), options.folds, options.seed, options.protocol) == (["constant", "rigid"], 2, 7, "learning-curve")
    assert options.config.seed == 7


def test_a_negative_seed_is_refused():
    with pytest.raises(ConfigError, match="seed -1"):
        BenchmarkOptions(seed=-1).benchmark(())


def units_called(*groups):
    return tuple(Unit(name, name, False, tuple, content=partial(frozenset, {name})) for name in groups)


def test_a_recording_that_a_model_has_seen_is_held_out_for_none():
    split = Split(units_called("a", "b", "c"), (Fold("one", (2,), (0, 1)), Fold("two", (0, 1), (2,))))
    left, seen = honest(split, [ModelEntry("old", None, split.units[0].content()), ModelEntry("new", None)])
    assert [fold.held_out for fold in left.folds] == [(1,), (2,)]
    assert seen == {"old": ("a",)}


def test_where_a_model_has_seen_everything_nothing_is_compared():
    split = Split(units_called("a", "b"), (Fold("one", (1,), (0,)),))
    with pytest.raises(CampaignError, match="old: has seen 1 of the 2 recordings"):
        honest(split, [ModelEntry("old", None, split.units[0].content())])
