"""Coefficients fitted on some arms predict another, whose masses they take."""

import pytest
from campaigns import GIVEN, campaign, planted, unlike_arms
from rigs import arm, scaled

from nnhydro.errors import CampaignError
from nnhydro.evaluation.model_errors import misfit_of
from nnhydro.evaluation.protocols.protocol import Material, protocols
from nnhydro.fitting.linear.several_arms import calibrated_on, on_arm
from nnhydro.models.baselines import baseline
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.recordings.splitting import units


def material(*campaigns, groups=None, fold_count=3):
    return Material(campaigns, (GIVEN,) * len(campaigns), tuple(groups or {} for _ in campaigns), fold_count, 0)


def test_coefficients_fitted_on_some_arms_predict_another():
    whole = unlike_arms()
    split = protocols()["leave-arm-out"].split(material(*whole))
    assert [fold.name for fold in split.folds] == ["arm0-1", "arm1-2", "arm2-3"]
    for fold in split.folds:
        model = calibrated_on(baseline("constant"), [split.units[i] for i in fold.fitted], whole[0].arm, GIVEN)
        errors = [misfit_of(model, split.units[i]).error for i in fold.held_out]
        assert max(errors) < 1e-6


def test_a_model_on_another_arm_takes_its_masses():
    small, large = arm(2), scaled(arm(2), 1.5)
    model = calibrated_on(baseline("constant"), units(campaign(small, planted(small), 3, seconds=2.0, rate=50.0), GIVEN), small, GIVEN)
    moved = on_arm(model, large)
    assert moved.loads.terms["rigid_body"] == RigidBody.of_arm(large)
    assert moved.loads.terms["normal_drag"] == model.loads.terms["normal_drag"]
    with pytest.raises(CampaignError, match="equally many joints"):
        on_arm(model, arm(3))
