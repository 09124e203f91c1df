"""The search for a training's choices is nested: what judges the winner takes no part in the search."""

import pytest
from campaigns import TINY, campaign, planted, with_torque
from rigs import arm

from nnhydro.errors import CampaignError, ConfigError
from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.model_errors import misfit_of
from nnhydro.fitting.hyperparameters import search

pytest.importorskip("optuna")
FAST = TINY.model_copy(update={"epochs": 1, "members": 1, "features": ("morison", "groups")})
RANGES = {"hidden": [(4,), (8,)], "weight_decay": [0.01, 10.0]}


def error(model, chosen):
    return Misfit.total(misfit_of(model, unit) for unit in chosen).error


def small(count=8):
    return campaign(arm(1), planted(arm(1)), count, noise=0.02, seconds=2.0, rate=25.0)


def test_the_winner_is_the_best_trial_and_lies_within_the_ranges():
    found = search(small(), FAST, RANGES, 3, error)
    assert len(found.trials) == 3
    assert found.inner_error == min(e for _, e in found.trials)
    assert found.config.hidden in RANGES["hidden"]
    assert 0.01 <= found.config.weight_decay <= 10.0
    assert found.document()["held_out"] == list(found.held_out)


def test_torques_that_are_put_aside_do_not_change_the_search():
    whole = small()
    found = search(whole, FAST, RANGES, 2, error)
    hidden = set(found.held_out)
    wild = with_torque(whole, lambda name, tau: 50 * tau[::-1] + 3 if name in hidden else tau)
    again = search(wild, FAST, RANGES, 2, error)
    assert again.trials == found.trials
    assert again.config == found.config
    assert again.held_out_error != found.held_out_error


def test_too_few_motions_and_unknown_choices_are_refused():
    with pytest.raises(CampaignError, match="nested search"):
        search(small(4), FAST, RANGES, 1, error)
    with pytest.raises((ConfigError, ValueError), match="magic"):
        search(small(), FAST, {"magic": ["a", "b"]}, 1, error)
