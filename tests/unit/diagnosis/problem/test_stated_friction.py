"""Friction that arm.yaml states: over which angle its contacts bend, the recordings say."""

import pytest
from campaigns import campaign, planted
from rigs import arm

from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.models.stated_terms import STATED_COULOMB
from nnhydro.physics.joints import DRY_WIDTH
from nnhydro.physics.loads.coulomb_friction import CoulombTerm

LEVEL = 2.0  # N m
STATED = [{"coulomb_Nm": 1.1 * LEVEL, "known_to": 0.2}]


def rubbing(bending, stated=STATED):
    """A campaign of one link whose joint rubs, its contact bent before it slips."""
    a = arm(1, friction=stated)
    return campaign(a, planted(a).plus("friction", CoulombTerm((LEVEL,), DRY_WIDTH, bending)), noise=0.01)


def angle_of(whole):
    """The angle, rad, over which the stated contact is found to bend; None where no friction is stated."""
    loads = design_on(problem_of(whole), "constant").baseline.physics.loads
    return loads.terms[STATED_COULOMB].bending_rad if STATED_COULOMB in loads.terms else None


@pytest.mark.parametrize("bending", [0.005, 0.05])
def test_the_angle_over_which_a_stated_contact_bends_is_found(bending):
    assert angle_of(rubbing(bending)) == pytest.approx(bending, rel=0.2)


def test_a_rigid_contact_stays_rigid_and_what_is_not_stated_is_not_sought():
    assert angle_of(rubbing(0.0)) == 0.0
    assert angle_of(rubbing(0.05, stated=None)) is None


def test_friction_of_the_stated_size_is_not_missing_and_the_verdict_says_how_it_builds_up():
    found = diagnose(rubbing(0.05))
    assert [finding.effect for finding in found.findings] == []
    assert "The dry friction that arm.yaml states builds up over 0.0" in found.verdict()
    assert found.baseline.loads.terms[STATED_COULOMB].bending_rad > 0
