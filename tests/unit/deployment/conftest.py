"""A model is recorded once for every file that is written of it."""

from functools import lru_cache

import pytest

from nnhydro.deployment import c_header, casadi_step
from nnhydro.deployment.onnx import onnx_file
from nnhydro.deployment.step import record_step


@pytest.fixture(autouse=True, scope="session")
def recorded_once():
    """A model is recorded once for both precisions, all formats and all tests of a worker."""
    once = lru_cache(8)(record_step)
    with pytest.MonkeyPatch.context() as patch:
        for module in (c_header, casadi_step, onnx_file):
            patch.setattr(module, "record_step", once)
        yield
