"""What torch does is recorded exactly, or named."""

import numpy as np
import pytest
import torch
from onnx_session import session

from nnhydro.deployment.onnx.onnx_graph import onnx_model
from nnhydro.deployment.onnx.tracing import trace
from nnhydro.errors import ModelError

OPERATIONS = {
    "arithmetic": lambda x: (2 - x) * x / (x.abs() + 1) + x**2 - x**3 + x**4 / 3 + 1 / (2 + x**2) - (-x),
    "powers": lambda x: (x.abs() + 0.1) ** 0.5 + (x.abs() + 1) ** -1.5 + 2.0**x + torch.rsqrt(x.abs() + 1),
    "functions": lambda x: torch.tanh(x) + torch.sin(x) * torch.cos(x) + torch.exp(x) + torch.log10(1 + x.abs()) + torch.sigmoid(x),
    "bounds": lambda x: torch.minimum(x.clamp(min=-0.5), x * 2) + torch.maximum(x, -x) + x.clamp(-0.2, 0.3) + x.clamp(max=0.1),
    "comparisons": lambda x: torch.where((x > 0) & (x <= 1), x, -x) + (x != 0) * x + torch.sign(x) + torch.where(x == 0, x, 2 * x),
    "sums": lambda x: x.sum(0, keepdim=True) + x.mean(1, keepdim=True) + x.cumsum(1) + x.std(dim=0) + x.amax(1, keepdim=True),
    "products": lambda x: x @ x.T @ x + torch.einsum("ij,kj->ik", x, x) @ x + torch.bmm(x[None], x.T[None])[0] @ x,
    "shapes": lambda x: torch.cat([x.flip(0), x[1:, :]]).T.reshape(-1)[:9].view(3, 3) + torch.stack([x[0], x[2], x[1]]) + x.expand(3, 3),
    "indices": lambda x: x[torch.tensor([2, 0, 1])] + x[:, torch.tensor([1, 1, 0])],
    "complex": lambda x: (torch.exp(1j * x) * (x + 2j * x) / (1 + 1j * x)).imag + torch.exp(1j * x).real * (x + 1j * x).abs(),
    "lengths": lambda x: torch.hypot(x, x + 1) + torch.hypot(torch.ones_like(x), x / 3),
}


def in_place(x):
    y = torch.zeros(3, 4, dtype=torch.float64)
    y[:, 1] = x[:, 0]
    y[0, 2:] += x[0, :2]
    y.mul_(2)
    return y[:, :3] + x.clone().fill_(1.5)


@pytest.mark.parametrize("function", [*OPERATIONS.values(), in_place], ids=[*OPERATIONS, "in place"])
def test_what_torch_does_is_recorded_exactly(function):
    g = torch.Generator().manual_seed(1)
    first, *others = (torch.randn(3, 3, generator=g, dtype=torch.float64) for _ in range(6))
    program, (values,) = trace(lambda x: (function(x),), [first])
    got = program.evaluate(list(values.ravel()), np.stack([x.numpy().ravel() for x in others]))
    for row, x in zip(got, others, strict=True):
        np.testing.assert_allclose(row, function(x).numpy().ravel(), rtol=1e-12, atol=1e-13)
    made = session(onnx_model(program, {"x": (3, 3)}, {"y": values}, np.float64, 18, {}).SerializeToString())
    for x in others:
        np.testing.assert_allclose(made.run(None, {"x": x.numpy()})[0], function(x).numpy(), rtol=1e-12, atol=1e-13)


def test_an_operation_without_a_rule_is_named():
    with pytest.raises(ModelError, match="cummax"):
        trace(lambda x: (x.cummax(0).values,), [torch.ones(2, dtype=torch.float64)])
