"""Effects that act in a part of the campaign only are found with the recordings, the moment or the sector in which they do."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from campaigns import planted, recording
from rigs import arm, run

from nnhydro.diagnosis import spells as module
from nnhydro.diagnosis.case import opened
from nnhydro.diagnosis.engine import corrected, diagnose
from nnhydro.diagnosis.instances import instances
from nnhydro.diagnosis.naming import torque_peaks
from nnhydro.diagnosis.race import race_of
from nnhydro.diagnosis.search import Found, search, with_loads
from nnhydro.diagnosis.spell import Sector, Spell
from nnhydro.diagnosis.table import Table
from nnhydro.diagnosis.verdict import findings
from nnhydro.effects.catalogue import catalogue, instrument_of
from nnhydro.effects.in_sector import InSector, ReadInSector
from nnhydro.effects.sensor_view import SensorView
from nnhydro.errors import ModelError
from nnhydro.models.prediction import predict
from nnhydro.models.storage import load_model, save_model
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import term_of
from nnhydro.recordings.campaign import Campaign
from nnhydro.report.law import _acting, _with
from nnhydro.report.parameter_sheet import _values

ARM = arm(2)
FEW = ("coulomb_friction", "viscous_friction", "torque_bias", "umbilical_stiffness")
COUNT = 12


def rubbing(acts, seed=0, joint=1, count=COUNT):
    """A campaign with dry friction at `joint`, as strong in rows of recording k as acts(k, t, q) says; the clock ran backward."""
    made = []
    for k in range(count):
        r = recording(ARM, planted(ARM), f"run{k:02d}", seed=k + 1 + 100 * seed, noise=0.003, seconds=4.0)
        tau = np.array(r.tau)
        tau[:, joint - 1] += acts(k, np.asarray(r.t), r.q) * np.tanh(r.qd[:, joint - 1] / 0.01)
        made.append(replace(r, tau=tau, clock=1e5 - 100.0 * k + np.asarray(r.t)))
    return Campaign.of(ARM, made)


def found(campaign, only=FEW):
    case = opened(campaign).case
    known = [i for i in instances(ARM, torque_peaks(case.all_units)) if i.key[0] in only]
    return search(case, known, None, 0).race


@pytest.mark.parametrize(("acts", "since", "until"), [
    (lambda k, t, q: 1.0 * (k < 6), "run05", None),  # recorded last by the clock: run05 down to run00
    (lambda k, t, q: 1.0 * (k >= 7), None, "run07"),
])
def test_an_effect_that_begins_or_ends_between_two_recordings_is_found_with_the_recording(acts, since, until):
    race = found(rubbing(acts))
    (chosen,) = race.chosen
    assert chosen.key == ("coulomb_friction", 1)
    assert (chosen.instance.spell.since, chosen.instance.spell.until) == (since, until)
    (finding,) = findings(race)
    assert finding.parameters["level"]["value"] == pytest.approx(1.0, rel=0.1)
    assert finding.document(1.0, 0.5)["acts"] == chosen.instance.spell.document()
    assert f"It acts {chosen.instance.spell.sentence()} only." in finding.statement
    assert finding.lasts == (until is None)


def test_what_acts_in_a_part_is_told_from_others_that_could_act_there_too():
    race = found(rubbing(lambda k, t, q: 1.0 * (k < 6)))
    (chosen,) = race.chosen
    there = [c for c in race.bank.candidates if c.instance.spell == chosen.instance.spell and c.key != chosen.key]
    viscous = next(c for c in there if c.key == ("viscous_friction", 1))
    behind = race.total([viscous], [chosen]) - race.total()
    assert 0 < behind < race.total(without=[chosen]) - race.total(), "viscous friction explains some of it, where there is any friction"
    assert findings(race)[0].rivals[0]["behind"] == pytest.approx(behind, abs=0.01)
    assert not any(c.own for c in there), "a phase of each recording's own is no rival in a part"


@pytest.mark.parametrize("acts", [lambda k, t, q: 1.0, lambda k, t, q: 0.8 + 0.4 * (k % 2), lambda k, t, q: 0.7 + 0.05 * k])
def test_an_effect_that_always_acts_has_no_spell_though_it_varies(acts):
    (chosen,) = found(rubbing(acts)).chosen
    assert chosen.key == ("coulomb_friction", 1)
    assert chosen.instance.spell is None


def test_an_effect_in_four_recordings_of_twelve_is_found_though_most_recordings_know_nothing_of_it():
    (chosen,) = found(rubbing(lambda k, t, q: 1.0 * (k < 4))).chosen
    assert chosen.key == ("coulomb_friction", 1)
    assert chosen.instance.spell.since == "run03"


def test_a_healthy_arm_has_no_spells():
    for seed in range(3):
        assert found(rubbing(lambda k, t, q: 0.0, seed)).chosen == []


def test_a_moment_within_a_recording_is_told_to_a_tenth_of_a_second():
    (chosen,) = found(rubbing(lambda k, t, q: 1.0 * ((k < 5) | ((k == 5) & (t >= 1.7))))).chosen  # run05 is the seventh by the clock
    spell = chosen.instance.spell
    assert (chosen.key, spell.since, spell.until) == (("coulomb_friction", 1), "run05", None)
    assert spell.since_s == pytest.approx(1.7, abs=0.1)
    (chosen,) = found(rubbing(lambda k, t, q: 1.0 * ((k > 5) | ((k == 5) & (t < 2.3))))).chosen
    assert (chosen.instance.spell.until, chosen.instance.spell.since) == ("run05", None)
    assert chosen.instance.spell.until_s == pytest.approx(2.3, abs=0.1)


def test_an_effect_that_comes_and_goes_is_found_with_its_recordings():
    at = {1, 4, 5, 8, 10}
    race = found(rubbing(lambda k, t, q: 1.0 * (k in at)))
    (chosen,), (finding,) = race.chosen, findings(race)
    assert (chosen.key, chosen.instance.spell.inside) == (("coulomb_friction", 1), {f"run{k:02d}" for k in at})
    assert not finding.lasts  # nobody knows whether it acts in the next one


def test_an_effect_in_a_sector_of_the_other_joints_angle_is_found_with_it():
    race = found(rubbing(lambda k, t, q: 1.0 * ((q[:, 1] >= 0.2) & (q[:, 1] < 1.0))))
    (chosen,), (finding,) = race.chosen, findings(race)
    sector = chosen.instance.spell.sector
    assert (chosen.key, sector.joint) == (("coulomb_friction", 1), 2)
    assert (sector.low, sector.high) == pytest.approx((0.2, 1.0), abs=0.07)
    assert finding.parameters["level"]["value"] == pytest.approx(1.0, rel=0.1)
    assert finding.lasts


def test_recordings_that_no_search_has_seen_are_judged_by_their_own_place_in_the_campaign():
    campaign = rubbing(lambda k, t, q: 1.0 * (k < 14), count=28)
    said: list[str] = []
    diagnosis = diagnose(campaign, most=14, without=[name for name in catalogue() if name not in FEW], progress=said.append)
    (finding,) = diagnosis.findings
    assert finding.candidate.instance.spell.since in {f"run{k:02d}" for k in range(14)}
    assert diagnosis.proof.recordings == 14
    assert diagnosis.proof.after < 0.3 * diagnosis.proof.before
    assert diagnosis.noise_floor < diagnosis.proof.after < 1.4 * diagnosis.noise_floor, "what is left is little more than the noise"
    assert said[0] == "round 1: nothing yet"
    assert said[-1] == "proof: 0 of 14 recordings that took no part"
    assert diagnosis.rehearsal is None, "nobody asked for one"


def test_a_hose_that_pulls_in_a_sector_is_a_spring_there_and_no_part_of_a_ripple():
    made = []
    for k in range(COUNT):
        r = recording(ARM, planted(ARM), f"run{k:02d}", seed=k + 1, noise=0.003, seconds=4.0)
        tau, q = np.array(r.tau), r.q[:, 0]
        tau[:, 0] += 0.6 * (q + 0.5) * ((q > 0.0) & (q < 0.6))
        made.append(replace(r, tau=tau))
    race = found(Campaign.of(ARM, made), (*FEW, "torque_ripple"))
    (chosen,) = race.chosen
    assert chosen.key == ("umbilical_stiffness", 1)
    assert chosen.instance.spell.sector.low == pytest.approx(0.0, abs=0.07)
    values = race.values(race.chosen)[1]
    assert [values[k] for k in chosen.columns] == pytest.approx([0.6, 0.3], abs=0.02), "the linear law, which is all that there is"
    there = [c for c in race.bank.candidates if c.instance.spell == chosen.instance.spell]
    assert len(there) > 1
    assert all(chosen.instance.spell.sector.shows(c.instance.effect) for c in there), "no ripple whose period the sector does not hold"


def test_every_law_of_an_effect_is_asked_when_it_acts(monkeypatch):
    asked = []
    monkeypatch.setattr(module, "_in_time", lambda race, table, believed, candidate, others, order: iter(asked.append(candidate) or ()))
    monkeypatch.setattr(module, "_in_space", lambda *given: iter(()))
    found(rubbing(lambda k, t, q: 1.0 * (k < 5)), FEW)
    assert {c.instance.width for c in asked if c.key == ("umbilical_stiffness", 1)} == {2, 4}, "the linear hose and the general one"


def test_a_sector_shows_a_ripple_where_a_period_of_it_fits():
    ripple = instances(ARM, (1.0, 1.0))
    slow, fast = (next(i.effect for i in ripple if i.key == ("torque_ripple", 1) and i.effect.periods == (n,)) for n in (4.0, 20.0))
    assert slow.narrowest() == pytest.approx(np.pi / 2)
    narrow = Sector(1, -0.2, 0.3)
    assert (narrow.shows(fast), narrow.shows(slow)) == (True, False)
    assert replace(narrow, high=None).shows(slow), "open: the joint's own range ends it"
    assert replace(narrow, joint=2).shows(slow), "the other joint's angles have nothing to do with its period"
    assert narrow.shows(next(i.effect for i in ripple if i.key == ("umbilical_stiffness", 1)))


def test_what_is_confined_to_a_sector_is_confined_in_the_corrected_model_too(tmp_path):
    campaign = rubbing(lambda k, t, q: 1.0 * (q[:, 0] > 0.1))
    diagnosis = diagnose(campaign, without=[name for name in catalogue() if name not in FEW])
    (term,) = [t for t in diagnosis.corrected.loads.terms.values() if isinstance(t, InSector)]
    assert term.low == pytest.approx(0.1, abs=0.07)
    r = campaign.load("run03")
    there = [predict(model, r).tau - predict(replace(model, loads=Loads({n: t for n, t in model.loads.terms.items() if t != term})), r).tau
             for model in (diagnosis.corrected, load_model(save_model(diagnosis.corrected, tmp_path / "model")))]
    assert np.array_equal(*there)
    q = np.asarray(r.q)[:, 0]
    assert np.abs(there[0][q < term.low - 0.2]).max() < 0.05
    assert np.abs(there[0][q > term.low + 0.2, 0]).max() > 0.8


def test_a_fault_of_a_drive_that_is_confined_to_a_sector_is_confined_in_the_corrected_model_too(tmp_path):
    made = []
    for k in range(COUNT):
        r = recording(ARM, planted(ARM), f"run{k:02d}", seed=k + 1, noise=0.003, seconds=4.0)
        tau, q = np.array(r.tau), np.asarray(r.q)[:, 0]
        tau[:, 0] += 0.3 * np.abs(tau[:, 0]) * np.tanh(np.asarray(r.qd)[:, 0] / 0.02) * (q > 0.1)
        made.append(replace(r, tau=tau))
    case, spell = opened(Campaign.of(ARM, made)).case, Spell(sector=Sector(1, 0.1, None))
    known = [replace(i, spell=spell) for i in instances(ARM, torque_peaks(case.all_units)) if i.key == ("load_friction", 1)]
    race = race_of(table := Table(case), known, case.model, None)
    race.chosen = list(race.bank.candidates)
    model = corrected(case.reference, Found(race, table, case.model, 0.0), findings(race))
    (rubs,) = model.instruments
    assert (rubs.id, rubs.joint, rubs.low, rubs.high, rubs.effect.joint) == ("load_friction", 1, 0.1, None, 1)
    assert rubs.effect.coefficient[0] == pytest.approx(0.3, abs=0.05), "on the torque of a baseline that nobody has settled beside it"
    r, without = made[3], replace(model, instruments=())
    there = [predict(one, r).tau - predict(without, r).tau for one in (model, load_model(save_model(model, tmp_path / "model")))]
    assert np.array_equal(*there)
    q = np.asarray(r.q)[:, 0]
    assert np.abs(there[0][q < rubs.low - 1e-9]).max() == 0
    assert np.abs(there[0][q > rubs.low, 0]).max() > 0.1
    assert any(label.startswith("load_friction.coefficient") for label in _values(model)), "the sheet tells its value"
    assert _with(model, rubs.effect, None).instruments == ()
    moved = replace(rubs.effect, coefficient=(0.4,))
    assert [one.effect for one in _with(model, rubs.effect, moved).instruments] == [moved]


def test_a_spell_and_its_opposite_share_all_rows():
    rng = np.random.default_rng(3)
    place, state = np.sort(rng.uniform(-1, 1, 50)), {"q1_rad": rng.uniform(-2, 2, 50), "q2_rad": rng.uniform(-2, 2, 50)}
    parts = (Spell(begin=0.1, since="b"), Spell(end=-0.2, until="a"), Spell(inside=frozenset("a")), Spell(sector=Sector(2, -0.5, None)))
    for spell in parts:
        inside, outside = spell.mask("a", place, state), spell.opposite.mask("a", place, state)
        assert (inside ^ outside).all()
    assert np.array_equal(Spell(begin=0.1).mask("a", place, state), place >= 0.1)
    assert np.array_equal(Spell(end=0.1).mask("a", place, state), place < 0.1)
    assert not Spell(begin=0.1).mask("a", None, state).any()


def test_a_spell_in_words():
    assert Spell(since="a").sentence() == "from a on"
    assert Spell(until="b", until_s=2.5).sentence() == "up to 2.50 s of b"
    assert Spell(since="a", until="b").sentence() == "from a to b"
    assert Spell(inside=frozenset("ca")).sentence() == "in a, c"
    assert Spell(sector=Sector(2, -0.5, 0.25)).sentence() == "while joint 2 lies between -0.50 and 0.25 rad"


def test_a_term_in_a_sector_is_the_term_there_and_nothing_elsewhere():
    motion, term = run(2), catalogue()["viscous_friction"].started(ARM, joint=2)
    flow = Flow(ARM, motion)
    whole, q = term.torque(flow), motion.q[:, 0]
    for low, high in ((-0.2, 0.4), (None, 0.1), (0.1, None), (None, None)):
        there = InSector(1, low, high, term)
        acts = Sector(1, low, high).holds(q.numpy())
        assert np.array_equal(there.torque(flow).numpy(), whole.numpy() * acts[:, None])
        assert term_of(json.loads(json.dumps(there.document()))) == there


@pytest.mark.parametrize("broken", [{"joint": 0}, {"joint": 1.5}, {"low": "0"}, {"term": 3}, {"term": {"kind": "nobody"}}])
def test_a_sector_that_makes_no_sense_is_refused(broken):
    options = {"joint": 1, "low": 0.0, "high": 1.0, "term": catalogue()["viscous_friction"].started(ARM, joint=1).document()} | broken
    with pytest.raises(ModelError):
        term_of({"kind": "in_sector", "parameters": {}, "options": options})


@pytest.mark.parametrize(("low", "high"), [(-0.2, 0.4), (None, 0.1), (0.1, None), (None, None)])
def test_a_reading_that_errs_in_a_sector_is_right_outside_it(low, high):
    effect = catalogue()["torque_gain"](joint=2, error=(0.2,))
    motion = run(2)
    view = SensorView(Flow(ARM, motion), lambda flow: planted(ARM).torque(flow))
    there = ReadInSector(low, high, effect, joint=1)
    acts = Sector(1, low, high).holds(motion.q[:, 0].numpy())[:, None]
    np.testing.assert_array_equal(there.apply(view), view.tau + (effect.apply(view) - view.tau) * torch.from_numpy(acts))
    np.testing.assert_array_equal(there.columns(view), effect.columns(view) * torch.from_numpy(acts)[..., None])
    assert (there.id, there.stage) == (effect.id, effect.stage)
    assert instrument_of(json.loads(json.dumps(there.document()))) == there


@pytest.mark.parametrize("broken", [{"joint": 0}, {"joint": 1.5}, {"low": "0"}, {"low": float("nan")}, {"high": True}, {"effect": 3},
                                    {"effect": {}}, {"effect": {"kind": "read_in_sector"}}])
def test_a_reading_in_a_sector_that_makes_no_sense_is_refused(broken):
    effect = catalogue()["torque_gain"](joint=2, error=(0.2,)).document()
    with pytest.raises(ModelError):
        instrument_of({"kind": "read_in_sector", "options": {"joint": 1, "low": 0.0, "high": 1.0, "effect": effect} | broken})


def test_a_reading_is_not_confined_to_a_sector_twice():
    effect = ReadInSector(0.0, 1.0, catalogue()["torque_gain"](joint=2, error=(0.2,)), joint=1)
    with pytest.raises(ModelError, match="acts everywhere"):
        ReadInSector(0.0, 1.0, effect, joint=2)


def test_the_law_of_what_acts_in_a_part_is_drawn_over_the_rows_of_that_part():
    def trace(name):
        keep, q = np.array([False, True, True, True]), np.array([[0.0], [0.1], [0.5], [0.9]])
        return SimpleNamespace(segment=SimpleNamespace(recording=name, keep=keep, q=q))

    def finding(spell):
        return SimpleNamespace(candidate=SimpleNamespace(instance=SimpleNamespace(spell=spell)))

    traces = [trace("a"), trace("b")]
    assert _acting(finding(None), traces).all()
    assert _acting(finding(Spell(sector=Sector(1, 0.3, None))), traces).tolist() == [False, True, True] * 2
    later = Spell(begin=0.0, since="a", since_s=1.0, throughout=frozenset("b"))
    assert _acting(finding(later), traces).tolist() == [False] * 3 + [True] * 3


def test_shapes_that_a_round_does_not_refine_are_all_tried_again_in_it(monkeypatch):
    from nnhydro.diagnosis import search as module

    case = opened(rubbing(lambda k, t, q: 1.0, count=6)).case
    many = {"wall_proximity", "flow_memory", "vortex_shedding"}
    known = [i for i in instances(ARM, torque_peaks(case.all_units)) if i.key[0] in (*FEW, *many)]
    scout, refine, asked, refined = module.scouted, module._refined, [], []

    def scouted(table, some, *given):
        asked.append({one.key[0] for one in some})
        return scout(table, some, *given)

    def finer(*given):
        made = refine(*given)
        refined.append({one.key[0] for one in made})
        return made

    monkeypatch.setattr(module, "scouted", scouted)
    monkeypatch.setattr(module, "_refined", finer)
    assert [c.key for c in search(case, known, None, 0).race.chosen] == [("coulomb_friction", 1)]
    assert asked == [many, *(many - one for one in refined)]
    assert any(asked[1:])


def test_a_load_that_acts_in_a_part_is_no_term_of_what_the_instruments_are_read_beside():
    case = opened(rubbing(lambda k, t, q: 1.0, count=6)).case
    known = [i for i in instances(ARM, torque_peaks(case.all_units)) if i.key in (("coulomb_friction", 1), ("viscous_friction", 2))][:2]
    late = replace(known[0], spell=Spell(begin=0.0, since="run02"))
    race = race_of(Table(case), [late, known[1]], case.model, None)
    kept = list(race.bank.candidates)
    assert set(with_loads(case, race, kept).loads.terms) == {*case.model.loads.terms, "found_1"}
    always = race_of(Table(case), known, case.model, None)
    assert set(with_loads(case, always, list(always.bank.candidates)).loads.terms) == {*case.model.loads.terms, "found_0", "found_1"}
