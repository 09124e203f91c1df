"""The CasADi function: step by step the model's torques, with derivatives that an optimiser can use."""

import numpy as np
import pytest
from campaigns import GIVEN, planted
from rigs import arm, run

from nnhydro.deployment.casadi_step import casadi_function
from nnhydro.deployment.files import export_step
from nnhydro.deployment.step import MemoryStep, inputs_along
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.effects.hypotheses.coulomb_friction import CoulombFriction
from nnhydro.errors import ConfigError
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.travel.state_model import state_loads

casadi = pytest.importorskip("casadi")
ROUNDING = 1e-11  # of the torque: sums in another order
MODELS = {"constant": planted, "state": state_loads,
          "diagnosed": lambda a: planted(a).plus("rub", CoulombFriction(joint=1, level=(0.3,), bending=(0.05,)))}


def theory(a, loads):
    return StripTheory(a, GIVEN, {}, "physics", loads)


@pytest.fixture(scope="module")
def remembers(with_memory):
    """The hybrid with a net that remembers, and its function."""
    return with_memory, casadi_function(with_memory)


def gives_every_step(step, model, std=False):
    """Assert that `step` gives torques, their standard deviation where there is one, and memory of each step of a run of `model`."""
    for given, answer in inputs_along(MemoryStep(model, std), run(2, 40)):
        found = step(*(x.numpy() for x in given))
        for got, want in zip(found if isinstance(found, tuple) else (found,), answer, strict=False):
            np.testing.assert_allclose(np.asarray(got).ravel(), want.numpy().ravel(), atol=ROUNDING * 100, rtol=ROUNDING)


@pytest.mark.parametrize("name", MODELS)
def test_the_function_gives_every_step_of_a_run(name):
    a = arm(2)
    model = theory(a, MODELS[name](a))
    gives_every_step(casadi_function(model), model)


@pytest.mark.slow(seconds=10)
def test_a_hybrid_is_a_function_too(remembers):
    model, step = remembers
    gives_every_step(step, model, std=True)


def test_its_derivatives_are_those_of_the_dynamics():
    a = arm(2)
    model = theory(a, planted(a))
    step, q, qd, qdd = casadi_function(model), [0.3, -0.5], [1.0, 0.2], [2.0, -1.0]
    x = [casadi.SX.sym(name, 2) for name in ("q", "qd", "qdd")]
    tau = step(*x, 0.0, 0.0, -1.0, casadi.SX(0, 1))
    tau = tau[0] if isinstance(tau, tuple) else tau
    slopes = casadi.Function("slopes", x, [casadi.jacobian(tau, symbol) for symbol in x])(q, qd, qdd)
    want = Dynamics(model).jacobians(q, qd, qdd)
    for got, name in zip(slopes, ("q", "qd", "qdd"), strict=True):
        np.testing.assert_allclose(np.asarray(got), getattr(want, name), atol=1e-9)


@pytest.mark.slow
def test_the_derivatives_of_a_hybrid_at_rest_are_finite(remembers):
    _, step = remembers
    x = [casadi.SX.sym(name, 2) for name in ("q", "qd", "qdd")]
    for dt in (-1.0, 0.01):
        given = [0.0, 0.0, dt, casadi.DM.zeros(step.size1_in(6))]
        tau = step(*x, *given)[0]
        slopes = casadi.Function("slopes", x, [casadi.jacobian(tau, symbol) for symbol in x])([0.0] * 2, [0.0] * 2, [0.0] * 2)
        assert all(np.isfinite(np.asarray(slope)).all() for slope in slopes)


@pytest.mark.slow
def test_a_file_holds_the_same_function(tmp_path):
    a = arm(2)
    model = theory(a, state_loads(a))
    told = export_step(model, tmp_path / "arm.casadi", "casadi")
    assert told["outputs"] == {"tau": 2, "memory_next": told["inputs"]["memory"]}
    again, made = casadi.Function.deserialize((tmp_path / "arm.casadi").read_text()), casadi_function(model)
    given = [[0.1, 0.2], [1.0, -0.5], [0.3, 0.4], 0.0, 0.0, -1.0, np.zeros(told["inputs"]["memory"])]
    np.testing.assert_array_equal(np.asarray(again(*given)[0]), np.asarray(made(*given)[0]))
    with pytest.raises(ConfigError, match="is a folder"):
        export_step(model, tmp_path, "casadi")
