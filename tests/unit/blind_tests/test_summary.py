"""The verdicts of a suite in one document: shares by group, confidence, when and where, and the share that the truth would mend."""

from dataclasses import replace

import pytest
from answers import ANSWER, HEALTHY, VERDICT, finding, of, said

from nnhydro.blind_tests.scoring_windows import PlacementError
from nnhydro.blind_tests.summary import summary


def test_a_healthy_arm_left_alone_is_right_and_a_false_alarm_is_counted():
    quiet, alarmed, claimed = of(HEALTHY, said(detected=False)), of(HEALTHY, said()), of(HEALTHY, said(finding("backlash")))
    assert quiet.right
    assert not quiet.alarm
    group = summary([quiet, alarmed, claimed], [])["groups"][0]
    assert (group["group"], group["campaigns"], group["false_claims"]) == ("healthy", 3, 1)
    assert group["right"] == pytest.approx(1 / 3)
    assert group["alarm"] == pytest.approx(2 / 3)


def test_confidence_is_held_against_what_was_right():
    document = summary([of(ANSWER, said(finding("umbilical_stiffness"))), of(ANSWER, said(finding("backlash", confidence=0.95))),
                        of(ANSWER, said(finding("backlash", confidence=0.6)))], [])
    assert document["confidence"] == {"threshold": 0.9, "claims": 2, "right": 0.5}
    assert document["confusion"]["umbilical_stiffness"] == {"backlash": 2, "umbilical_stiffness": 1}


def test_a_moment_is_told_within_half_a_second_and_a_part_from_six_tenths_of_overlap_on():
    right = of(ANSWER, said(finding("umbilical_stiffness")))
    placed = [PlacementError("onset", 0.9, 0.4), PlacementError("onset", 0.6, 0.6), PlacementError("onset", 0.59, 0.3), None]
    told = summary([right, *(replace(right, part="onset", placed=place) for place in placed), replace(right, confined=True)], [])["placed"]
    assert told == {"campaigns": 4, "overlap": pytest.approx(0.595), "overlapping": 0.5, "moments": 4, "moment_error_s": pytest.approx(0.4),
                    "moment_told": 0.5, "confined_wrongly": 1}


def test_the_share_is_of_what_the_truth_would_mend():
    of_two = [replace(VERDICT, error_before=0.10, error_after=0.04, error_true=0.02), replace(VERDICT, error_before=0.2, error_after=0.1)]
    worse = replace(VERDICT, error_before=0.02, error_after=0.03, error_true=0.04)
    unseen = summary([*of_two, worse], [])["unseen"]
    assert unseen["share_of_error"] == pytest.approx(0.5)
    truth = unseen["of_the_truth"]
    assert (truth["campaigns"], truth["better_than_baseline"]) == (2, 1)
    assert truth["share"] == pytest.approx(0.75)
    assert truth["pooled"] == pytest.approx((0.06 - 0.01) / (0.08 - 0.02))
    assert (truth["median_true"], truth["median_after"]) == (pytest.approx(0.03), pytest.approx(0.035))
    hopeless = summary([worse], [])["unseen"]["of_the_truth"]
    assert (hopeless["share"], hopeless["pooled"]) == (None, None)
