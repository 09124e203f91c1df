"""Every term without a memory is compiled."""

import pytest
import torch
from compiled_models import WITHOUT_MEMORY, assert_equal, model_of, one_by_one
from rigs import arm, states

from nnhydro.deployment.compiled.torque import compile_model
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import term_kinds
from nnhydro.physics.loads.rigid_body import RigidBody


@pytest.mark.parametrize("kind", WITHOUT_MEMORY)
@pytest.mark.parametrize("links", [1, 2, 3])
def test_every_term_without_a_memory_is_compiled(kind, links):
    a = arm(links, gravity_m_s2=0.3)
    loads = Loads({"rigid_body": RigidBody.of_arm(a)}).plus("term", term_kinds()[kind].at_start(a))
    made = compile_model(model_of(a, loads=loads), "numpy")
    assert_equal(made, states(links, 200))
    torch.testing.assert_close(one_by_one(made, states(links, 20)), made.model.torque(states(links, 20)), rtol=1e-11, atol=1e-11)
