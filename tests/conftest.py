"""Settings of all tests: repeatable examples, one thread, the folder of shared rigs on the path, and long files first."""

import gc
import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE / "physics"):  # tests are imported by path; rigs.py and golden_deviations.py are imported by name
    sys.path.insert(0, str(folder))
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):  # a worker a core: numpy and torch read them when imported
    os.environ.setdefault(variable, "1")

settings.register_profile("nnhydro", derandomize=True, deadline=None, max_examples=40)
settings.load_profile("nnhydro")


SLOW, QUICK = 5.0, 0.1  # s, about, of a test that is marked slow, where its mark does not say more, and of any other


def pytest_configure(config):
    """Let the files of tests go to the workers in the order in which they are collected, not by the number of their tests."""
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


def pytest_collection_modifyitems(config, items):
    """Begin with the files that take longest, so that no worker ends alone with one of them."""
    if not hasattr(config, "workerinput"):
        return
    cost = {}
    for item in items:
        mark = item.get_closest_marker("slow")
        seconds = QUICK if mark is None else mark.kwargs.get("seconds", SLOW)
        cost[item.path] = cost.get(item.path, 0.0) + seconds
    items.sort(key=lambda item: -cost[item.path])


def pytest_collection_finish():
    """Leave what lasts as long as the tests out of the search for rings of garbage, which took a twentieth of their time."""
    gc.freeze()
    gc.set_threshold(10_000, 10, 10)


@pytest.fixture(scope="session")
def quick_python():
    """The folder of a `python` that starts in a fraction of the time."""
    from warm_python import warm_python

    with warm_python() as folder:
        yield folder


@pytest.fixture(scope="session")
def hybrid():
    """A hybrid trained for an instant on constant coefficients, of an arm whose coefficients grow with the travel."""
    from stepped import hybrid

    return hybrid("constant")


@pytest.fixture(scope="session")
def with_memory():
    """The hybrid with a net that remembers."""
    from stepped import model_of

    return model_of("with memory")


@pytest.fixture
def brief_memories(monkeypatch):
    """Memories of the strips are trained in 20 passes over the recordings instead of 90, in a quarter of the time: they err more."""
    from nnhydro.fitting.network.strip_net import latest_nets

    fit = latest_nets.fit_strip_net
    monkeypatch.setattr(latest_nets, "fit_strip_net", lambda runs, seed: fit(runs, seed, epochs=20))
    monkeypatch.setattr(latest_nets, "_LATEST", {})  # no other test gets such a net


@pytest.fixture
def no_rivals(monkeypatch):
    """A concealed campaign is drawn without the causes that look like the hidden one, which take two thirds of the time."""
    from nnhydro.blind_tests.truth import campaign

    monkeypatch.setattr(campaign, "nearest", lambda rng, reference, found: [{} for _ in found])


@pytest.fixture
def catalogue_as_it_was():
    """Effects that a test adds leave the catalogue with it."""
    from nnhydro.effects.catalogue import catalogue
    from nnhydro.effects.effect import REGISTER

    catalogue()
    before = dict(REGISTER)
    yield
    REGISTER.clear()
    REGISTER.update(before)
