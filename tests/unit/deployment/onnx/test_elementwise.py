"""Elementwise operations on expressions give what numpy gives on numbers, complex ones included."""

import math

import numpy as np
import pytest

from nnhydro.deployment.onnx.elementwise import Complex, elementwise
from nnhydro.deployment.onnx.expressions import Program, as_cells

X = np.array([[-1.3, 0.4], [0.0, 2.0], [0.7, -0.2]])
BINARY = {"add": np.add, "sub": np.subtract, "mul": np.multiply, "maximum": np.maximum, "minimum": np.minimum, "hypot": np.hypot,
          "rsub": lambda a, b: b - a, "gt": np.greater, "le": np.less_equal, "eq": np.equal, "ne": np.not_equal}
UNARY = {"abs": np.abs, "exp": np.exp, "tanh": np.tanh, "sign": np.sign, "neg": np.negative, "square": np.square, "expm1": np.expm1,
         "sigmoid": lambda x: 1 / (1 + np.exp(-x)), "relu": lambda x: np.maximum(x, 0.0)}


def computed(name, *others, **keys):
    """The operation on the two columns of X, row by row."""
    p = Program(2)
    cells = [as_cells([p.input(k)], (1,)) for k in range(2)][:1 if name in UNARY or keys else 2]
    made = elementwise(p)[name](*cells, *others, **keys)
    return p.evaluate(list(made.ravel()), X)[:, 0]


@pytest.mark.parametrize("name", BINARY)
def test_an_operation_of_two_is_that_of_numpy(name):
    np.testing.assert_allclose(computed(name), BINARY[name](X[:, 0], X[:, 1]).astype(float), rtol=1e-14)


@pytest.mark.parametrize("name", UNARY)
def test_an_operation_of_one_is_that_of_numpy(name):
    np.testing.assert_allclose(computed(name), UNARY[name](X[:, 0]), rtol=1e-12, atol=1e-16)


def test_a_bound_may_be_open_to_one_side():
    np.testing.assert_array_equal(computed("clamp", min=-0.5), np.maximum(X[:, 0], -0.5))
    np.testing.assert_array_equal(computed("clamp", min=-0.5, max=0.3), np.clip(X[:, 0], -0.5, 0.3))


def test_nothing_is_as_large_as_what_is_infinite():
    p = Program(1)
    table, x = elementwise(p), as_cells([p.input(0)], (1,))
    assert table["gt"](math.inf, x)[0] == 1.0
    assert table["gt"](x, math.inf)[0] == 0.0
    assert table["lt"](-math.inf, x)[0] == 1.0


def test_complex_numbers_are_multiplied_divided_and_measured():
    p = Program(2)
    table, z = elementwise(p), Complex(p.input(0), p.input(1))
    cell = np.empty(1, dtype=object)
    cell[0] = z
    want = X[:, 0] + 1j * X[:, 1]
    for found, exact in ((table["mul"](cell, 2 - 1j), want * (2 - 1j)), (table["div"](cell, 2 - 1j), want / (2 - 1j)),
                         (table["conj"](cell), want.conj()), (table["exp"](cell), np.exp(want))):
        got = p.evaluate([found[0].re, found[0].im], X)
        np.testing.assert_allclose(got[:, 0] + 1j * got[:, 1], exact, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(p.evaluate([table["abs"](cell)[0]], X)[:, 0], np.abs(want), rtol=1e-14)
