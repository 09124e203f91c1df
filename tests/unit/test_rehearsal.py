"""Rehearsed confidence: what is planted again is named again, and a rival that would be taken for the finding takes confidence away."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import planted, recording
from rigs import arm

from nnhydro.diagnosis.case import opened
from nnhydro.diagnosis.naming import named
from nnhydro.diagnosis.rehearsal import confident, rehearse, worlds
from nnhydro.effects.catalogue import catalogue
from nnhydro.recordings.campaign import Campaign

ARM = arm(2)
FEW = ("coulomb_friction", "viscous_friction", "torque_bias", "rotor_inertia")


@dataclass(frozen=True)
class Said:
    effect: SimpleNamespace
    members: tuple[str, ...]
    confidence: float = 0.5


FINDING = Said(SimpleNamespace(id="coulomb_friction", joint=1), ("coulomb_friction",))


def world(planted_keys, instead, named_so_often):
    return {"planted": planted_keys, "instead_of": instead, "named": named_so_often}


def rehearsal(hits, misnamed):
    mine = "coulomb_friction joint 1"
    return {"draws": 10, "worlds": [world([mine], None, {mine: hits}), world(["stribeck_friction joint 1"], mine, {mine: misnamed})]}


def test_confidence_is_the_share_of_such_claims_that_are_right():
    assert confident(FINDING, rehearsal(10, 0)).confidence == pytest.approx(10.5 / 11)
    assert confident(FINDING, rehearsal(10, 10)).confidence == pytest.approx(0.5)
    assert confident(FINDING, rehearsal(0, 10)).confidence < 0.1


def test_a_rival_that_is_named_in_the_same_class_takes_no_confidence_away():
    both = replace(FINDING, members=("coulomb_friction", "stribeck_friction"))
    assert confident(both, rehearsal(10, 10)).confidence > 0.9


def test_a_world_that_stands_for_another_finding_says_nothing_of_this_one():
    told = rehearsal(10, 0)
    told["worlds"].append(world(["torque_bias joint 2"], "rotor_inertia joint 2", {"coulomb_friction joint 1": 10}))
    assert confident(FINDING, told).confidence > 0.9


@pytest.mark.slow
def test_friction_planted_again_is_named_again_and_its_rivals_are_not_taken_for_it():
    made = []
    for k in range(8):
        r = recording(ARM, planted(ARM), f"run{k}", seed=k + 1, noise=0.003)
        made.append(replace(r, tau=r.tau + np.tanh(r.qd / 0.01) * [1.0, 0.0]))
    case = opened(Campaign.of(ARM, made)).case
    without = [name for name in catalogue() if name not in FEW]
    told = named(case, None, 0, without)
    (finding,) = told.findings
    planned = worlds(told.found.race)
    assert planned[0].keys == (("coulomb_friction", 1),)
    assert {w.instead for w in planned[1:]} == {("coulomb_friction", 1)}
    said = rehearse(case, told.found.race, 4, 0, without)
    assert said["worlds"][0]["named"] == {"coulomb_friction joint 1": 4}
    assert confident(finding, said).confidence > 0.85
