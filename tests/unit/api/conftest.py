"""What the tests of the public interface share."""

import pytest
from campaigns import campaign, planted
from rigs import arm

import nnhydro


@pytest.fixture(scope="session")
def healthy():
    """A campaign in which the baseline is right."""
    a = arm()
    return campaign(a, planted(a), count=4, noise=0.01)


@pytest.fixture(scope="session")
def fitted(healthy):
    """The baseline, fitted."""
    return nnhydro.identify(healthy, "constant")


@pytest.fixture(scope="session")
def compared(healthy):
    """Two models on recordings held out."""
    return nnhydro.benchmark(healthy, ["textbook", "constant"], folds=2)
