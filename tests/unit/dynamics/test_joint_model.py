"""The mechanics in a model: no sensors, no drive, and terms that can be stepped."""

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted
from rigs import arm, run, states

import nnhydro
from nnhydro.dynamics.joint_model import SteppedTravel, fast_stepper, joint_model
from nnhydro.effects.hypotheses.ambient_current import AmbientCurrent
from nnhydro.effects.hypotheses.load_friction import LoadFriction
from nnhydro.effects.hypotheses.torque_bias import TorqueBias
from nnhydro.effects.hypotheses.vortex_shedding import VortexShedding
from nnhydro.effects.in_sector import InSector
from nnhydro.errors import ModelError
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.travel.state_model import state_loads


def theory(a, loads=None, instruments=()):
    return StripTheory(a, GIVEN, {}, "physics", planted(a) if loads is None else loads, tuple(instruments))


def test_sensors_are_no_mechanics_but_currents_and_load_friction_are():
    a = arm(2)
    instruments = (TorqueBias(joint=1, offset=(0.5,)), AmbientCurrent((0.2,), (0.1,)), LoadFriction(joint=2, coefficient=(0.1,)))
    loads = planted(a).plus("hum", VortexShedding((0.2,) * 2, (0.1,) * 2, (0.2,), (0.0,)))
    dynamics = nnhydro.Dynamics(theory(a, loads, instruments))
    assert [line.split(":")[0] for line in dynamics.left_out] == ["hum", "torque_bias"]
    plain = nnhydro.Dynamics(theory(a, planted(a), instruments[1:]))
    s = states(2, 10)
    q, qd, qdd = (x.numpy() for x in (s.q, s.qd, s.qdd))
    tau = dynamics.inverse_dynamics(q, qd, qdd)
    np.testing.assert_allclose(tau, plain.inverse_dynamics(q, qd, qdd), atol=1e-12)
    np.testing.assert_allclose(dynamics.forward_dynamics(q, qd, tau), qdd, atol=1e-9)


def test_gears_and_belts_are_taken_off():
    a = arm(2, drive={"kind": "remote", "pulley_ratio": 1.5}, gear={"ratio": 20.0, "efficiency": 0.8, "torque_at": "motor"})
    plain = arm(2)
    s = states(2, 10)
    q, qd, qdd = (x.numpy() for x in (s.q, s.qd, s.qdd))
    instruments = (LoadFriction(joint=2, coefficient=(0.0,)),)
    for given in ((), instruments):
        np.testing.assert_allclose(nnhydro.Dynamics(theory(a, planted(a), given)).inverse_dynamics(q, qd, qdd),
                                   nnhydro.Dynamics(theory(plain)).inverse_dynamics(q, qd, qdd), atol=1e-10)


def test_a_stepper_of_a_travel_term_gives_the_torque_of_the_term():
    a, motion = arm(2), run(2)
    for term in state_loads(a).terms.values():
        torch.testing.assert_close(fast_stepper(term).torque(Flow(a, motion)), term.torque(Flow(a, motion)))
    fast = fast_stepper(InSector(1, 0.0, None, state_loads(a).terms["state_drag"]))
    assert isinstance(fast.term, SteppedTravel)


def test_a_correction_of_torques_that_were_simulated_elsewhere_is_no_dynamics():
    before = theory(arm(1))
    with pytest.raises(ModelError, match="correction of torques that were simulated elsewhere"):
        joint_model(CorrectedSimulation(arm(1), GIVEN, {}, None, before, before))
