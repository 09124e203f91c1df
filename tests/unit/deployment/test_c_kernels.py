"""The functions and the products that the C header brings along are those of numpy to a few last digits."""

import numpy as np
import pytest
from c_programs import in_c

from nnhydro.deployment import c_kernels, c_program
from nnhydro.deployment.c_program import c_function
from nnhydro.deployment.native import compiler
from nnhydro.deployment.onnx.expressions import Program, combine

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler here")


@pytest.mark.parametrize("without", [(), ("x512",), ("x512", "x256")], ids=["any", "256 bits", "none"])
def test_each_processor_s_own_program_gives_the_same(without, tmp_path, monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)
    for kind in without:
        monkeypatch.delitem(c_kernels.WIDER, kind)
    rng, program = np.random.default_rng(0), Program(30)
    W, x = rng.standard_normal((24, 30)), rng.standard_normal(30)
    outputs = [program.unary("tanh", combine([(c, program.input(k)) for k, c in enumerate(row)])) for row in W]
    text = c_function("void run", program, outputs, "double")
    assert text.count("__builtin_cpu_supports") == 4 - 2 * len(without)
    np.testing.assert_allclose(in_c(tmp_path, program, outputs)(x), np.tanh(W @ x), rtol=1e-13)
