"""Effects that act in some recordings only are found with the recordings in which they do."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import planted, recording
from rigs import arm

from nnhydro.diagnosis.case import opened
from nnhydro.diagnosis.instances import Spell, instances
from nnhydro.diagnosis.naming import torque_peaks
from nnhydro.diagnosis.search import search
from nnhydro.diagnosis.verdict import findings
from nnhydro.recordings.campaign import Campaign

ARM = arm(2)
FEW = ("coulomb_friction", "viscous_friction", "torque_bias", "umbilical_stiffness")
COUNT = 12


def rubbing(acts, seed=0, joint=1):
    """A campaign with dry friction at `joint`, as strong in recording k as acts(k) says; by the clock the recordings ran backward."""
    made = []
    for k in range(COUNT):
        r = recording(ARM, planted(ARM), f"run{k:02d}", seed=k + 1 + 100 * seed, noise=0.003, seconds=4.0)
        tau = np.array(r.tau)
        tau[:, joint - 1] += acts(k) * np.tanh(r.qd[:, joint - 1] / 0.01)
        made.append(replace(r, tau=tau, clock=1e5 - 100.0 * k + np.asarray(r.t)))
    return Campaign.of(ARM, made)


def found(campaign, only=FEW):
    case = opened(campaign).case
    known = [i for i in instances(ARM, torque_peaks(case.all_units)) if i.key[0] in only]
    return search(case, known, None, 0).race


@pytest.mark.parametrize(("acts", "since", "until"), [
    (lambda k: 1.0 * (k < 6), "run05", None),  # recorded last by the clock: run05 down to run00
    (lambda k: 1.0 * (k >= 7), None, "run07"),
])
def test_an_effect_that_begins_or_ends_between_two_recordings_is_found_with_the_recording(acts, since, until):
    race = found(rubbing(acts))
    (chosen,) = race.chosen
    assert chosen.key == ("coulomb_friction", 1)
    assert (chosen.instance.spell.since, chosen.instance.spell.until) == (since, until)
    (finding,) = findings(race)
    assert finding.parameters["level"]["value"] == pytest.approx(1.0, rel=0.1)
    assert finding.document(1.0, 0.5)["acts"] == {"since": since, "until": until}
    assert f"It acts {chosen.instance.spell.sentence()} only." in finding.statement
    assert finding.lasts == (until is None)


@pytest.mark.parametrize("acts", [lambda k: 1.0, lambda k: 0.8 + 0.4 * (k % 2), lambda k: 0.7 + 0.05 * k])
def test_an_effect_that_always_acts_has_no_spell_though_it_varies(acts):
    (chosen,) = found(rubbing(acts)).chosen
    assert chosen.key == ("coulomb_friction", 1)
    assert chosen.instance.spell is None


def test_an_effect_in_four_recordings_of_twelve_is_found_though_most_recordings_know_nothing_of_it():
    (chosen,) = found(rubbing(lambda k: 1.0 * (k < 4))).chosen
    assert chosen.key == ("coulomb_friction", 1)
    assert chosen.instance.spell.since == "run03"


def test_a_healthy_arm_has_no_spells():
    for seed in range(3):
        assert found(rubbing(lambda k: 0.0, seed)).chosen == []


def test_a_spell_in_words():
    assert Spell(frozenset((1,)), "a", None).sentence() == "from a on"
    assert Spell(frozenset((1,)), None, "b").sentence() == "up to b"
    assert Spell(frozenset((1,)), "a", "b").sentence() == "from a to b"
