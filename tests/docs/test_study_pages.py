"""Pages of studies: their tables are those that the studies print from their results files."""

import importlib.util
import json
import tomllib
from pathlib import Path

TRAINING = Path(__file__).resolve().parents[2] / "training"


def study(place):
    """The module of a study, which is no part of a package."""
    spec = importlib.util.spec_from_file_location(place.replace("/", "_").removesuffix(".py"), TRAINING / place)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def results(place):
    return json.loads((TRAINING / place).read_text(encoding="utf-8"))


def released(document):
    """The version that made a results file, without the revision."""
    return document["versions"]["nnhydro"].partition("+")[0]


def page(name):
    return (TRAINING / name / "README.md").read_text(encoding="utf-8")


def test_the_page_of_real_rigs_has_every_stored_rig():
    run = study("real_rigs/run.py")
    stored = [results(f"real_rigs/{name}") for name in run.STORED]
    rigs = [rig for document in stored for rig in document["rigs"]]
    assert run.table(rigs) in page("real_rigs")
    right, half, silent, wrong = (sum(document["count"].get(verdict, 0) for document in stored)
                                  for verdict in ("right", "half", "silent", "wrong"))
    assert right + half + silent + wrong == len(rigs)
    told = f"Of {len(rigs)} rigs, {right} are right, {half} are half right, {silent} have no name, and {wrong} are wrong."
    assert told in page("real_rigs")


def test_the_page_of_real_rigs_counts_the_varied_trials_and_the_wrong_names_as_stored():
    of, out = results("real_rigs/varied.json")["count"], results("real_rigs/family_out.json")["summary"]
    text = " ".join(page("real_rigs").split())
    assert f"Of {sum(of.values())} trials, {of['right']} are right, {of['silent']} has no name, and {of['wrong']} is wrong." in text
    assert sum(of.values()) == of["right"] + of["silent"] + of["wrong"]
    assert f"raised an alarm on {out['an alarm']} rigs, and gave {out['a wrong name']} a wrong name" in text


def test_the_page_of_the_ablation_is_the_one_that_the_study_writes():
    assert study("ablation/run.py").page(results("ablation/results.json")) == page("ablation")


def test_the_page_of_the_strangers_has_every_stored_campaign(monkeypatch):
    monkeypatch.syspath_prepend(TRAINING.parent / "tests")
    assert study("strangers/run.py").table(results("strangers/results.json")["kinds"]) in page("strangers")


def test_the_page_of_reliability_has_every_stored_count():
    assert study("reliability/table.py").table(results("reliability/results.json")) in page("reliability")


def test_the_page_of_independent_arms_has_the_summaries_of_one_version():
    documents = [results(f"independent_arms/results_{name}.json") for name in ("planted", "healthy", "family-out")]
    assert len({document["versions"]["nnhydro"] for document in documents}) == 1
    for document in documents:
        for counted, share in document["summary"].items():
            assert f"| {counted} | {share} |" in page("independent_arms")


def test_the_page_of_hybrids_on_corrected_models_has_the_table_of_one_version():
    stored = results("hybrid_on_corrected/results.json")
    assert study("hybrid_on_corrected/run.py").table(stored) in page("hybrid_on_corrected")
    assert f"Measured with version {released(stored)}." in page("hybrid_on_corrected")


def test_the_pages_of_power_have_the_tables_of_one_version():
    run, stored = study("power/run.py"), results("power/results.json")
    assert run.page(stored["plants"]) in page("power")
    assert run.table(stored["table"]) == (TRAINING / "power" / "table.md").read_text(encoding="utf-8")
    assert f"Measured with version {released(stored)}." in page("power")
    once, again = (sum(case["draw"] == draw for case in stored["plants"]["plants"]) for draw in (0, 1))
    assert f"Each of {once} effects and joints was injected once, and {again} of them a second time" in " ".join(page("power").split())
    assert "0.286 and 0.131 N m" in " ".join(page("power").split())
    assert [round(noise, 3) for noise in stored["table"]["noise_Nm"]] == [0.286, 0.131]


def test_the_page_of_the_next_experiment_has_the_table_of_one_version():
    stored = results("next_experiment/results.json")
    assert study("next_experiment/table.py").table(stored["cases"]) in page("next_experiment")
    assert f"Measured with version {released(stored)}." in page("next_experiment")
    assert {case["seed"] for case in stored["cases"]} == set(stored["config"]["seeds"]) == set(range(107, 116))


def test_the_page_of_error_rates_has_the_stored_counts():
    inside, alarms = results("error_rates/coverage.json"), results("error_rates/false_alarms.json")
    every, text = inside["all"], " ".join(page("error_rates").split())
    low, high = 100 * every["low"], 100 * every["high"]
    assert (f"Of {every['tries']} intervals of named effects, {every['hits']} hold the true value: **{100 * every['share']:.1f} % "
            f"({low:.1f} to {high:.1f})**. {inside['missed']} planted effects were not named. {inside['other_form']} values") in text
    assert max(v["tries"] - v["hits"] for v in inside["inside"].values()) == 1
    cells = [f"{row['hits']} of {row['tries']}" for row in alarms["rows"]]
    for name, row in (("derivatives given", cells[:3]), ("angles alone, noisy encoders", cells[3:])):
        assert f"| {name} | {' | '.join(row)} |" in page("error_rates")
    assert f"All: **{alarms['all']['hits']} of {alarms['all']['tries']}, " in text


def test_the_page_of_other_authors_has_the_stored_counts():
    run = study("foreign/run.py")
    assert run.table([results(f"foreign/{name}") for name in run.STORED.values()]) in page("foreign")


def test_the_page_of_the_independent_tanks_is_that_of_its_one_version():
    stored, config = results("independent_tanks/results.json"), (TRAINING / "independent_tanks" / "config.toml").read_text(encoding="utf-8")
    version, = {entry["version"] for models in stored.values() for entry in models.values()}
    assert study("independent_tanks/run.py").table(stored, version, tomllib.loads(config)["sets"]) == page("independent_tanks")
