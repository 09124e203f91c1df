"""What every model is, where a model says nothing else."""

from dataclasses import dataclass

import pytest
import torch
from campaigns import GIVEN
from rigs import arm, run

from nnhydro.models.torque_model import TorqueModel


@dataclass(frozen=True, eq=False)
class Zero(TorqueModel):
    """No torque at all."""

    def torque(self, motion):
        return torch.zeros_like(motion.q)

    def document(self):
        return {}


def test_a_model_that_knows_no_deviation_gives_none_beside_its_torque():
    model = Zero(arm(2), GIVEN, {})
    torque, std = model.torque_and_std(run(2))
    assert torch.equal(torque, torch.zeros(60, 2, dtype=torch.float64))
    assert std is None
    assert model.arrays() == {}


def test_a_deviation_of_ones_own_is_given_beside_the_torque():
    class Doubtful(Zero):
        def std(self, motion):
            return torch.ones_like(motion.q)

    assert bool((Doubtful(arm(2), GIVEN, {}).torque_and_std(run(2))[1] == 1).all())


def test_a_model_without_a_torque_cannot_be_made():
    with pytest.raises(TypeError, match="abstract"):
        TorqueModel(arm(2), GIVEN, {})
