"""A simulation with physics added: its own torque, and the change by what was found."""

from dataclasses import replace

import torch
from campaigns import GIVEN, planted
from rigs import arm, assert_close, run

from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.loads.viscous_friction import ViscousTerm

A = arm(2)
BEFORE = StripTheory(A, GIVEN, {}, "constant", planted(A))
AFTER = replace(BEFORE, loads=planted(A).plus("rub", ViscousTerm((0.3, 0.1))))
OTHER = replace(BEFORE, loads=planted(A, C_D=(2.0, 2.0)))


def test_what_was_found_is_added_to_the_simulation():
    found = AFTER.torque(run(2)) - BEFORE.torque(run(2))
    assert_close(CorrectedSimulation(A, GIVEN, {}, OTHER, BEFORE, AFTER).torque(run(2)), OTHER.torque(run(2)) + found)
    assert_close(found, run(2).qd * torch.tensor([0.3, 0.1], dtype=torch.float64))


def test_for_a_simulation_outside_the_torques_are_what_must_be_added():
    outside = CorrectedSimulation(A, GIVEN, {}, None, BEFORE, AFTER)
    assert_close(outside.torque(run(2)), AFTER.torque(run(2)) - BEFORE.torque(run(2)))
    assert outside.document()["to_be_added"]
    assert outside.arrays() == {}


def test_the_document_holds_the_simulation_with_its_arm():
    document = CorrectedSimulation(A, GIVEN, {}, OTHER, BEFORE, AFTER).document()
    assert not document["to_be_added"]
    assert document["simulation"] == {"kind": "strip_theory", "arm": A.document(), "model": OTHER.document()}
