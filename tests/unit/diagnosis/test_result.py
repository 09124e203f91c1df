"""What a diagnosis tells: its document, its verdict, and that both say the same."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import campaign, planted
from rigs import arm

from nnhydro.diagnosis.decision.decide import Decision
from nnhydro.diagnosis.decision.heldout_errors import states
from nnhydro.diagnosis.findings.finding import Parameter
from nnhydro.diagnosis.result import DiagnosisResult
from nnhydro.diagnosis.unexplained.residual_location import Location
from nnhydro.diagnosis.unexplained.unexplained import Dependence, Remainder
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.recordings.filtering.computed_slopes import LeftOut
from nnhydro.recordings.filtering.preprocessing import Preparation, prepare


def diagnosis(p=0.001, found=(), remains=False, following=None, hums=(), floor=0.03, learned=(), as_given=None):
    lines = tuple(SimpleNamespace(sentence=lambda hum=hum: hum) for hum in hums)
    rest = Remainder(remains, 0.05, 0.5, p, tuple(learned), lines)
    heldout = SimpleNamespace(before=0.2, after=0.05, without={}, scale="measured torque", unit="recordings",
                            as_given=as_given)
    place = Location(1, 1.0, "spread", {}, [0.0, 1.0], [])
    decisions = (Decision("backlash", 2, 3.14159, 4.6, False, "gains 3.1 nats beside the others (4.6 needed)"),)
    return DiagnosisResult(SimpleNamespace(arm=arm(1)), None, "constant", 1.23456, p, floor, heldout, [place], list(found), rest, decisions,
                           {"x": 1}, (), following, {"cd": [1.0]}, {"v": "1"})


@pytest.mark.parametrize(("p", "detected"), [(0.01, True), (0.0101, False), (0.0, True)])
def test_a_mismatch_is_detected_at_one_in_a_hundred_and_only_then_placed(p, detected):
    told = diagnosis(p).document()
    assert told["mismatch"]["detected"] == detected
    assert bool(told["location"]) == detected
    assert told["seconds"] == 1.23
    assert told["next_experiment"] is None
    assert "rehearsal" not in told
    assert told["indistinguishable"] == []


def test_a_simulation_that_recalibration_mends_is_told_with_its_own_error_and_with_what_changes():
    """A simulation without added mass is no healthy one because C_M can be fitted beside it."""
    told = diagnosis(0.5, as_given=0.31)
    assert ("The simulation itself has an error of 31.0 %. With masses and coefficients refitted, 20.0 % remains: C_D changes by +1.00."
            in told.verdict())
    assert told.document()["mismatch"]["error_as_given"] == 0.31
    assert "simulation" not in diagnosis(0.5, as_given=0.2).verdict(), "there is nothing to tell where little changes"
    assert "error_as_given" not in diagnosis(0.5).document()["mismatch"]


def test_rates_that_were_left_out_are_told():
    late, smoothed, none = (replace(diagnosis(0.5), checks={"left_out": why.sentence()}).verdict()
                            for why in (LeftOut(rates_lag=0.0058), LeftOut(smoothed=True), LeftOut()))
    assert late == (diagnosis(0.5).verdict() + " The recorded rates lag the angles by 5.8 ms, as differences do: they were left out.")
    assert smoothed == diagnosis(0.5).verdict() + " The recorded rates or accelerations were smoothed: they were left out."
    assert none == diagnosis(0.5).verdict()


class Told(SimpleNamespace):
    """A finding or proposal that knows its statement."""

    effect, family, joint = None, None, None

    def equivalents(self):
        return " Or B." if len(self.equivalence_set) > 1 else ""

    def document(self, *given):
        return {"given": given}


def test_the_document_holds_findings_with_their_errors_classes_of_several_and_the_next_experiment():
    one = Told(equivalence_set=("a", "b"), statement="A.")
    two = Told(equivalence_set=("c",), statement="C.")
    following = Told(statement=lambda: "Record more.")
    made = diagnosis(found=(one, two), following=following)
    told = made.document()
    assert told["findings"] == [{"given": ()}, {"given": ()}]
    assert told["indistinguishable"] == [["a", "b"]]
    assert told["next_experiment"] == {"given": ("next_experiment.csv",)}
    assert made.verdict() == ("A. Or B. C. With these effects in the model, the error on recordings held out of the fit falls from "
                              "20.0 % to 5.0 %. Record more.")
    alone = diagnosis(found=(one,), remains=True)
    assert alone.verdict() == ("A. Or B. With this effect in the model, the error on recordings held out of the fit falls from 20.0 % to "
                               "5.0 %. "
                               "Noise alone would leave 3.0 %: a systematic residual remains that no known effect explains.")


@pytest.mark.parametrize(("family", "joint", "level", "told"), [
    ("dry_friction", 1, 3.0, " The fit keeps 0.45 N m of the 9 N m that arm.yaml states, in addition."),
    ("dry_friction", 1, 9.0, " The fit keeps 0.45 N m of the 9 N m that arm.yaml states, in addition: the total is as large as stated, "
                             "but it builds up over another angle or speed."),
    ("dry_friction", 2, 3.0, ""), ("inertia", 1, 3.0, "")])
def test_a_dry_friction_that_takes_the_place_of_a_stated_one_says_what_is_left_of_that(family, joint, level, told):
    rubbing = arm(2, friction=[{"coulomb_Nm": 9.0, "known_to": 0.1}, {}])
    left = SimpleNamespace(loads=Loads({"stated_coulomb_friction": CoulombTerm((0.45, 0.0), 0.01)}))
    found = Told(equivalence_set=("a",), statement="Friction.", family=family, joint=joint,
                 parameters={"level": Parameter(level, "N m", (level, level))})
    made = replace(diagnosis(found=(found,)), baseline=SimpleNamespace(arm=rubbing), corrected=left)
    assert made.verdict().startswith(f"Friction.{told} With this effect")


@pytest.mark.parametrize(("family", "joint", "may"), [("dry_friction", 2, True), ("dry_friction", 1, False), ("viscous", 2, False)])
def test_an_offset_beside_dry_friction_may_be_a_friction_that_differs_between_the_directions(family, joint, may):
    offset = Told(equivalence_set=("torque_bias",), statement="Offset.", effect="torque_bias", family="torque_sensor", joint=2)
    other = Told(equivalence_set=("a",), statement="Rubs.", effect="a", family=family, joint=joint)
    said = " Dry friction that differs between the directions has the same torque while the joint turns." if may else ""
    assert diagnosis(found=(offset, other)).verdict().startswith(f"Offset.{said} Rubs. With these")


@pytest.mark.parametrize(("predicted", "phased", "told"), [
    (True, False, "A fit without it has the same error, 20.0 %, but moves masses or coefficients beyond their uncertainty."),
    (False, True, "Its phase wanders, and cannot be predicted: the error on recordings held out of the fit remains 20.0 %."),
    (False, False, "When it acts cannot be predicted, and its values are less certain than the intervals say: "
                   "the error on recordings held out of the fit remains 20.0 %.")])
def test_of_a_finding_that_lowers_no_error_the_verdict_says_why(predicted, phased, told):
    law = SimpleNamespace(per_recording=phased)
    made = diagnosis(found=(Told(equivalence_set=("a",), statement="A.", predicted=predicted, law=law),))
    made.heldout.after = made.heldout.before
    assert made.verdict() == f"A. {told}"


def test_a_verdict_without_findings_says_whether_there_is_a_mismatch_and_what_hums():
    assert diagnosis(0.5).verdict().startswith("No missing physics was detected")
    assert "no known effect explains the difference" in diagnosis(0.001).verdict()
    assert diagnosis(0.001, hums=["a hum of 1 N m"]).verdict().endswith(" There is a hum of 1 N m.")


def test_an_effect_that_is_likely_but_small_is_neither_named_nor_called_noise():
    small = Decision("torque_bias", 2, 17.0, 3.0, False, "the error hardly falls", small=True)
    told = replace(diagnosis(0.5), decisions=(small, replace(small, effect="ambient_current", joint=0, small=False))).verdict()
    assert told == ("No missing physics of consequence was detected. Torque sensor offset at joint 2 is likely, but too small to be named: "
                    "the error hardly falls.")


def test_every_candidate_that_came_near_is_told_with_its_statistic_its_threshold_and_the_reason():
    (decision,) = diagnosis().document()["decisions"]
    assert decision == {"effect": "backlash", "joint": 2, "statistic": 3.142, "threshold": 4.6, "claimed": False,
                        "reason": "gains 3.1 nats beside the others (4.6 needed)"}


def test_above_a_floor_of_a_third_of_the_torque_nothing_is_said_to_be_complete():
    assert diagnosis(1.0, floor=0.32).verdict().startswith("No missing physics")
    assert diagnosis(1.0, floor=0.34).verdict().startswith("These recordings are too noisy for a diagnosis: noise alone is 34 % of")


def test_a_difference_that_only_impossible_coefficients_explain_is_detected_and_not_called_noise():
    told = replace(diagnosis(1.0, floor=0.98), checks={"impossible_coefficients": ["C_D would be 30: check the diameters"]})
    assert told.detected
    assert told.verdict().startswith("Recordings and model differ beyond noise")
    assert "check the diameters." in told.verdict()
    assert not replace(told, checks={"impossible_coefficients": []}).detected


def test_torque_above_the_band_is_told_where_it_is_more_than_a_third():
    little, much = (replace(diagnosis(0.5), checks={"torque_above_band": share, "band_hz": 2.44}).verdict() for share in (0.3, 0.4))
    assert little == diagnosis(0.5).verdict()
    assert much.startswith(f"{little} 40 % of the torque's rms lies above 2.4 Hz and was not compared with the model.")


def test_what_remains_is_told_with_what_it_depends_on_where_it_is_worth_telling():
    parts = (Dependence(1, 0.2, ("q1_rad", "dq1_rad_s")), Dependence(2, 0.005, ("q2_rad",)))
    told = diagnosis(0.001, remains=True, learned=parts)
    assert told.verdict().endswith("The difference depends on q1_rad, dq1_rad_s at joint 1.")
    assert told.document()["unexplained"]["depends_on"] == ["dq1_rad_s", "q1_rad"]
    assert diagnosis(0.5, learned=parts).document()["unexplained"]["depends_on"] == []


@pytest.mark.parametrize(("recordings", "own", "told"), [
    ((), False, "The difference depends on q1_rad: it is largest from 0.2 to 0.6, in a, b."),
    (("c",), False, "The difference lies in c."),
    (("c",), True, "The difference depends on q1_rad: it is largest from 0.2 to 0.6, in a, b. "
                   "Mass, drag or added mass in c differ from those of the other recordings."),
])
def test_what_no_law_explains_is_told_with_where_it_lies_and_the_recordings_whose_parameters_differ(recordings, own, told):
    place = Location(1, 1.0, "", {"q1_rad": [0.2, 0.6]}, [0.0, 1.0], ["a", "b"], follows=0.3)
    made = diagnosis(0.001, remains=True)
    made = replace(made, remainder=replace(made.remainder, recordings=recordings, parameters_differ=own, place=place))
    assert made.verdict().endswith(told)
    hum = diagnosis(0.001, hums=["a hum of 1 N m"])
    assert "depends" not in replace(hum, remainder=replace(hum.remainder, place=place)).verdict(), "a hum is told as a hum"


def test_states_are_told_joint_by_joint_and_the_carriage_where_it_moves():
    whole = campaign(arm(2), planted(arm(2)), 2, seconds=1.0)
    still, towed = (next(iter(prepare(r, Preparation(None)))) for r in whole.recordings())
    told = states(towed)
    assert list(told) == ["q1_rad", "dq1_rad_s", "ddq1_rad_s2", "q2_rad", "dq2_rad_s", "ddq2_rad_s2", "u0_m_s"]
    np.testing.assert_array_equal(told["q2_rad"], towed.q[:, 1])
    np.testing.assert_array_equal(told["ddq2_rad_s2"], towed.qdd[:, 1])
    np.testing.assert_array_equal(told["dq1_rad_s"], towed.qd[:, 0])
    assert "u0_m_s" not in states(still)


def test_the_verdict_leads_with_units_and_signs_that_physics_denies():
    said = replace(diagnosis(1.0), checks={"denied_channels": ["tau1_Nm: the torque of joint 1 has the wrong sign"]}).verdict()
    assert said.startswith("Nothing below can be relied on before this is corrected (`nnhydro check` says how): "
                           "tau1_Nm: the torque of joint 1 has the wrong sign.")
    assert not replace(diagnosis(1.0), checks={"denied_channels": []}).verdict().startswith("Nothing below")
