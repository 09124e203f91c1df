"""What the models of a diagnosis have seen, and where they may be used."""

from types import SimpleNamespace

from campaigns import GIVEN, campaign, planted
from rigs import arm

from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.trained_on import trained_on, with_record
from nnhydro.models.seen import seen_names, unseen_units
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.splitting import units

ARM = arm(1)
WHOLE = campaign(ARM, planted(ARM), count=4)


def model(seen=()):
    return StripTheory(ARM, GIVEN, {"seen": list(seen), "kind": "calibrated"}, "constant", planted(ARM))


def test_a_model_has_seen_the_recordings_that_were_studied_and_no_other():
    record = trained_on(WHOLE, problem_of(WHOLE, ("run0", "run2"), 3.0), model())
    made = with_record(model(), record)
    assert seen_names(made, WHOLE) == ("run0", "run2")
    assert [unit.name for unit in unseen_units(made, units(WHOLE, GIVEN))] == ["run1", "run3"]
    assert made.fit["kind"] == "calibrated", "what the record said before stays"


def test_what_the_known_model_has_seen_is_seen():
    before = trained_on(WHOLE, problem_of(WHOLE, ("run3",), 3.0), model())["seen"]
    record = trained_on(WHOLE, problem_of(WHOLE, ("run0",), 3.0), model(before))
    assert seen_names(with_record(model(), record), WHOLE) == ("run0", "run3")


def test_of_a_model_of_unknown_origin_nobody_knows_what_it_has_seen():
    record = trained_on(WHOLE, problem_of(WHOLE, ("run0",), 3.0), SimpleNamespace(fit={}))
    assert record["seen"] is None


def test_the_record_says_where_the_model_may_be_used():
    slow, all_ = (trained_on(WHOLE, problem_of(WHOLE, names, 3.0), model())["domain"] for names in (("run0",), WHOLE.names))
    assert slow is not None
    assert slow != all_, "more recordings cover more"
