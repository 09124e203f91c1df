"""Bounds in one operation."""

import numpy as np
import torch
from onnx_session import session

from nnhydro.deployment.onnx.onnx_graph import onnx_model
from nnhydro.deployment.onnx.tracing import trace


def test_bounds_are_one_operation_and_the_square_of_a_root_is_none():
    bounded = {"symmetric": (lambda x: x.clamp(-0.3, 0.3) * 2, "Clip"), "from zero": (lambda x: (3 * x).clamp(0.0, 0.5) + x, "Clip"),
               "uneven": (lambda x: x.clamp(-0.2, 0.3), "Min"), "the wrong way round": (lambda x: x.clamp(min=0.5).clamp(max=-0.5), "Min")}
    x = torch.tensor([-2.0, -0.25, 1e-9, 0.25, 2.0], dtype=torch.float64)
    for name, (function, operation) in bounded.items():
        program, (values,) = trace(lambda x, function=function: (function(x),), [x])
        model = onnx_model(program, {"x": (5,)}, {"y": values}, np.float64, 18, {})
        assert operation in {node.op_type for node in model.graph.node}, name
        got = session(model.SerializeToString()).run(None, {"x": x.numpy()})[0]
        np.testing.assert_allclose(got, function(x).numpy(), rtol=1e-15, err_msg=name)
    program, (values,) = trace(lambda x: (torch.sqrt(x.abs() + 1) ** 2,), [x])
    assert not {"sqrt", "mul"} & {program.atoms[k].kind for k in program.dependencies(list(values))}
