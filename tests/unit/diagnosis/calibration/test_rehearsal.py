"""Rehearsed confidence: what is drawn again is named again, and a rival that would be taken for the finding takes confidence away."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import planted, recording
from rigs import arm

from nnhydro.diagnosis.calibration.injection import predict_whitened
from nnhydro.diagnosis.calibration.rehearsal import label, limit_confidence, rehearse
from nnhydro.diagnosis.diagnose import diagnose, search_design
from nnhydro.diagnosis.findings.finding import findings_of
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.effects.catalogue import catalogue
from nnhydro.recordings.campaign import Campaign

ARM = arm(2)
FEW = ("coulomb_friction", "viscous_friction", "torque_bias", "vortex_shedding")
WITHOUT = [name for name in catalogue() if name not in FEW]


@dataclass(frozen=True)
class Said:
    law: SimpleNamespace
    equivalence_set: tuple[str, ...]
    effect: str = "coulomb_friction"
    confidence: float = 0.99


FINDING = Said(SimpleNamespace(id="coulomb_friction", joint=1), ("coulomb_friction",))


def world(planted_keys, instead, named_so_often):
    return {"planted": planted_keys, "instead_of": instead, "named": named_so_often}


def rehearsal(hits, misnamed):
    mine = "coulomb_friction joint 1"
    return {"draws": 10, "worlds": [world([mine], None, {mine: hits}), world(["stribeck_friction joint 1"], mine, {mine: misnamed})]}


def rubbing():
    """A campaign with dry friction at joint 1."""
    made = []
    for k in range(6):
        r = recording(ARM, planted(ARM), f"run{k}", seed=k + 1, noise=0.02)
        made.append(replace(r, tau=r.tau + np.tanh(r.qd / 0.01) * [0.5, 0.0]))
    return Campaign.of(ARM, made)


@pytest.fixture(scope="module")
def found():
    return search_design(design_on(problem_of(rubbing()), None), 0, WITHOUT)


def test_confidence_is_the_share_of_such_claims_that_are_right():
    assert limit_confidence(FINDING, rehearsal(10, 0)).confidence == pytest.approx(10.5 / 11)
    assert limit_confidence(FINDING, rehearsal(10, 10)).confidence == pytest.approx(10.5 / 21)
    assert limit_confidence(FINDING, rehearsal(0, 10)).confidence < 0.1


def test_no_rehearsal_raises_a_confidence_that_knows_of_what_no_card_holds():
    assert limit_confidence(replace(FINDING, confidence=0.6), rehearsal(10, 0)).confidence == 0.6


def test_a_rival_that_is_named_in_the_same_class_takes_no_confidence_away():
    both = replace(FINDING, equivalence_set=("coulomb_friction", "stribeck_friction"))
    assert limit_confidence(both, rehearsal(10, 10)).confidence > 0.9
    named_otherwise = {"draws": 10, "worlds": [world(["coulomb_friction joint 1"], None, {"stribeck_friction joint 1": 10})]}
    assert limit_confidence(both, named_otherwise).confidence > 0.9, "another member of the class is a hit, too"
    assert limit_confidence(FINDING, named_otherwise).confidence == 0.5


def test_a_world_that_stands_for_another_finding_says_nothing_of_this_one():
    told = rehearsal(10, 0)
    told["worlds"].append(world(["torque_bias joint 2"], "rotor_inertia joint 2", {"coulomb_friction joint 1": 10}))
    assert limit_confidence(FINDING, told).confidence > 0.9


def test_a_place_is_told_by_its_joint_or_as_the_whole_arm():
    assert (label(("torque_bias", 2)), label(("payload_mass", 0))) == ("torque_bias joint 2", "payload_mass")


def test_what_a_fit_predicts_leaves_noise_of_unit_size(found):
    left = found.search.whitened.y - predict_whitened(found.search.view, found.decided.claimed, found.decided.claimed)
    assert 0.5 < float((left**2).mean()) < 1.1


@pytest.mark.slow
def test_friction_drawn_again_is_named_again_and_its_rivals_are_not_taken_for_it(found):
    claimed = found.decided.claimed
    (finding,) = findings_of(found.search, claimed)
    assert (finding.effect, finding.joint) == ("coulomb_friction", 1)
    said = rehearse(found.search, claimed, 3, 0)
    assert said["draws"] == 3
    assert said["worlds"][0] == {"planted": ["coulomb_friction joint 1"], "instead_of": None, "named": {"coulomb_friction joint 1": 3}}
    assert {w["instead_of"] for w in said["worlds"][1:]} <= {"coulomb_friction joint 1"}
    assert limit_confidence(finding, said).confidence > 0.85
    assert rehearse(found.search, claimed, 3, 0) == said, "the same seed draws the same"


@pytest.mark.slow
def test_a_rehearsed_diagnosis_says_what_was_drawn_and_named():
    told = diagnose(rubbing(), without=WITHOUT, rehearsals=2).document()
    assert told["rehearsal"]["draws"] == 2
    assert told["rehearsal"]["worlds"][0]["named"] == {"coulomb_friction joint 1": 2}
    assert told["findings"][0]["confidence"] <= 2.5 / 3 + 1e-9
