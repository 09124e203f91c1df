"""Which engine runs a compiled model."""

import numpy as np
import pytest
from compiled_models import model_of
from rigs import arm

from nnhydro.deployment.compiled import engines
from nnhydro.deployment.compiled.torque import compile_model
from nnhydro.deployment.onnx.expressions import Program
from nnhydro.errors import ConfigError, MissingExtraError, ModelError


def test_without_numba_numpy_is_the_engine_and_travel_asks_for_numba(monkeypatch):
    monkeypatch.setattr(engines, "find_spec", lambda name: None)
    assert compile_model(model_of(arm())).engine == "numpy"
    with pytest.raises(ModelError, match=r"pip install 'nnhydro\[fast\]'"):
        compile_model(model_of(arm(), "state"))
    with pytest.raises(MissingExtraError, match=r"pip install 'nnhydro\[fast\]'"):
        compile_model(model_of(arm()), "numba")


def test_an_unknown_engine_is_refused():
    with pytest.raises(ConfigError, match="engine 'fortran': one of numba, numpy"):
        compile_model(model_of(arm()), "fortran")


def test_rows_of_numpy_are_the_steps_one_by_one(monkeypatch):
    monkeypatch.setattr(engines, "PIECE", 7)
    given, made = np.random.default_rng(1).standard_normal((2, 20, 2)), np.zeros((20, 3))
    columns = [engines.EngineColumns("a", 2), engines.EngineColumns("b", 2)]
    flat = [np.ascontiguousarray(part).reshape(-1) for part in given]
    wide = Program(4)
    a, b, c, d = (wide.input(k) for k in range(4))
    wanted = [wide.mul(a, b), wide.apply("max", c, d), wide.unary("atan", c)]
    engines.numpy_rows(wide, wanted, columns, engines.EngineColumns("out", 3))(20, *flat, made.reshape(-1))
    one = engines.step(wide, wanted)
    np.testing.assert_allclose(made, [one(*row) for row in np.concatenate(list(given), axis=1)], rtol=1e-15)


def test_columns_are_read_row_by_row_or_column_by_column():
    assert engines.EngineColumns("x", 2).at() == ["x[2*i + 0]", "x[2*i + 1]"]
    assert engines.EngineColumns("x", 2, 100).at() == ["x[i + 0]", "x[i + 100]"]
