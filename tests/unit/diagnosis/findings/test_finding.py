"""What a finding tells: its values with intervals, nonlinear ones too, and what cannot be told from it."""

from dataclasses import replace

import numpy as np
import pytest

from nnhydro.diagnosis.findings.finding import Finding
from nnhydro.effects.catalogue import catalogue


def finding(equivalence_set):
    """A finding of dry friction that cannot be told from the other `equivalence_set`."""
    effect = catalogue()["coulomb_friction"](joint=1, level=(0.1,))
    return Finding(effect, "friction", equivalence_set, 0.9, "Joint 1 rubs.", {}, [], np.eye(1), 0)


def test_one_name_is_a_leaf_and_says_nothing_of_others():
    assert finding(("coulomb_friction",)).level == "leaf"
    assert finding(("coulomb_friction",)).equivalents() == ""


def test_several_names_are_a_family_and_are_listed():
    told = finding(("coulomb_friction", "stribeck_friction", "viscous_friction"))
    assert told.level == "family"
    names = [catalogue()[name].name for name in ("stribeck_friction", "viscous_friction")]
    assert told.equivalents() == f" These recordings cannot distinguish this effect from {names[0]} or {names[1]}."
    assert replace(told, error_without=0.1, error_with=0.02).document()["heldout"] == {"error_before": 0.1, "error_after": 0.02}


@pytest.mark.parametrize(("effect", "with_it", "predicted"), [
    ("coulomb_friction", 0.02, True), ("coulomb_friction", 0.1, True), ("backlash", 0.02, True), ("backlash", 0.1, False)])
def test_what_hangs_on_the_smallest_torques_is_predicted_where_the_error_falls_with_it(effect, with_it, predicted):
    law = {"coulomb_friction": catalogue()["coulomb_friction"](joint=1, level=(0.1,)),
           "backlash": catalogue()["backlash"](joint=1, gap=(0.01,), impulse=(0.02,))}[effect]
    assert replace(finding((effect,)), law=law, error_without=0.1, error_with=with_it).predicted == predicted
