"""On-line adaptation: coefficients found while the arm moves, within their bounds."""

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted
from rigs import arm

import nnhydro.simulation.gym_env  # noqa: F401  # makes the environment known
from nnhydro.effects.hypotheses.payload_mass import PayloadMass
from nnhydro.errors import ConfigError
from nnhydro.fitting.linear.recursive import RecursiveFit
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.motion import Motion, tensor


def theory(a, loads):
    return StripTheory(a, GIVEN, {}, "physics", loads)


def measured(a, loads, seconds=6.0, dt=0.01, seed=0, payload=None):
    """q, qd, qdd, tau of a motion from rest; a payload is picked up half-way."""
    t = np.arange(0, seconds, dt)
    w, size = np.array([2.1, 3.3]), np.array([0.7, 0.6])
    q, qd, qdd = size * (1 - np.cos(w * t[:, None])), size * w * np.sin(w * t[:, None]), size * w**2 * np.cos(w * t[:, None])
    still = torch.zeros(len(t), dtype=torch.float64)
    motion = Motion(tensor(t), tensor(q), tensor(qd), tensor(qdd), still, still)
    tau = loads.torque(Flow(a, motion)).numpy()
    if payload is not None:
        tau[len(t) // 2:] += payload.torque(Flow(a, motion)).numpy()[len(t) // 2:]
    return q, qd, qdd, tau + 0.02 * np.random.default_rng(seed).standard_normal(tau.shape)


@pytest.mark.slow
def test_coefficients_are_found_while_the_arm_moves_and_their_deviations_hold():
    a, adapted = arm(2), ["normal_drag", "added_mass", "rub"]
    begin, true = planted(a, (0.5,) * 3, (0.2,) * 3).plus("rub", ViscousTerm((0.0, 0.0))), planted(a).plus("rub", ViscousTerm((0.3, 0.1)))
    fit = RecursiveFit(theory(a, begin), adapted, std=1.0, noise_Nm=0.02, forgetting=1.0)
    for row in zip(*measured(a, true), strict=True):
        fit.update(*row, dt=0.01)
    for found, want in zip(fit.coefficients, (0.9, 1.3, 0.8, 0.6, 0.3, 0.1), strict=True):
        assert abs(found.value - want) < 4 * found.std + 1e-6
        assert found.std < 0.05
    np.testing.assert_allclose(fit.covariance, fit.covariance.T)


@pytest.mark.slow
def test_a_payload_picked_up_in_mid_run_is_tracked():
    a = arm(2)
    loads = planted(a)
    model = theory(a, loads.plus("payload", PayloadMass((0.0,), (0.0,))))
    fit, said = RecursiveFit(model, ["payload"], std=1.0, noise_Nm=0.02, forgetting=0.97), []
    for row in zip(*measured(a, loads, payload=PayloadMass((0.4,), (0.0,))), strict=True):
        off = fit.update(*row, dt=0.01)
        said.append(fit.coefficients[0].value)
    half = len(said) // 2
    assert abs(said[half - 1]) < 0.02
    assert abs(said[half + 150] - 0.4) < 0.03
    assert np.abs(off).max() < 0.2
    assert fit.adapted_loads().terms["payload"].linear_values()[0] == said[-1]


def test_nothing_leaves_its_bounds_and_nothing_grows_without_excitation():
    a = arm(2)
    fit = RecursiveFit(theory(a, planted(a)), ["normal_drag"], std=0.5, noise_Nm=0.02, forgetting=0.9)
    q, qd, qdd, tau = measured(a, planted(a))
    for k in range(50):
        fit.update(q[k], qd[k], qdd[k], tau[k] - 5.0 * np.sign(qd[k]), dt=0.01)
    assert all(c.bounds[0] <= c.value <= c.bounds[1] for c in fit.coefficients)
    for _ in range(300):
        fit.update([0.1, 0.2], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], dt=0.01)
    assert all(c.std <= 0.5 + 1e-12 for c in fit.coefficients)
    with pytest.raises(ConfigError, match="not a linear term"):
        RecursiveFit(theory(a, planted(a)), ["drag"])
