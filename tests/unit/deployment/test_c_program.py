"""A program as one C function: its own functions, and those of the library."""

import numpy as np
import pytest
from c_programs import REAL, in_c

from nnhydro.deployment import c_program
from nnhydro.deployment.native import compiler
from nnhydro.deployment.onnx.expressions import Program

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler here")


@pytest.mark.parametrize("many", [0, 10**9], ids=["loops", "statements"])
@pytest.mark.parametrize("precision", REAL)
@pytest.mark.parametrize("kind", ["tanh", "exp", "sigmoid"])
def test_functions_of_plain_arithmetic_are_good_to_a_few_last_digits(kind, precision, many, tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", many)
    real = REAL[precision]
    least, widest = np.finfo(real).smallest_subnormal, 700.0 if precision == "double" else 80.0
    sizes = np.concatenate([[0.0, least, 3 * least, np.finfo(real).tiny], np.geomspace(1e-12, widest, 40), np.linspace(0.1, 20.0, 40)])
    x = np.concatenate([sizes, -sizes]).astype(real)
    program = Program(len(x) + 3)
    outputs = [program.unary(kind, program.input(k)) for k in range(program.n_inputs)]
    got = in_c(tmp_path, program, outputs, precision)(np.concatenate([x, [np.inf, -np.inf, np.nan]]))
    exact = x.astype(np.longdouble)
    want = {"tanh": np.tanh, "exp": np.exp, "sigmoid": lambda x: 1 / (1 + np.exp(-x))}[kind](exact)
    off = np.abs(got[:-3] - want) / np.spacing(np.abs(want).astype(real))
    assert off.max() < 5, f"{x[off.argmax()]}: {off.max():.1f} units of the last place"
    np.testing.assert_allclose(got[-2], {"tanh": -1.0, "exp": 0.0, "sigmoid": 0.0}[kind], atol=1e-34)
    assert got[-3] == 1.0 if kind != "exp" else got[-3] > 1e34
    assert np.isnan(got[-1])


@pytest.mark.parametrize("precision", REAL)
@pytest.mark.parametrize("kind", ["sin", "cos", "sqrt"])
def test_loops_over_other_functions_are_as_good_as_numpy_s(kind, precision, tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    x = np.concatenate([[0.0, 1e-300, 1e-8], np.linspace(-4.0, 4.0, 60), np.geomspace(1.0, 1e7, 60)]).astype(REAL[precision])
    program, x = Program(len(x)), np.abs(x) if kind == "sqrt" else x
    got = in_c(tmp_path, program, [program.unary(kind, program.input(k)) for k in range(len(x))], precision)(x)
    want = getattr(np, kind)(x.astype(float))
    assert (np.abs(got - want) <= 2 * np.finfo(REAL[precision]).eps * np.maximum(np.abs(want), 0.5 * (kind != "sqrt"))).all()
