"""The analytic model: a sum of terms, seen through belt and gears, with the faults of the sensors last."""

import pytest
import torch
from campaigns import GIVEN, planted
from rigs import arm, assert_close, run

from nnhydro.effects.hypotheses.torque_bias import TorqueBias
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.transmission import sensor_torque

BELT = {"kind": "remote", "pulley_ratio": 1.5}


def theory(a, *instruments):
    return StripTheory(a, GIVEN, {}, "constant", planted(a), instruments)


@pytest.mark.parametrize("drive", [{"kind": "direct"}, BELT])
def test_the_terms_add_up_to_the_torque_at_the_drives(drive):
    a, motion = arm(2, drive=drive), run(2)
    shares = theory(a).by_term(motion)
    assert set(shares) == {"rigid_body", "normal_drag", "added_mass"}
    assert_close(sum(shares.values()), theory(a).torque(motion))


def test_the_sensors_read_behind_belt_and_gear():
    a, motion = arm(2, drive=BELT, gear={"ratio": 5.0, "torque_at": "motor"}), run(2)
    assert_close(theory(a).torque(motion), sensor_torque(planted(a).torque(Flow(a, motion)), motion.qd, a))


def test_a_fault_of_a_sensor_is_read_and_no_share_of_a_term():
    a, motion = arm(2), run(2)
    faulty = theory(a, TorqueBias(joint=2, offset=(0.4,)))
    assert_close(faulty.torque(motion) - theory(a).torque(motion), torch.tensor([0.0, 0.4], dtype=torch.float64).expand(60, 2))
    assert_close(sum(faulty.by_term(motion).values()), theory(a).torque(motion))
    assert faulty.document()["instruments"] == [TorqueBias(joint=2, offset=(0.4,)).document()]
