"""Coefficients over the travel are compiled for runs and for steady rows."""

import pytest
from compiled_models import assert_equal, model_of
from rigs import arm, run, states

from nnhydro.deployment.compiled.torque import compile_model
from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow


@pytest.mark.slow
def test_the_travel_is_compiled_for_runs_and_steady_rows_and_one_state_does_not_tell_it():
    pytest.importorskip("numba")
    links = 3
    made = compile_model(model_of(arm(links), "state"))
    with pytest.raises(ModelError, match="travel s/D, which one state does not tell"):
        made.step(*[0.1] * (3 * links + 2))
    assert Flow(arm(links), states(links, 50)).motion.steady
    for motion in (states(links, 500), run(links, 333), run(links, 9001), run(links, 1)):
        assert_equal(made, motion)
