"""Rounds of the search: three tests of "nothing is missing", and the model on whose reading faults of sensors are refined."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import planted, recording
from races import P, Plain, instance, raced, tables
from rigs import arm

from nnhydro.diagnosis import search as module
from nnhydro.diagnosis.case import opened
from nnhydro.diagnosis.instances import instances
from nnhydro.diagnosis.naming import torque_peaks
from nnhydro.diagnosis.race import race_of
from nnhydro.diagnosis.search import Found, _refined, in_a_part, mismatch, search, with_loads
from nnhydro.diagnosis.table import Table
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign

ARM = arm(2)
FRICTION = 0.3  # N m, of the first joint's dry friction
COMMON, OWN = instance("common", (0,)), instance("own", (2,), own=(0,))


def p_of(made):
    return mismatch(Plain(made), [COMMON, OWN], None, 0)[0]


def test_each_of_three_tests_says_that_something_is_missing_and_the_p_pays_for_all_three():
    assert p_of(tables(40)) > 0.05
    assert p_of(tables(40, {0: 0.6})) == pytest.approx(3 / 1000), "no random signs of the blocks do as well"
    rng, phased, heavy = np.random.default_rng(40), tables(40), tables(40)
    for one, other in zip(phased, heavy, strict=True):
        one[..., -1] += rng.choice([-2.0, 2.0]) * one[..., P + 2]  # of another sign in every recording: blocks cannot testify
        other[..., -1] += 9.0 * other[..., 0]  # a mass ten standard deviations off, and no residual
    assert p_of(phased) == pytest.approx(3 / 1000)
    assert p_of(heavy) == pytest.approx(3 / 1000)


def test_where_random_signs_of_blocks_are_silent_left_out_likelihood_speaks_among_all_that_are_tried(monkeypatch):
    """A few telling blocks have few signs; a gain of 6 log(3 660 / 0.01) = 73 in what is left out is one in a hundred all the same."""
    monkeypatch.setattr(module.Extremes, "p_value", 1.0)
    found = {size: p_of(tables(40, {0: size})) for size in (0.6, 0.0)}
    assert found[0.6] == pytest.approx(3 / 1000)
    assert found[0.0] > 0.05
    monkeypatch.setattr(module, "gains", lambda race, tried: [(72.5, None), (-3.0, None)])
    assert p_of(tables(40)) > 0.01
    monkeypatch.setattr(module, "gains", lambda race, tried: [(-3.0, None), (73.8, None)])
    assert p_of(tables(40)) < 0.01


def test_what_is_found_in_a_part_of_the_campaign_has_a_p_that_is_a_bound(monkeypatch):
    race = raced(table := Plain(tables(41)), [COMMON])
    nothing, acting = Found(race, table, None, 0.4), replace(race, chosen=list(race.bank.candidates))
    for within, p in ((None, 0.4), (race, 0.4), (acting, 0.01)):
        monkeypatch.setattr(module, "_in_parts", lambda *given, within=within: within)
        told = in_a_part(nothing, None, 0)
        assert (told.p_value, told.race) == (p, acting if within is acting else race)


def rubbing(gain):
    """A case with dry friction at joint 1 and a sensor of that `gain` at joint 2, and the race in which both are chosen."""
    made = []
    for k in range(6):
        r = recording(ARM, planted(ARM), f"run{k}", seed=k + 1, noise=0.003, seconds=4.0)
        friction = FRICTION * np.tanh(np.asarray(r.qd) / 0.02) * [1.0, 0.0]
        made.append(replace(r, tau=(np.asarray(r.tau) + friction) * [1.0, gain]))
    case = opened(Campaign.of(ARM, made)).case
    keys = [("coulomb_friction", 1), ("torque_gain", 2), ("torque_crosstalk", 2)]
    known = {i.key: i for i in reversed(instances(ARM, torque_peaks(case.all_units))) if i.key in keys}  # the first law of each
    race = race_of(Table(case), [known[key] for key in keys], case.model, None)
    race.chosen = list(race.bank.candidates[:2])
    return case, race


def test_the_model_fitted_beside_what_was_found_gives_the_torque_that_was_measured():
    case, race = rubbing(1.0)
    model = with_loads(case, race, race.chosen[:1])
    assert model.loads.terms["found_0"].level[0] == pytest.approx(FRICTION, rel=0.02)
    for unit in case.all_units:
        (segment,) = unit.segments()
        wrong = (segment.tau - model.torque(Motion.of(segment)).numpy())[segment.keep]
        assert ((wrong**2).mean(axis=0) < 0.005**2 * (segment.tau**2).mean(axis=0)).all()  # the noise is 0.003 of the torque


def test_a_fault_of_a_sensor_is_refined_on_the_reading_of_the_model_fitted_with_it_and_with_what_is_chosen():
    case, race = rubbing(1.1)
    friction, gain = race.chosen
    (refined,) = (one for one in _refined(case, race) if one.key == gain.key)
    z, by_column = race.values([friction, gain])
    assert refined.effect.linear_values().tolist() == pytest.approx([by_column[k] for k in gain.columns])
    assert refined.effect.linear_values().tolist() == pytest.approx([0.1], abs=0.02)
    loads = refined.believed.loads
    assert "coulomb_friction" in [getattr(term, "id", None) for term in loads.terms.values()]
    values = torch.cat([loads.terms[name].linear_values() for name in case.model.loads.linear()]).numpy()
    np.testing.assert_allclose(values, case.before.mean + case.before.F @ z)


def test_other_laws_of_a_refined_effect_stay_in_the_bank_as_they_are():
    case, race = rubbing(1.0)
    known = [i for i in instances(ARM, torque_peaks(case.all_units)) if i.key[0] == "drag_form"]
    race = race_of(Table(case), [*(c.instance for c in race.bank.candidates), *known], case.model, None)
    laws = [one.effect.linear_names() for one in known]
    assert len(set(laws)) == len(laws) > 3
    race.chosen = [next(c for c in race.bank.candidates if c.instance is known[-1])]
    again = [one.effect.linear_names() for one in _refined(case, race) if one.key == known[0].key]
    assert sorted(again) == sorted(laws), "each law once"


def test_what_sensors_read_in_the_end_is_the_torque_of_the_model_with_what_was_found():
    case, race = rubbing(1.0)
    found = search(case, [c.instance for c in race.bank.candidates], None, 0)
    assert [c.key for c in found.race.chosen] == [("coulomb_friction", 1)]
    (segment,) = case.all_units[0].segments()
    wrong = (segment.tau - found.believed.torque(Motion.of(segment)).numpy())[segment.keep]
    assert ((wrong**2).mean(axis=0) < 0.005**2 * (segment.tau**2).mean(axis=0)).all()
