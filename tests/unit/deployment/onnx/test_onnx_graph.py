"""The graph: atoms that may be infinite stand alone."""

import numpy as np
import pytest

from nnhydro.deployment.onnx.expressions import Program, add
from nnhydro.deployment.onnx.onnx_graph import infinite_atoms, onnx_model


def test_atoms_that_may_be_infinite_are_known():
    p = Program(2)
    x, y = p.input(0), p.input(1)
    ever = p.where(p.apply("positive", x), np.inf, y)
    wild = [ever, p.apply("mul", ever, x), p.apply("max", ever, x), p.apply("exp", ever)]
    tame = [p.apply("min", ever, 5.0), p.apply("div", 1.0, ever), p.apply("exp", p.mul(-1.0, ever)), p.apply("positive", ever)]
    assert infinite_atoms(p) == {k for value in wild for k in value.terms}
    assert not infinite_atoms(p) & {k for value in tame for k in value.terms}


@pytest.mark.parametrize("given", [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
def test_sums_with_something_infinite_are_not_lost_to_their_neighbours(given):
    import onnxruntime

    p = Program(4)
    x = [p.input(k) for k in range(4)]
    ever = [p.where(p.apply("positive", x[k]), np.inf, x[k + 2]) for k in range(2)]
    ends = [p.apply("min", add(ever[0], x[2]), 5.0), p.apply("min", add(ever[1], x[3]), 5.0), p.apply("min", add(x[2], x[3]), 5.0)]
    made = onnx_model(p, {"x": (4,)}, {"y": np.array(ends, dtype=object)}, np.float64, 17, {})
    (got,) = onnxruntime.InferenceSession(made.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, {"x": [*given, 0.5, 0.7]})
    np.testing.assert_allclose(got, [5.0 if given[0] > 0 else 1.0, 5.0 if given[1] > 0 else 1.4, 1.2])
