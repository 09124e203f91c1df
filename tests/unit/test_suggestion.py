"""A formula for what has no name: the right term with the right coefficient, none for noise, and no effect on anything else."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import campaign, planted
from rigs import arm

from nnhydro.diagnosis.case import opened
from nnhydro.diagnosis.engine import diagnose
from nnhydro.diagnosis.instances import instances
from nnhydro.diagnosis.naming import torque_peaks
from nnhydro.diagnosis.nearest import nearest
from nnhydro.diagnosis.proof import prove
from nnhydro.diagnosis.search import race_of
from nnhydro.diagnosis.suggestion import Feature, suggested
from nnhydro.diagnosis.table import Table
from nnhydro.diagnosis.unknown import Learned, learned
from nnhydro.effects.catalogue import catalogue
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.report.diagnosis_folder import write_diagnosis
from nnhydro.report.unknown_law import unknown_laws

FEW = ("viscous_friction", "torque_bias")  # cards that take part, to be quick


def with_law(law, count=8, noise=0.02):
    """A campaign whose joint 2 feels law(recording) N m beside what the baseline knows; no card of the catalogue says it."""
    a = arm()
    whole = campaign(a, planted(a), count=count, noise=noise, seconds=6.0)
    changed = [replace(r, tau=r.tau + np.column_stack([np.zeros(len(r.t)), law(r)])) for r in whole.recordings()]
    return Campaign.of(a, changed)


def started(whole):
    """The race with nothing chosen, its table and case."""
    case = opened(whole).case
    table = Table(case)
    known = instances(case.model.arm, torque_peaks(case.all_units), [name for name in catalogue() if name not in FEW])
    return race_of(table, known, case.model, None), table, case.model


def offered(whole):
    race, table, model = started(whole)
    rest = learned(prove(race, table, model).remains, 0, explain=True)[1]
    return suggested(race, table, model, rest, 0)


@pytest.mark.parametrize(("law", "term", "coefficient", "unit"), [
    (lambda r: 0.35 * r.q[:, 0] * r.qd[:, 1], "q1 · dq2", 0.35, "N m s/rad^2"),
    (lambda r: 0.25 * np.cos(r.q[:, 0]) * r.qd[:, 0], "cos q1 · dq1", 0.25, "N m s/rad")])
def test_an_unlisted_law_is_suggested_with_its_term_its_coefficient_and_its_unit(law, term, coefficient, unit):
    found = offered(with_law(law))
    first = found.terms[0]
    assert first.feature.name == term
    assert first.value == pytest.approx(coefficient, rel=0.1)
    assert first.feature.coefficient_unit == unit
    assert first.ci95[0] < first.value < first.ci95[1]
    assert found.r2 > 0.5 * found.learner
    assert "A suggestion, not a finding" in found.sentence()


def test_noise_gives_no_suggestion_even_where_a_learner_believed_in_something():
    race, table, model = started(with_law(lambda r: 0 * r.t))
    assert not any(one.real for one in learned(prove(race, table, model).remains, 0, explain=False))
    assert suggested(race, table, model, Learned(2, 0.06, 0.001, ()), 0) is None


def test_a_formula_that_says_less_than_half_of_what_a_learner_knows_is_not_offered():
    race, table, model = started(with_law(lambda r: 0.35 * r.q[:, 0] * r.qd[:, 1]))
    rest = learned(prove(race, table, model).remains, 0)[1]
    mine = suggested(race, table, model, rest, 0)
    assert mine is not None
    assert suggested(race, table, model, replace(rest, r2=2.1 * mine.r2), 0) is None


def test_units_of_coefficients_are_what_makes_a_torque():
    rate, speed = Feature("dq1", (1, 0, -1), frozenset(), "rate 1"), Feature("|u0| u0", (0, 2, -2), frozenset(), "carriage")
    assert rate.coefficient_unit == "N m s/rad"
    assert speed.coefficient_unit == "N m s^2/m^2"
    assert rate.times(speed).coefficient_unit == "N m s^3/(rad m^2)"


def test_the_nearest_card_says_which_lock_keeps_it_out():
    race = started(with_law(lambda r: 0.2 * r.qd[:, 1] * (r.q[:, 0] > 0.3)))[0]  # grease in a part of the first joint's range
    near = nearest(race, [2], 0)[0]
    assert (near.effect, near.joint) == ("viscous_friction", 2)
    assert near.sentence().startswith("viscous_friction at joint 2: it does not predict left-out recordings better (p = ")


@pytest.mark.slow
def test_a_suggestion_is_told_and_changes_no_prediction(tmp_path):
    whole = with_law(lambda r: 0.35 * r.q[:, 0] * r.qd[:, 1])
    told = diagnose(whole, without=[name for name in catalogue() if name not in ("torque_bias", "torque_gain")])  # no card is near
    assert told.findings == []
    assert told.detected
    assert told.remainder.suggestions[0].terms[0].feature.name == "q1 · dq2"
    assert "A suggestion, not a finding" in told.verdict()
    motion = Motion.of(opened(whole).case.all_units[0].segments()[0])
    np.testing.assert_array_equal(told.corrected.torque(motion).numpy(), told.baseline.torque(motion).numpy())
    law = unknown_laws(told)[0]
    assert law.joint == 2
    assert (law.half > 0).all()
    document = told.document()["unexplained"]
    assert document["suggestions"][0]["statement"] == told.remainder.suggestions[0].sentence()
    write_diagnosis(told, whole, tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text()
    assert document["suggestions"][0]["statement"] in page
    assert all(near["why"] in page for near in document["nearest"])
    assert f"Residual of joint 2 over {law.driver}" in page
    assert (tmp_path / "out" / "unexplained.csv").is_file()
