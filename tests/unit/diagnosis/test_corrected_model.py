"""The proof: recordings that no step has seen, and verdicts that do not hang on the filter."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from campaigns import angles_only, planted, recording
from rigs import arm

from nnhydro.diagnosis.case import opened
from nnhydro.diagnosis.engine import _term_name, corrected
from nnhydro.diagnosis.instances import instances
from nnhydro.diagnosis.naming import named, torque_peaks
from nnhydro.diagnosis.planting import planted as planted_in
from nnhydro.diagnosis.proof import foretold, prove, prove_fresh
from nnhydro.diagnosis.search import Found, race_of, search
from nnhydro.diagnosis.steadfast import drop_made_by_filter, kept_shares
from nnhydro.diagnosis.table import Table
from nnhydro.diagnosis.verdict import findings
from nnhydro.effects.catalogue import catalogue
from nnhydro.identification.prior import Prior
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.preprocessing import Preparation

ARM = arm(2)
FRICTION = 1.0  # N m, joint 1


def rubbing(count, seconds=4.0, given=True):
    """A campaign with dry friction at joint 1."""
    made = []
    for k in range(count):
        r = recording(ARM, planted(ARM), f"run{k:02d}", seed=k + 1, noise=0.003, seconds=seconds)
        assert r.qd is not None
        tau = np.array(r.tau)
        tau[:, 0] += FRICTION * np.tanh(r.qd[:, 0] / 0.01)
        made.append(replace(r, tau=tau) if given else angles_only(replace(r, tau=tau)))
    return Campaign.of(ARM, made)


def raced(campaign, keys, most=60, more=()):
    """The race over few effects with those of `keys` chosen, its table, and what is ready."""
    ready = opened(campaign, most=most)
    known = [i for i in instances(ARM, torque_peaks(ready.case.all_units)) if i.key[0] in ("coulomb_friction", "torque_ripple", *more)]
    table = Table(ready.case)
    race = race_of(table, known, ready.case.model, None)
    race.chosen = [next(c for c in race.bank.candidates if c.key == key) for key in keys]
    return race, table, ready


@pytest.fixture(scope="module")
def many():
    return rubbing(14)


def test_the_recordings_that_are_not_studied_are_the_proof(many):
    race, table, ready = raced(many, [("coulomb_friction", 1)], most=8)
    seen = prove(race, table, ready.case.model)
    fresh = prove_fresh(race, ready.case.model, ready.fresh(), seen)
    assert (seen.recordings, fresh.recordings) == (8, 6)
    assert fresh.before > 3 * fresh.after
    assert fresh.after == pytest.approx(seen.after, rel=0.2)  # as good as recordings left out one by one said
    assert fresh.residuals is seen.residuals


def test_the_error_on_fresh_recordings_is_that_of_the_fitted_torque_row_by_row(many):
    race, _, ready = raced(many, [("coulomb_friction", 1)], most=8)
    fresh = prove_fresh(race, ready.case.model, ready.fresh(), prove(race, Table(ready.case), ready.case.model))
    z, by_column = race.values(race.chosen)
    wrong = torque = 0.0
    for case in ready.fresh():
        table = Table(case)
        for piece, rows in table.rows([race.chosen[0].instance], ready.case.model):
            said = rows[..., : len(z)] @ z + rows[..., len(z):-1] @ np.array(list(by_column.values()))
            wrong, torque = wrong + np.abs(piece.y - said).sum(), torque + np.abs(piece.tau).sum()
    assert fresh.after == pytest.approx(wrong / torque, rel=1e-9)


def test_only_an_effect_that_says_so_looks_at_the_measured_torque_and_no_prediction_does(many):
    ready = opened(many, most=8)
    known = {i.key[0]: i for i in instances(ARM, torque_peaks(ready.case.all_units))}
    looking, blind = Table(ready.case), Table(ready.case, foretold=True)
    for name, one in known.items():
        same = all(np.array_equal(looking.columns(piece, [one], ready.case.model), blind.columns(piece, [one], ready.case.model))
                   for piece in looking.pieces)
        assert same != one.effect.reads_torque, name


def test_the_error_of_a_gap_is_that_of_its_prediction_and_what_remains_is_what_was_seen(many):
    race, table, ready = raced(many, [("coulomb_friction", 1), ("backlash", 1)], most=8, more=("backlash",))
    seen = prove(race, table, ready.case.model)
    told = foretold(race, ready.case, ready.case.model, seen)
    assert told.remains is seen.remains
    assert told.before == seen.before
    fresh = prove_fresh(race, ready.case.model, ready.fresh(), told)
    for case, error in ((ready.case, told.after), (next(iter(ready.fresh())), fresh.after)):
        wrong = torque = 0.0
        for piece, rows in Table(case, foretold=True).rows([c.instance for c in race.chosen], ready.case.model):
            unit = piece.number
            take = race.bench.index(np.array(sorted(k for c in race.chosen for k in c.columns)))
            left_out = race.bench.left_out(take, np.zeros(0, int))
            theta = left_out[1][unit] if case is ready.case else left_out[0]
            order = np.argsort([c.columns[0] for c in race.chosen])
            at = [*range(race.bench.p), *(race.bench.p + k for k in order)]
            wrong, torque = wrong + np.abs(piece.y - rows[..., at] @ theta).sum(), torque + np.abs(piece.tau).sum()
        assert error == pytest.approx(wrong / torque, rel=1e-6)
    alone, _, _ = raced(many, [("coulomb_friction", 1)], most=8)
    assert foretold(alone, ready.case, ready.case.model, seen) is seen


def test_what_looks_at_the_measured_torque_does_not_tell_the_noise(many):
    """A real arm's misfit would be no noise to it, and dry friction would no longer be said."""
    plain, _, _ = raced(many, [], most=8)
    looking, table, ready = raced(many, [], most=8, more=("backlash",))
    np.testing.assert_allclose(looking.noise, plain.noise, rtol=1e-9)
    assert Table(ready.case, foretold=True).of(ready.case).foretold
    assert not table.of(ready.case).foretold


