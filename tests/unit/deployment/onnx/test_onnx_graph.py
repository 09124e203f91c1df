"""The graph: what may be infinite stands alone, and what is asked for late is left behind."""

import numpy as np
import pytest
from onnx import TensorProto

from nnhydro.deployment.onnx.expressions import Program, add, combine, scale
from nnhydro.deployment.onnx.onnx_graph import onnx_model


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


def test_what_is_asked_for_late_is_not_copied_before():
    import onnxruntime

    late, rng = 3000, np.random.default_rng(0)
    p = Program(late + 2)
    y = p.unary("tanh", add(p.input(late), p.input(late + 1)))
    for _ in range(12):
        y = p.unary("tanh", add(p.mul(y, y), p.input(late)))
    made = onnx_model(p, {"x": (late,), "y": (2,)}, {"z": np.array([p.mul(y, p.input(k)) for k in range(late)])}, np.float64, 17, {})
    assert not [node for node in made.graph.node if node.op_type == "Concat" and "x" in node.input]
    given = {"x": rng.standard_normal(late), "y": rng.standard_normal(2)}
    want = np.tanh(given["y"].sum())
    for _ in range(12):
        want = np.tanh(want**2 + given["y"][0])
    (got,) = onnxruntime.InferenceSession(made.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, given)
    np.testing.assert_allclose(got, want * given["x"])


@pytest.mark.parametrize(("sets", "matrices"), [(20, 1), (1, 0)])
def test_a_law_of_nine_terms_on_many_strips_is_one_product_and_a_few_such_sums_are_none(sets, matrices):
    rng, p = np.random.default_rng(0), Program(9 * sets)
    W = rng.standard_normal((40 if sets > 1 else 2, 9))
    sums = [combine([(c, p.input(9 * s + k)) for k, c in enumerate(row)]) for s in range(sets) for row in W]
    made = onnx_model(p, {"x": (9 * sets,)}, {"y": np.array([p.unary("tanh", x) for x in sums])}, np.float64, 17, {})
    assert [node.op_type for node in made.graph.node if node.op_type in ("MatMul", "ReduceSum")] == ["MatMul"]
    assert sum(len(x.dims) == 2 and list(x.dims) == [9, 40] for x in made.graph.initializer) == matrices


def test_a_long_sum_that_contains_another_takes_it_as_one_term():
    import onnxruntime

    rng, p, sets = np.random.default_rng(0), Program(36 * 20), 20
    x, W = [p.input(k) for k in range(36 * sets)], rng.standard_normal((20, 16))
    sums = [[combine(list(zip(row, x[36 * s:], strict=False))) for row in W] for s in range(sets)]
    longer = [add(scale(value, -0.5), x[36 * s + 16 + k]) for s in range(sets) for k, value in enumerate(sums[s])]
    values = [p.unary("tanh", value) for value in [*(value for own in sums for value in own), *longer]]
    made = onnx_model(p, {"x": (36 * sets,)}, {"y": np.array(values)}, np.float64, 17, {})
    assert max(int(np.prod(i.dims)) for i in made.graph.initializer if i.data_type == TensorProto.INT32) == 2 * len(longer)
    given = rng.standard_normal(36 * sets)
    (got,) = onnxruntime.InferenceSession(made.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, {"x": given})
    each = given.reshape(sets, 36)
    short = each[:, :16] @ W.T
    np.testing.assert_allclose(got, np.tanh([*short.ravel(), *(each[:, 16:] - short / 2).ravel()]), rtol=1e-12)


def test_numbers_are_not_gathered_and_equal_operands_are_one():
    p = Program(3)
    made = onnx_model(p, {"x": (3,)}, {"y": np.array([p.apply("max", p.input(k), 0.3) for k in range(3)])}, np.float64, 17, {})
    assert [node.op_type for node in made.graph.node] == ["Max", "Reshape"]
    made = onnx_model(p, {"x": (3,)}, {"y": np.array([p.where(p.input(0), p.input(k), p.input(2)) for k in (1, 0)])}, np.float64, 17, {})
    (where,) = [node for node in made.graph.node if node.op_type == "Where"]
    (asked,) = [node for node in made.graph.node if node.output[0] == where.input[0]]
    (gathered,) = [node for node in made.graph.node if node.output[0] == asked.input[0]]
    (index,) = [x for x in made.graph.initializer if x.name == gathered.input[1]]
    assert list(index.dims) == [1]
