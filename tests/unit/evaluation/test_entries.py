"""Who takes part in a benchmark, by name."""

import pytest
from campaigns import GIVEN, TINY, campaign, planted
from rigs import arm

from nnhydro.errors import ConfigError
from nnhydro.evaluation.entries import all_names, default_names, entries
from nnhydro.models.storage import save_model
from nnhydro.models.strip_theory import StripTheory

A = arm(1)
WHOLE = campaign(A, planted(A), 2, seconds=1.0, rate=25.0)


def test_in_air_nobody_takes_part_who_needs_water():
    assert default_names(arm(1, density=0.0)) == ("rigid", "network", "hybrid")
    assert {"constant", "state", "textbook"} < set(default_names(A))


def test_all_are_those_of_the_default_and_every_comparator():
    assert [entry.name for entry in entries(["all"], [WHOLE], TINY)] == list(all_names(A))
    assert {"gp", "mlp-raw"} <= set(all_names(A)) - set(default_names(A))


def test_an_unknown_name_and_one_that_stands_twice_are_refused():
    with pytest.raises(ConfigError, match="unknown model 'constnt'"):
        entries(["constnt"], [WHOLE], TINY)
    with pytest.raises(ConfigError, match="stands twice in gp, gp"):
        entries(["gp", "gp"], [WHOLE], TINY)


def test_a_stored_model_takes_part_as_it_is_if_it_says_what_it_has_seen(tmp_path):
    fit = {"campaign_sha256": "0" * 64, "seen": ["0" * 64]}
    model = StripTheory(A, GIVEN, {}, "constant", planted(A))
    with pytest.raises(ConfigError, match="does not say which recordings it has seen"):
        entries([str(save_model(model, tmp_path / "silent"))], [WHOLE], TINY)
    folder = save_model(StripTheory(A, GIVEN, fit, "constant", planted(A)), tmp_path / "known")
    (entry,) = entries([str(folder)], [WHOLE], TINY)
    assert entry.name == "known"
    assert entry.seen == {"0" * 64}
    with pytest.raises(ConfigError, match="model of 1 joint"):
        entries([str(folder)], [campaign(arm(2), planted(arm(2)), 1, seconds=1.0, rate=25.0)], TINY)
