"""What arm.yaml states of friction and drives is part of every baseline."""

import pytest
from rigs import arm, assert_close
from rigs import run as motion

from nnhydro.effects.hypotheses.rotor_inertia import RotorInertia
from nnhydro.models.baselines import BASELINES
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.rotor_inertia import RotorTerm

FRICTION = [{"coulomb_Nm": 0.3, "viscous_Nm_s": 0.2, "known_to": 0.2}, {"coulomb_Nm": 0.1, "known_to": 0.2}]
DRIVE = {"kind": "direct", "rotor_inertia_kg_m2": [0.05, 0.02], "known_to": 0.2}


@pytest.mark.parametrize("name", sorted(BASELINES))
def test_every_baseline_holds_what_arm_yaml_states(name):
    a = arm(2, friction=FRICTION, drive=DRIVE)
    loads = BASELINES[name].start(a)
    assert loads.terms["stated_coulomb_friction"].level == (0.3, 0.1)
    assert loads.terms["stated_viscous_friction"].coefficient == (0.2, 0.0)
    assert loads.terms["stated_rotor_inertia"].inertia == (0.05, 0.02)
    assert not [key for key in BASELINES[name].start(arm(2)).terms if key.startswith("stated_")]


@pytest.mark.parametrize("drive", ["direct", {"kind": "remote", "pulley_ratio": 1.5}])
def test_a_stated_rotor_inertia_is_that_of_the_catalogue(drive):
    a, at = arm(2, drive=drive), motion(2)
    inner = RotorInertia((0.05,), joint=1).columns(Flow(a, at))[..., 0] * 0.05
    other = RotorInertia((0.02,), joint=2).columns(Flow(a, at))[..., 0] * 0.02
    assert_close(RotorTerm((0.05, 0.02)).torque(Flow(a, at)), inner + other)