def test_the_error_that_a_diagnosis_tells_is_the_foretold_one(monkeypatch):
    from nnhydro.diagnosis import engine

    monkeypatch.setattr(engine, "foretold", lambda race, case, believed, proof: replace(proof, after=0.123))
    others = [name for name in catalogue() if name != "coulomb_friction"]
    assert engine.diagnose(rubbing(6, seconds=3.0), without=others).proof.after == 0.123


def test_where_all_recordings_are_studied_the_proof_stays_as_it_is(many):
    race, table, ready = raced(many, [("coulomb_friction", 1)])
    seen = prove(race, table, ready.case.model)
    assert prove_fresh(race, ready.case.model, ready.fresh(), seen) is seen


def test_the_order_in_which_effects_were_found_does_not_change_their_errors(many):
    keys = [("torque_ripple", 2), ("coulomb_friction", 1)]
    errors = []
    for order in (keys, keys[::-1]):
        race, table, ready = raced(many, order, most=8)
        errors.append(prove_fresh(race, ready.case.model, ready.fresh(), prove(race, table, ready.case.model)))
    assert errors[0].after == pytest.approx(errors[1].after, rel=1e-9)
    for key in keys:
        assert errors[0].without[key] == pytest.approx(errors[1].without[key], rel=1e-9)


def test_an_effect_that_is_there_survives_the_cut_off_moved_and_one_that_is_not_is_dropped():
    campaign = rubbing(8, given=False)
    race, _, ready = raced(campaign, [("coulomb_friction", 1), ("torque_ripple", 2)])
    true, false = kept_shares(ready.case, race, ready.case.model, race.chosen)
    assert len(true) == 2
    assert 0.3 < min(true) <= max(true) < 3
    drop_made_by_filter(ready.case, race, ready.case.model)
    assert [c.key for c in race.chosen] == [("coulomb_friction", 1)]
    assert any("cut-off moved" in line for line in race.log)
    assert false


def test_where_nothing_is_filtered_there_is_no_cut_off_to_move(many):
    race, _, ready = raced(many, [("coulomb_friction", 1)])
    assert ready.case.moved == ()
    assert kept_shares(ready.case, race, ready.case.model, race.chosen) == [[]]


@pytest.mark.slow
def test_the_name_found_on_few_of_many_recordings_is_the_one_found_on_all(many):
    told = [{f.effect.id: f.effect.joint for f in named(opened(many, most=most).case).findings} for most in (8, 60)]
    assert told == [{"coulomb_friction": 1}] * 2


def test_a_prediction_holds_the_zero_that_a_drifting_sensor_had_at_the_end(many):
    made = []
    for k, r in enumerate(many.recordings()):
        drift = 0.5 * (k / 13) ** 3 + 0.2  # N m
        assert r.tau is not None
        made.append(replace(r, tau=r.tau + np.array([0.0, drift]), clock=1e4 + 100.0 * k + np.asarray(r.t)))
    ready = opened(Campaign.of(ARM, made))
    known = [i for i in instances(ARM, torque_peaks(ready.case.all_units)) if i.key[0] in ("torque_drift", "coulomb_friction")]
    found = search(ready.case, known, None, 0)
    model = corrected(ready.case.reference, found, findings(found.race))
    (bias,) = model.instruments
    assert (bias.id, bias.joint) == ("torque_bias", 2)
    assert bias.offset[0] == pytest.approx(0.7, abs=0.03)


