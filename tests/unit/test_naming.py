"""Naming: what is said of a choice, with how much confidence, and what is left out as too small or unsure."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from races import NOISE, SINGLE, K, candidate, race, tables

from nnhydro.diagnosis import naming
from nnhydro.diagnosis.locate import Residual
from nnhydro.diagnosis.naming import _least, explained, torque_peaks
from nnhydro.diagnosis.search import Found
from nnhydro.effects.catalogue import catalogue


def test_the_share_explained_is_the_gain_of_all_findings_over_the_excess_beyond_what_the_noise_is_known_to():
    made = tables(19, {0: 0.6, 4: 0.6})
    part, whole = race(made, chosen=(0,)), race(made).scored().total
    gain, rows_ = whole - part.scored().total, 2 * sum(len(table) for table in made)
    assert explained(part) == pytest.approx(gain / (whole - 0.05 * rows_ / 2))
    assert 0.2 < explained(part) < 0.8
    both = race(made, chosen=(0, 4))
    assert explained(both) > 0.95
    assert explained(both, [both.chosen[1]]) == pytest.approx(explained(part))
    quiet = race(tables(19, noise=0.5 * NOISE), chosen=(0,))
    whole, with_it = race(tables(19, noise=0.5 * NOISE)).scored().total, quiet.scored().total
    assert whole < 1
    assert explained(quiet) == pytest.approx(whole - with_it)


def proof_of(before, after, **without):
    return SimpleNamespace(before=before, after=after, without={(name, 0): e for name, e in without.items()}, remains=[])


def test_a_finding_goes_that_adds_little_on_left_out_recordings_and_in_the_score():
    found = race(tables(20, {0: 0.8, 4: 0.12}), chosen=(0, 4))
    scores = {k: found.total(without=[SINGLE[k]]) - found.total() for k in (0, 4)}
    whole = found.total(without=found.chosen) - found.total()
    assert scores[4] < 0.15 * whole < scores[0]
    assert _least(found, proof_of(0.5, 0.1, effect_0=0.45, effect_4=0.12)) is SINGLE[4]
    assert _least(found, proof_of(0.5, 0.1, effect_0=0.45, effect_4=0.126)) is None, "six hundredths of the improvement is enough"
    assert _least(found, proof_of(0.5, 0.1, effect_0=0.11, effect_4=0.2)) is None, "so is a sixth of the gain in score"
    even = race(tables(20, {0: 0.12, 4: 0.12, 2: 1.0}), chosen=(0, 4, 2))
    assert _least(even, proof_of(0.5, 0.1, effect_0=0.11, effect_4=0.105, effect_2=0.4)) is SINGLE[4], "the least of them"


def test_peaks_of_the_torque_are_those_of_rows_that_are_compared():
    keep = np.array([True, True, False])
    segments = [SimpleNamespace(tau=np.array([[1.0, -5.0], [-2.0, 3.0], [9.0, 9.0]]), keep=keep), SimpleNamespace(tau=None, keep=keep),
                SimpleNamespace(tau=np.full((3, 2), 99.0), keep=np.zeros(3, dtype=bool)),
                SimpleNamespace(tau=np.array([[0.5, 0.5], [-3.0, 0.1], [0.0, 0.0]]), keep=keep)]
    assert torque_peaks([SimpleNamespace(segments=lambda: segments[:2]), SimpleNamespace(segments=lambda: segments[2:])]) == (3.0, 5.0)


@dataclass(frozen=True)
class Said:
    confidence: float


@pytest.mark.parametrize(("share", "said"), [(0.9, 0.8), (0.6, 0.8), (0.3, 0.4), (0.15, 0.2)])
def test_findings_that_explain_little_together_are_said_with_less_confidence(monkeypatch, share, said):
    monkeypatch.setattr(naming, "findings", lambda race: [Said(0.8)])
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: 1)
    monkeypatch.setattr(naming, "explained", lambda race: share)
    bank = (candidate("plain", (0,), effect=SimpleNamespace(foreseen=1.0)), candidate("gap", (1,), effect=SimpleNamespace(foreseen=0.4)))
    for planted, chosen, told in (({}, (0,), said), ({0: 0.8}, (0, 1), said), ({1: 0.8}, (0, 1), 0.8 * min(1.0, share / 0.24))):
        made = race(tables(1, planted), bank, chosen=chosen)  # of a gap nobody expects more
        assert [f.confidence for f in naming.trusted(made)] == pytest.approx([told])
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: 0)  # what remains is nothing that anything is known to be the cause of
    for made, foreseen in ((race(tables(1), bank, chosen=(0,)), 1.0), (race(tables(1, {1: 0.8}), bank, chosen=(0, 1)), 0.4)):
        assert [f.confidence for f in naming.trusted(made)] == pytest.approx([0.8 * min(1.0, share / (0.36 * foreseen))])


@pytest.mark.parametrize(("share", "trust"), [(0.9, 1.0), (0.89, 0.9917), (0.6, 0.75), (0.3, 0.5), (0.24, 0.4)])
def test_where_more_is_sure_to_be_there_full_trust_takes_nine_tenths_and_half_of_it_no_more_than_else(monkeypatch, share, trust):
    monkeypatch.setattr(naming, "findings", lambda race: [Said(0.8)])
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: 2)
    monkeypatch.setattr(naming, "explained", lambda race: share)
    made = race(tables(1, {0: 0.5}), FORESEEN, chosen=(0,))
    assert [f.confidence for f in naming.trusted(made)] == pytest.approx([0.8 * trust], rel=1e-3)


@pytest.fixture
def naming_of(monkeypatch):
    """`named` over a race, in which only the findings' confidence and what a proof says are of the test's own making."""
    def told(found, confidence, gains, share=1.0):
        said = Found(found, None, None, 0.0)
        made = {"search": lambda *given: said, "instances": lambda *given: [], "torque_peaks": lambda units: (),
                "detailed": lambda given, race: race,
                "prune": lambda *given: None, "drop_untuned": lambda *given: None, "drop_made_by_filter": lambda *given: None,
                "simplest": lambda race: race.chosen, "explained": lambda race, without=(): share,
                "findings": lambda race: [Told(confidence[c.key[0]], c) for c in race.chosen],
                "prove": lambda race, *given: proof_of(1.0, 0.1, **{c.key[0]: 0.1 + gains[c.key[0]] for c in race.chosen})}
        for name, value in made.items():
            monkeypatch.setattr(naming, name, value)
        case = SimpleNamespace(model=SimpleNamespace(arm=None), all_units=())
        return [f.candidate.key[0] for f in naming.named(case).findings]
    return told


@dataclass(frozen=True)
class Told:
    """What naming asks of a finding."""

    confidence: float
    candidate: object


FORESEEN = tuple(candidate(f"effect_{k}", (k,), effect=SimpleNamespace(foreseen=1.0, akin=(), signature=SimpleNamespace(mistaken_for=())))
                 for k in range(K))


def test_waves_are_asked_for_their_pitch_before_all_and_leftovers_before_confidence(naming_of, monkeypatch):
    made, asked = race(tables(23, dict.fromkeys(range(4), 0.6)), FORESEEN, chosen=(0, 1)), []
    sure = {f"effect_{k}": 0.9 for k in range(4)}
    naming_of(made, sure, dict.fromkeys(sure, 1.0))
    monkeypatch.setattr(naming, "detailed", lambda given, race: asked.append("detailed") or race)
    for name in ("drop_untuned", "prune", "drop_impossible", "drop_leftovers", "drop_faint", "trusted"):
        real = getattr(naming, name)
        monkeypatch.setattr(naming, name, lambda *given, name=name, real=real: asked.append(name) or real(*given))
    naming.named(SimpleNamespace(model=SimpleNamespace(arm=None), all_units=()))
    assert asked[:8] == ["detailed", "drop_untuned", "prune", "drop_impossible", "drop_leftovers", "drop_faint", "drop_impossible",
                         "trusted"]


@pytest.mark.parametrize(("coloured", "share", "sure", "told"), [
    (False, 0.5, 0.7, ["effect_0"]), (True, 0.5, 0.7, []), (True, 0.5, 0.9, ["effect_0"]), (True, 0.9, 0.5, ["effect_0"])])
def test_where_what_remains_is_no_noise_a_finding_that_explains_little_is_trusted_less(naming_of, monkeypatch, coloured, share, sure, told):
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: 0)
    monkeypatch.setattr(naming, "is_coloured", lambda proof: coloured)
    assert naming_of(race(tables(20, {0: 0.8}), FORESEEN, chosen=(0,)), {"effect_0": sure}, {"effect_0": 1.0}, share) == told


def test_what_remains_is_coloured_where_it_is_correlated_at_any_joint():
    rng = np.random.default_rng(4)
    white = rng.standard_normal((400, 2))
    slow = white.copy()
    slow[:, 1] = np.convolve(rng.standard_normal(411), np.ones(12))[11:411]
    for r, coloured in ((white, False), (slow, True), (slow[:, :1], False)):
        proof = SimpleNamespace(remains=[Residual("a", r, {}, 0.02)])
        assert naming.is_coloured(proof) == coloured
    assert not naming.is_coloured(SimpleNamespace(remains=[]))


@pytest.mark.parametrize(("third", "left"), [(0.05, [0, 4]), (0.12, [0, 4, 3]), (0.0, [0, 4])])
def test_what_gains_less_than_chance_may_is_not_claimed(third, left):
    found = race(tables(20, {0: 0.8, 4: 0.12, 3: third}), FORESEEN, chosen=(3, 0, 4))
    gain = found.loss(FORESEEN[3])
    assert (gain < naming.SEEN) == (3 not in left)
    naming.drop_faint(found)
    assert sorted(found.chosen, key=FORESEEN.index) == sorted((FORESEEN[k] for k in left), key=FORESEEN.index)
    nothing = race(tables(20), FORESEEN, chosen=(0, 1))
    naming.drop_faint(nothing)
    assert nothing.chosen == []


def test_what_is_likelier_wrong_than_right_is_not_said(naming_of):
    made = race(tables(23, dict.fromkeys(range(4), 0.6)), FORESEEN, chosen=(0, 1, 2, 3))
    told = naming_of(made, dict(zip((f"effect_{k}" for k in range(4)), (0.9, 0.49, 0.5, 0.51), strict=True)),
                     {f"effect_{k}": 1.0 for k in range(4)})
    assert told == ["effect_0", "effect_2", "effect_3"]


def test_what_is_said_is_asked_again_for_its_confidence_when_another_finding_has_gone(monkeypatch):
    monkeypatch.setattr(naming, "findings", lambda race: [Told(0.9 if c is FORESEEN[0] else 0.4, c) for c in race.chosen])
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: 1)
    for alone, left in ((0.1, []), (0.5, [FORESEEN[0]])):  # what the first explains without the second, which is likelier wrong
        monkeypatch.setattr(naming, "explained", lambda race, without=(), alone=alone: 0.9 if len(race.chosen) == 2 else alone)
        found = race(tables(20, {0: 0.8, 4: 0.8}), FORESEEN, chosen=(0, 4))
        said = naming.sure(found)
        assert found.chosen == [f.candidate for f in said] == left
        assert all(f.confidence >= naming.CONFIDENT for f in said)


def test_findings_that_add_too_little_go_one_by_one_and_the_last_stays(naming_of, monkeypatch):
    asked, real = [], naming.drop_impossible
    monkeypatch.setattr(naming, "drop_impossible", lambda race: asked.append(len(race.chosen)) or real(race))
    made = tables(20, {0: 0.8, 4: 0.12, 3: 0.12})
    sure = {f"effect_{k}": 0.9 for k in range(K)}
    for gains, left in (((0.5, 0.01, 0.02), [0]), ((0.5, 0.2, 0.02), [0, 4]), ((0.5, 0.2, 0.2), [0, 4, 3])):
        told = naming_of(race(made, FORESEEN, chosen=(0, 4, 3)), sure, dict(zip(("effect_0", "effect_4", "effect_3"), gains, strict=True)))
        assert told == [f"effect_{k}" for k in left]
        assert asked == [3, 3, *range(2, len(left) - 1, -1)], "whatever is taken away, what is impossible without it goes, too"
        asked.clear()
    alone = naming_of(race(tables(20, {4: 0.12}), FORESEEN, chosen=(4,)), sure, {"effect_4": 0.0})
    assert alone == ["effect_4"], "beside nothing else it need not add a share"


@pytest.mark.parametrize(("names", "joints", "left"), [
    (("backlash", "joint_elasticity"), (1, 1), [1]), (("joint_elasticity", "backlash"), (1, 1), [0, 1]),
    (("backlash", "joint_elasticity"), (2, 1), [0, 1]), (("torque_gain", "torque_saturation"), (1, 1), [0, 1])])
def test_beside_a_soft_drive_no_gap_is_claimed_at_the_same_joint_however_much_is_explained(monkeypatch, names, joints, left):
    monkeypatch.setattr(naming, "explained", lambda race, less=(): 0.9)
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: 1)
    bank = tuple(candidate(name, (k,), joint=joint, effect=catalogue()[name])
                 for k, (name, joint) in enumerate(zip(names, joints, strict=True)))
    found = race(tables(7, {0: 0.35, 1: 0.8}), bank, chosen=(0, 1))
    assert 0.3 < found.loss(bank[0]) / found.loss(bank[1]) < 0.3 / 0.7
    naming.drop_leftovers(found, 0)
    assert found.chosen == [bank[k] for k in left]


@pytest.mark.parametrize(("foreseen", "alike", "share", "left"), [
    (0.4, False, 0.5, [1]), (0.4, False, 0.6, [0, 1]), (0.9, False, 0.5, [0, 1]), (1.0, True, 0.3, [0, 1]),
    (0.85, False, 0.5, [0, 1]), (0.85, True, 0.5, [0, 1]), (0.7, False, 0.5, [0, 1]), (0.7, True, 0.5, [1])])
def test_what_may_be_made_of_the_part_of_another_finding_that_nobody_foretells_is_not_claimed(monkeypatch, foreseen, alike, share, left):
    without = []
    monkeypatch.setattr(naming, "explained", lambda race, less=(): without.append(less) or share)
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: 1)
    seen = SimpleNamespace(mistaken_for=("effect_0",) if alike else ("effect_5",))
    bank = tuple(candidate(f"effect_{k}", (k,), effect=SimpleNamespace(foreseen=value, signature=seen, akin=()))
                 for k, value in enumerate((1.0, foreseen)))
    found = race(tables(7, {0: 0.35, 1: 0.8}), bank, chosen=(0, 1))
    ratio = found.loss(bank[0]) / found.loss(bank[1])
    assert 0.3 < ratio < 0.3 / 0.7
    naming.drop_leftovers(found, 0)
    assert found.chosen == [bank[k] for k in left]
    assert all(less == [bank[0]] for less in without), "what is explained without the one that is asked"
    assert bool(without) == (ratio < (1 - foreseen) / (foreseen if alike else 1.0)), "it is asked where one may have made the other"
    monkeypatch.setattr(naming, "more_to_see", lambda race, seed: 0)
    found.chosen = list(bank)
    naming.drop_leftovers(found, 0)
    assert found.chosen == list(bank), "where nothing else is seen nothing is left to be shaved"


def test_what_only_another_finding_made_possible_goes_with_it():
    found = race(tables(23, {0: 0.6, 4: 0.6, 1: -0.2}), low=0.0, chosen=(0, 4))
    naming.drop_impossible(found)
    assert found.chosen == [SINGLE[0], SINGLE[4]], "all is possible"
    found.chosen = [SINGLE[0], SINGLE[1], SINGLE[4]]
    assert found.total() > 1e9, "the value of column 1 is below 0"
    naming.drop_impossible(found)
    assert found.chosen == [SINGLE[0], SINGLE[4]]


def test_there_is_more_to_see_where_an_effect_of_the_bank_still_gains_and_none_in_noise():
    assert naming.more_to_see(race(tables(31, {0: 0.6, 4: 0.4}), chosen=(0,)), 0)
    assert not naming.more_to_see(race(tables(31, {0: 0.6, 4: 0.4}), chosen=(0, 4)), 0)
    assert not naming.more_to_see(race(tables(32)), 0)


@pytest.mark.parametrize(("gain", "p", "more"), [(9.9, 1.0, 0), (10.1, 1.0, 1), (0.0, 0.05, 1), (0.0, 0.051, 0), (0.0, 0.01, 2),
                                                 (99.0, 0.011, 1)])
def test_either_a_gain_of_ten_or_a_test_at_one_in_twenty_shows_that_there_is_more_to_see(gain, p, more, monkeypatch):
    monkeypatch.setattr(naming, "ranked", lambda found, bank: [(gain, SINGLE[0]), (-1.0, SINGLE[1])])
    monkeypatch.setattr(naming, "family_wise_p", lambda found, seed: p)
    assert naming.more_to_see(race(tables(32)), 0) == more


def test_no_more_is_explained_than_all_even_where_the_excess_is_less_than_the_noise_is_known_to():
    found = race(tables(19, {0: 0.25}), chosen=(0,))
    whole, gain, rows = race(tables(19, {0: 0.25})).scored().total, found.loss(SINGLE[0]), 2 * sum(len(t) for t in tables(19))
    assert 1 < whole - 0.05 * rows / 2 < gain
    assert explained(found) == 1.0


@pytest.mark.parametrize(("share", "goes"), [(0.149, True), (0.151, False)])
def test_what_adds_next_to_nothing_to_the_proof_stays_for_three_twentieths_of_the_score(share, goes):
    """Its recordings are predicted as well without it, at the cost of masses moved: that is what the score knows."""
    scored = {0: SimpleNamespace(total=100.0), 2: SimpleNamespace(total=300.0)}
    found = SimpleNamespace(chosen=[SINGLE[0], SINGLE[4]], loss=lambda c: 200.0 * (share if c is SINGLE[4] else 1 - share),
                            scored=lambda without=(): scored[len(without)])
    assert _least(found, proof_of(0.5, 0.1, effect_0=0.45, effect_4=0.1)) is (SINGLE[4] if goes else None)
