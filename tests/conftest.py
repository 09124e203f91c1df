"""Settings of all tests: repeatable examples, one thread, and the folder of shared rigs on the path."""

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
