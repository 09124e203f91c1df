"""Rivera's identifier: the network itself and what it is shown."""

from dataclasses import replace

import pytest
import torch
from campaigns import GIVEN, campaign, planted
from rigs import arm

from nnhydro.evaluation import reproduce_rivera as study
from nnhydro.evaluation.rivera import Identifier, TrainingSet, train_network
from nnhydro.fitting.linear.several_arms import calibrated_on
from nnhydro.models.baselines import BASELINES
from nnhydro.models.gains.matrix import gain_matrix
from nnhydro.physics.motion import Motion
from nnhydro.recordings.splitting import units

A = arm(2)
SMALL = campaign(A, planted(A), 5, seconds=2.0, rate=25.0)
QUICK = Identifier(study.INPUT_SETS[study.USUAL], epochs=3, neurons=4)


def shown():
    return TrainingSet(units(SMALL, GIVEN), A)


@pytest.mark.parametrize("layers", study.LAYERS)
def test_the_network_is_a_layer_of_tanh_with_a_linear_output_and_nothing_beside(layers):
    network = train_network(replace(QUICK, layers=layers), [shown()], GIVEN)
    assert network.baseline is None
    assert network.law is None
    assert not network.skip.any()
    assert network.ensemble.hidden == (4,)
    assert len(network.ensemble.weights[0]) == (2 if layers == "common" else 4), "a stack a member, or a member and torque"


def test_its_gain_matrix_is_the_slope_of_its_torque():
    network = train_network(QUICK, [shown()], GIVEN)
    at = Motion.at([[0.4, -0.3]], [[0.8, 0.5]], [[1.0, -2.0]], [0.2], [0.1])
    further = Motion.at([[0.4, -0.3]], [[0.8, 0.5 + 1e-5]], [[1.0, -2.0]], [0.2], [0.1])
    slope = (network.torque(further) - network.torque(at)) / 1e-5
    torch.testing.assert_close(gain_matrix(network, at).qd[:, :, 1], slope, rtol=1e-3, atol=1e-3)


def test_an_analytic_torque_takes_the_place_of_the_measured_one():
    base = calibrated_on(BASELINES["constant"], shown().units, A, GIVEN)
    taught = replace(shown(), truth=base)
    assert taught.error(base) == pytest.approx(0.0, abs=1e-9)
    dry = calibrated_on(BASELINES["rigid"], shown().units, A, GIVEN)
    assert 0.05 < taught.error(dry) < 2.0
