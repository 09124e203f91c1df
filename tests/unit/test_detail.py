"""What of a law is asked once its effect is found: whether a dry contact bends before it slips."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import planted, recording
from rigs import arm

from nnhydro.diagnosis import detail as module
from nnhydro.diagnosis.case import opened
from nnhydro.diagnosis.detail import Asked, detailed, with_detail
from nnhydro.diagnosis.instances import Instance, instances
from nnhydro.diagnosis.naming import named, torque_peaks
from nnhydro.diagnosis.race import race_of
from nnhydro.diagnosis.table import Table
from nnhydro.diagnosis.uncertainty import _tangents
from nnhydro.effects.catalogue import catalogue
from nnhydro.errors import ModelError
from nnhydro.recordings.campaign import Campaign
from nnhydro.simulation.truth.hidden_friction import bristle, direction

ARM = arm(2)
LEVEL = 0.3  # N m
FEW = ("coulomb_friction", "stribeck_friction", "viscous_friction", "load_friction")


def rubbing(z0, noise=0.003, grip=0.0):
    """A campaign with dry friction at joint 1, made by code of its own; z0 rad: how far bristles bend, 0: not at all.

    `grip` is what breakaway takes beyond the level, in parts of it.
    """
    made = []
    for k in range(8):
        r = recording(ARM, planted(ARM), f"run{k}", seed=k + 1, noise=noise, seconds=4.0)
        v = np.asarray(r.qd)[:, 0]
        law = bristle(v, float(r.t[1] - r.t[0]), z0) if z0 else direction(v)
        law = law * (1 + grip * np.exp(-((v / 0.5) ** 2)))
        made.append(replace(r, tau=np.asarray(r.tau) + LEVEL * law[:, None] * [1.0, 0.0]))
    return Campaign.of(ARM, made)


def told(campaign):
    return named(opened(campaign).case, without=[name for name in catalogue() if name not in FEW]).findings


@pytest.mark.parametrize("z0", [0.006, 0.012])
def test_dry_friction_whose_contact_bends_is_found_with_its_level_and_how_far_it_bends(z0):
    (finding,) = told(rubbing(z0))
    assert (finding.effect.id, finding.effect.joint) == ("coulomb_friction", 1)
    assert finding.effect.bending[0] == pytest.approx(z0, rel=0.25)
    assert finding.effect.level[0] == pytest.approx(LEVEL, rel=0.03)
    assert "of turning" in finding.statement


def test_the_interval_of_how_far_a_contact_bends_grows_with_the_noise_and_holds_it():
    half = []
    for noise in (0.003, 0.01):
        (finding,) = told(rubbing(0.01, noise))
        low, high = finding.parameters["bending"]["ci95"]
        half.append((high - low) / 2)
        assert abs(finding.parameters["bending"]["value"] - 0.01) < 1.5 * half[-1]
    assert half[1] > 1.1 * half[0]


def test_what_is_told_of_other_values_knows_that_they_trade_off_with_the_detail(monkeypatch):
    monkeypatch.setattr(module, "UNPHYSICAL", float("inf"))  # a grip and a step have no physical values here, a grip that bends has
    race, asked = raced(0.01, grip=0.8)
    alone = replace(race, chosen=[])
    race.chosen = [min((c for c in race.bank.candidates if c.key == ("stribeck_friction", 1)), key=lambda c: alone.total([c]))]
    after = detailed(asked, race)
    (chosen,) = after.chosen
    assert chosen.instance.effect.bending[0] > 0.005
    assert chosen.instance.effect.speed == race.chosen[0].instance.effect.speed, "only the detail is refined"
    assert set(chosen.instance.spans) == {"speed", "tail", "bending"}
    tangents = _tangents(after, chosen, after.values(after.chosen)[1])
    assert all(np.abs(direction).max() > 0 for direction, _ in tangents)


def test_what_instruments_read_beside_it_and_the_race_know_of_the_detail():
    found = named(opened(rubbing(0.01)).case, without=[name for name in catalogue() if name not in FEW]).found
    (chosen,) = found.race.chosen
    assert chosen.instance.effect.bending[0] > 0.005
    assert chosen.instance.effect.bending in [getattr(term, "bending", None) for term in found.believed.loads.terms.values()]


def test_a_contact_that_does_not_bend_is_told_without():
    (finding,) = told(rubbing(0.0))
    assert finding.effect.id == "coulomb_friction"
    assert not any(finding.effect.bending)
    assert "of turning" not in finding.statement


def raced(z0, grip=0.0):
    case = opened(rubbing(z0, grip=grip)).case
    known = [i for i in instances(ARM, torque_peaks(case.all_units)) if i.key[0] in FEW]
    race = race_of(table := Table(case), known, case.model, None)
    race.chosen = [next(c for c in race.bank.candidates if c.key == ("coulomb_friction", 1))]
    race.first_gain = 7.0
    return race, Asked(table, case.model, None)


def test_rivals_that_have_the_detail_get_it_too_and_nothing_else_of_the_race_changes():
    race, asked = raced(0.01)
    after = detailed(asked, race)
    assert [c.key for c in after.chosen] == [c.key for c in race.chosen]
    (value,) = after.chosen[0].instance.effect.bending
    bent = [c for c in after.bank.candidates if any(getattr(c.instance.effect, "bending", ()))]
    assert {c.key for c in bent} == {("coulomb_friction", 1), ("stribeck_friction", 1)}, "those of the other joint do not"
    rivals = [c for c in bent if c.key[0] == "stribeck_friction"]
    assert {c.instance.effect.bending for c in rivals} == {(value,)}
    assert {c.instance.spans["bending"] for c in rivals} == {after.chosen[0].instance.spans["bending"]}
    assert len(after.bank.candidates) == len(race.bank.candidates) + len(rivals) + 2, "and two beside the one found"
    assert after.first_gain == 7.0
    assert after.noise[0] < 0.5 * race.noise[0], "what bends was noise before"
    assert "by bending = " in after.log[-1]


@pytest.mark.parametrize(("most", "taken"), [(0.01, False), (-0.01, True)])
def test_a_detail_is_taken_where_it_gains_enough(monkeypatch, most, taken):
    race, asked = raced(0.01)
    gain = float(detailed(asked, race).log[-1].split(": ")[1].split()[0])  # told to a tenth
    monkeypatch.setattr(module, "LEAST", gain * (1 + most))
    assert (detailed(asked, race) is not race) == taken


def test_a_set_whose_values_are_impossible_gains_nothing_by_a_detail(monkeypatch):
    race, asked = raced(0.01)
    monkeypatch.setattr(module.Race, "physical", lambda self, kept, columns, values: any(any(c.instance.effect.bending) for c in kept))
    assert detailed(asked, race) is race


def test_values_of_a_detail_lie_between_those_on_the_card():
    one = Instance(catalogue()["coulomb_friction"].started(ARM, joint=1), 1, {"bending": (0.0, 0.0)})
    assert with_detail(one, "bending", 0.01).spans["bending"] == (0.003, 0.03)
    assert with_detail(one, "bending", 0.003).spans == {"bending": (0.0, 0.01)}


@pytest.mark.parametrize("bending", [(-0.01,), (0.31,), (float("nan"),), (float("inf"),), (0.01, 0.02)])
@pytest.mark.parametrize("name", ["coulomb_friction", "stribeck_friction"])
def test_a_contact_that_cannot_bend_so_is_refused(name, bending):
    values = {f.name: [1.0] for f in catalogue()[name].parameters() if f.name not in ("bending", "tail")}
    catalogue()[name](**values, joint=1, bending=(0.3,))
    with pytest.raises(ModelError, match="bending"):
        catalogue()[name](**values, joint=1, bending=bending)
