"""The search for a training's choices is nested: what judges the winner takes no part in the search."""

from importlib.util import find_spec

import pytest
from campaigns import TINY, campaign, planted, with_torque
from rigs import arm

from nnhydro.errors import CampaignError, ConfigError
from nnhydro.evaluation.metrics import Misfit
from nnhydro.evaluation.model_errors import misfit_of
from nnhydro.fitting.hyperparameters import _suggest, search

needs_optuna = pytest.mark.skipif(find_spec("optuna") is None, reason="no optuna here")
FAST = TINY.model_copy(update={"epochs": 1, "members": 1, "features": ("morison", "groups")})
RANGES = {"hidden": [(4,), (8,)], "weight_decay": [0.01, 10.0]}


def error(model, chosen):
    return Misfit.total(misfit_of(model, unit) for unit in chosen).error


def small(count=8):
    return campaign(arm(1), planted(arm(1)), count, noise=0.02, seconds=2.0, rate=25.0)


@needs_optuna
def test_the_winner_is_the_best_trial_and_lies_within_the_ranges():
    found = search(small(), FAST, RANGES, 3, error)
    assert len(found.trials) == 3
    assert found.inner_error == min(e for _, e in found.trials)
    assert found.config.hidden in RANGES["hidden"]
    assert 0.01 <= found.config.weight_decay <= 10.0
    assert found.document()["held_out"] == list(found.held_out)


@needs_optuna
def test_torques_that_are_put_aside_do_not_change_the_search():
    whole = small()
    found = search(whole, FAST, RANGES, 2, error)
    hidden = set(found.held_out)
    wild = with_torque(whole, lambda name, tau: 50 * tau[::-1] + 3 if name in hidden else tau)
    again = search(wild, FAST, RANGES, 2, error)
    assert again.trials == found.trials
    assert again.config == found.config
    assert again.held_out_error != found.held_out_error


@needs_optuna
def test_too_few_motions_and_unknown_choices_are_refused():
    with pytest.raises(CampaignError, match="nested search"):
        search(small(4), FAST, RANGES, 1, error)
    with pytest.raises((ConfigError, ValueError), match="magic"):
        search(small(), FAST, {"magic": ["a", "b"]}, 1, error)


def test_two_floats_are_the_ends_of_a_range_and_all_else_is_a_list_of_values():
    asked = []

    class Trial:
        def suggest_float(self, name, low, high, log):
            asked.append((name, low, high, log))
            return 0.5

        def suggest_categorical(self, name, places):
            asked.append((name, places))
            return places[-1]

    made = _suggest(Trial(), {"rate": (0.1, 1.0), "hidden": ((8,), (16, 16)), "epochs": (10, 20), "three": (0.1, 0.2, 0.3)})
    assert made == {"rate": 0.5, "hidden": (16, 16), "epochs": 20, "three": 0.3}
    assert asked[0] == ("rate", 0.1, 1.0, True)


def test_a_fold_is_judged_by_a_model_that_has_not_seen_it(monkeypatch):
    from nnhydro.fitting import hyperparameters as search

    monkeypatch.setattr(search, "train_units", lambda chosen, *given: [*chosen])
    seen = search._fold_error(["a", "b", "c", "d"], [1, 3], None, None, None, lambda model, judged: (model, judged))
    assert seen == (["a", "c"], ["b", "d"])
