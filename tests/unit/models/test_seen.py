"""What a model has seen is known recording by recording, whatever the file is called, and through every baseline it stands on."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import TINY, campaign, planted, recording, steady_table
from rigs import arm

from nnhydro.errors import CampaignError, ConfigError
from nnhydro.evaluation.benchmark import BenchmarkOptions
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.seen import SEEN, marks_seen_by, seen_campaign, seen_names
from nnhydro.models.storage import load_model, save_model
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.content_hash import content_sha256, exact, steady_sha256
from nnhydro.recordings.repeats import copied_recordings, noise_floor

A = arm(1)


def runs(numbers, prefix="run"):
    return [recording(A, planted(A), f"{prefix}{k}", seed=k, seconds=2.0, rate=50.0, noise=0.02) for k in numbers]


def contents(recordings):
    return frozenset(content_sha256(r) for r in recordings)


@pytest.mark.parametrize("kind", ["constant", "network", "hybrid"])
def test_a_stored_model_says_every_recording_that_its_fit_has_seen(kind, tmp_path):
    whole = Campaign.of(A, runs(range(1, 5)), (steady_table(A, planted(A), rows=5),))
    model = identify(whole, "constant") if kind == "constant" else train(whole, TINY.model_copy(update={"model": kind}))
    loaded = load_model(save_model(model, tmp_path / "m"))
    assert exact(marks_seen_by(loaded)) == contents(whole.recordings()) | set(steady_sha256(whole.steady[0]))


def test_a_hybrid_has_seen_what_its_baseline_has_seen(tmp_path):
    base = save_model(identify(Campaign.of(A, runs([1, 2, 3])), "constant"), tmp_path / "base")
    config = TINY.model_copy(update={"model": "hybrid", "baseline": str(base)})
    model = train(Campaign.of(A, runs([4, 5, 6])), config)
    assert exact(marks_seen_by(model)) == contents(runs(range(1, 7)))


def test_what_is_not_fitted_has_seen_nothing():
    assert marks_seen_by(identify(Campaign.of(A, runs([1, 2])), "textbook")) == frozenset()


def test_a_model_whose_baseline_says_nothing_says_nothing_either():
    base = identify(Campaign.of(A, runs([1, 2])), "constant")
    assert seen_campaign(Campaign.of(A, runs([3])), replace(base, fit={})) is None
    assert exact(seen_campaign(Campaign.of(A, runs([3])), base)) == contents(runs([1, 2, 3]))
    assert marks_seen_by(replace(base, fit={})) is None


def test_what_a_model_has_seen_of_a_campaign_is_known_under_other_names():
    model = identify(Campaign.of(A, runs([1, 2, 3])), "constant")
    mixed = Campaign.of(A, runs([3, 4, 5], "renamed"))
    assert seen_names(model, mixed) == ("renamed3",)
    assert seen_names(replace(model, fit={}), mixed) is None


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    return save_model(identify(Campaign.of(A, runs([1, 2, 3])), "constant"), tmp_path_factory.mktemp("m") / "first")


def test_a_renamed_arm_and_one_recording_more_do_not_make_recordings_new(fitted):
    """The old guard compared one sha256 of the whole campaign: this campaign passed as new."""
    other = A.model_copy(update={"name": "another name"})
    result = BenchmarkOptions(["constant", str(fitted)], 3).benchmark(Campaign.of(other, runs([1, 2, 3, 4, 5], "x")))
    assert set(result.standings["first"].misfit) == set(result.standings["constant"].misfit) == {"x4", "x5"}
    assert result.document()["seen_before"] == {"first": ["x1", "x2", "x3"]}
    assert "3 recordings not compared, because first had been fitted to them: x1, x2, x3." in result.verdict()


def test_a_campaign_that_the_model_has_seen_whole_is_refused(fitted):
    with pytest.raises(CampaignError, match=r"first: has seen 3 of the 3 recordings here in its own fit"):
        BenchmarkOptions([str(fitted)], 3).benchmark(Campaign.of(A, runs([3, 2, 1], "y")))


def test_a_model_that_does_not_say_what_it_has_seen_is_refused(tmp_path):
    silent = replace(identify(Campaign.of(A, runs([1, 2])), "constant"), fit={})
    folder = save_model(silent, tmp_path / "silent")
    with pytest.raises(ConfigError, match="does not say which recordings it has seen"):
        BenchmarkOptions([str(folder)], 3).benchmark(Campaign.of(A, runs([4, 5, 6])))
    assert SEEN not in load_model(folder).fit


def test_new_recordings_are_compared_as_ever(fitted):
    result = BenchmarkOptions([str(fitted)], 3).benchmark(Campaign.of(A, runs([7, 8, 9])))
    assert len(result.standings["first"].misfit) == 3
    assert "not compared" not in result.verdict()


def nonsense(count=4):
    """Recordings whose torques have nothing to do with the motion."""
    rng = np.random.default_rng(1)
    return Campaign.of(A, [replace(r, tau=rng.standard_normal(r.tau.shape)) for r in runs(range(1, count + 1))])


def test_where_nobody_explains_the_torques_the_verdict_says_so_and_sends_to_the_diagnosis():
    result = BenchmarkOptions(["constant", "textbook"], 2).benchmark(nonsense())
    assert result.verdict().startswith("No model explains these torques")
    assert "times better" not in result.verdict()
    assert result.following("c") == "nnhydro diagnose c --out diagnosis   (what is missing?)"


def test_where_the_physics_wins_the_next_command_makes_that_model():
    result = BenchmarkOptions(["constant", "textbook"], 2).benchmark(campaign(A, planted(A), 4, noise=0.01, seconds=2.0, rate=50.0))
    assert "times better than textbook" in result.verdict()
    assert result.following("c").startswith("nnhydro identify c --model constant --out my_model")


def test_two_models_that_are_alike_are_not_told_as_better():
    whole = campaign(A, planted(A), 4, noise=0.2, seconds=2.0, rate=50.0)
    result = BenchmarkOptions(["constant", "rigid"], 2).benchmark(whole)
    result.standings["rigid"] = replace_standing(result.standings["constant"], "rigid")
    assert "not clearly better than" in result.verdict()


def replace_standing(standing, name):
    return type(standing)(name, standing.by_fold, standing.fit_s, standing.models)


# files that were saved again with fewer digits
def test_a_resaved_recording_is_told_as_a_copy_and_says_nothing_of_the_noise():
    first, *others = runs([1, 2, 3])
    again = replace(first, name="again", tau=np.round(first.tau, 4))
    whole = Campaign.of(A, [first, *others, again])
    assert copied_recordings(whole) == (("run1", "again"),)
    assert noise_floor(whole, whole.plan()) is None


def test_a_resaved_recording_is_not_new_to_a_model():
    model = identify(Campaign.of(A, runs([1, 2, 3])), "constant")
    again = [replace(r, name=f"x{r.name}", tau=np.round(r.tau, 4)) for r in runs([2, 3, 4, 5])]
    mixed = Campaign.of(A, again)
    assert seen_names(model, mixed) == ("xrun2", "xrun3")
