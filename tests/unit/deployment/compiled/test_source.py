"""A program written out as Python statements: it computes what the program computes."""

import math

import numpy as np
import pytest

from nnhydro.deployment.compiled.source import ARRAYS, INLINE, Writer
from nnhydro.deployment.onnx.expressions import Program, add, combine


def some_program():
    """Products, bounds, choices and a sum that is used twice."""
    p = Program(3)
    x, y, z = (p.input(k) for k in range(3))
    both = combine([(2.0, x), (-1.0, y), (0.5, 1.0)])
    outputs = [p.mul(both, z), p.apply("max", both, z), p.where(p.apply("positive", z), x, y), p.unary("sigmoid", add(x, 1.0)),
               p.apply("maxof", x, y, z), p.apply("sign", both), p.div(x, add(p.mul(y, y), 1.0)), 3.0]
    return p, outputs


@pytest.mark.parametrize("forms", [INLINE, ARRAYS], ids=["a number", "arrays"])
def test_the_statements_give_what_the_program_gives(forms):
    program, outputs = some_program()
    lines, results = Writer(program, forms, [f"given[{k}]" for k in range(3)]).statements(outputs)
    for given in np.random.default_rng(1).standard_normal((20, 3)):
        names = {"given": given.tolist(), "exp": math.exp, "larger": max, "smaller": min, "sign": lambda x: math.copysign(1.0, x),
                 "chosen": lambda c, a, b: a if c else b}
        exec("\n".join(lines), names)
        got = [eval(result, names) for result in results]
        np.testing.assert_allclose(got, program.evaluate(outputs, given[None])[0], rtol=1e-14)


def test_a_sum_that_is_needed_twice_is_computed_once():
    program, outputs = some_program()
    lines, _ = Writer(program, INLINE, ["a", "b", "c"]).statements(outputs)
    assert sum("2.0*x0" in line for line in lines) == 1
    assert any(line.startswith("s0 = ") for line in lines)


def test_what_nobody_asks_for_is_not_written():
    program, outputs = some_program()
    lines, results = Writer(program, INLINE, ["a", "b", "c"]).statements(outputs[:1])
    assert not any("exp" in line for line in lines)
    assert len(results) == 1


def test_a_number_that_is_infinite_can_be_read_back():
    p = Program(1)
    _, (text,) = Writer(p, INLINE, ["a"]).statements([-math.inf])
    assert eval(text) == -math.inf