def test_a_finding_called_as_a_term_of_the_baseline_stands_beside_it(many):
    race, table, ready = raced(many, [("added_mass", 0)], more=("added_mass",))
    found = Found(race, table, ready.case.model, 0.0)
    model = corrected(ready.case.reference, found, findings(race))
    assert [name for name in model.loads.terms if "added_mass" in name] == ["added_mass", "found_added_mass"]
    assert model.loads.terms["found_added_mass"] != model.loads.terms["added_mass"]
    assert _term_name(race.chosen[0].instance.effect, model.loads) == "found_found_added_mass"


def test_what_is_planted_is_planted_at_the_moved_cut_offs_too():
    race, _, ready = raced(rubbing(8, given=False), [("rotor_inertia", 2)], more=("rotor_inertia",))
    instance = race.chosen[0].instance
    case = planted_in(ready.case, [(instance, np.array([0.5]))], np.array([0.01, 0.01]), 0)
    assert len(case.moved) == 2
    for one, before in zip(case.moved, ready.case.moved, strict=True):
        (now,), (then,) = one.all_units[0].segments(), before.all_units[0].segments()
        assert now.low_pass == then.low_pass
        healthy = ready.case.model.torque(Motion.of(now)).numpy()
        added = (now.tau - now.seen(healthy))[now.keep, 1]
        assert np.corrcoef(added, now.qdd[now.keep, 1])[0, 1] > 0.99


@pytest.mark.parametrize(("size", "members"), [(0.03, 1), (0.01, 3)])
def test_a_finding_is_as_sure_as_it_and_what_its_class_holds_are_among_all_rivals(size, members):
    made = []
    for k in range(6):
        r = recording(ARM, planted(ARM), f"run{k}", seed=k + 1, noise=0.003, seconds=4.0)
        made.append(replace(r, tau=np.asarray(r.tau) + size * np.tanh(r.qd / 0.01) * [1.0, 0.0]))
    case = opened(Campaign.of(ARM, made)).case
    names = ("coulomb_friction", "stribeck_friction", "viscous_friction")
    known = [i for i in instances(ARM, torque_peaks(case.all_units)) if i.key[0] in names and i.key[1] == 1]
    race = race_of(Table(case), known, case.model, None)
    race.chosen = [next(c for c in race.bank.candidates if c.key == ("coulomb_friction", 1))]
    (finding,) = findings(race)
    assert len(finding.members) == members
    weight = np.exp(-np.maximum([rival["behind"] for rival in finding.rivals], 0) / 6)
    support = [rival["support"] for rival in finding.rivals]
    assert support == pytest.approx(weight / (1 + weight.sum()), rel=2e-3, abs=1e-12)
    same = sum(x for x, rival in zip(support, finding.rivals, strict=True) if rival["effect"] in finding.members)
    assert finding.confidence == pytest.approx(min(1 - sum(support) + same, 0.99), rel=1e-9)


@dataclass(frozen=True)
class Compared:
    """What a corrected model asks of a reference."""

    physics: StripTheory
    before: Prior
    ours: bool
    name: str = "given"

    def amended(self, before, after):
        return before, after


@pytest.mark.parametrize("ours", [True, False])
def test_the_baseline_is_refitted_beside_findings_and_where_it_stands_beside_another_simulation(ours):
    mean, F, z = np.arange(1.0, 11.0), np.diag(np.arange(0.1, 1.1, 0.1)), np.linspace(-1, 1, 10)
    physics = StripTheory(ARM, Preparation(None), {}, "constant", planted(ARM))
    assert len(torch.cat([term.linear_values() for term in physics.loads.linear().values()])) == 10
    race = SimpleNamespace(chosen=[], values=lambda kept: (z, {}))
    found = SimpleNamespace(race=race)
    before, after = corrected(Compared(physics, Prior(mean, F, -mean, mean), ours), found, [])
    at = [torch.cat([term.linear_values() for term in model.loads.linear().values()]).numpy() for model in (before, after)]
    np.testing.assert_allclose(at[0], mean)
    np.testing.assert_allclose(at[1], torch.cat([t.linear_values() for t in physics.loads.linear().values()]) if ours else mean + F @ z)
