"""What a diagnosis is made of and what it tells: instances and finer values, documents and verdicts, what the learner is given."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import campaign, planted
from races import P, Plain, candidate, instance, raced, tables
from rigs import arm

from nnhydro.diagnosis.instances import Instance, _half_way, finer, instances, settled
from nnhydro.diagnosis.locate import Location, Residual
from nnhydro.diagnosis.rehearsal import World, _own_size, _world, confident, label, worlds
from nnhydro.diagnosis.result import Diagnosis
from nnhydro.diagnosis.table import states
from nnhydro.diagnosis.unknown import Learned, _folds, _memory, inputs, learned
from nnhydro.effects.catalogue import catalogue, effect_of_id
from nnhydro.recordings.preprocessing import Preparation, prepare


def test_between_two_values_lies_their_geometric_mean_where_both_are_positive_else_their_mean():
    assert _half_way(1.0, 4.0) == pytest.approx(2.0)
    assert _half_way(-1.0, 4.0) == pytest.approx(1.5)
    assert _half_way(0.0, 4.0) == pytest.approx(2.0)


def test_every_instance_stands_between_its_neighbours_and_counts_the_values_tried():
    made = instances(arm(2), (5.0, 2.0))
    for one in made:
        beside = [other for other in made if other.key == one.key]
        assert one.grid == len(beside)
        for name, (low, high) in one.spans.items():
            value = getattr(one.effect, name)[0]
            assert low <= value <= high
            assert low < high or len({getattr(other.effect, name)[0] for other in beside}) == 1
        assert one.width == len(one.effect.linear_names()) + one.effect.offset_of_its_own == len(one.bounds())
    assert {one.key[0] for one in made} == set(catalogue())
    assert "torque_bias" not in {one.key[0] for one in instances(arm(2), (5.0, 2.0), ("torque_bias",))}


def test_columns_of_each_recordings_own_are_all_of_a_phase_and_the_last_of_an_offset():
    made = {one.key[0]: one for one in instances(arm(2), (5.0, 2.0))}
    assert {one.own == tuple(range(one.width)) for one in made.values() if one.effect.own_in_every_recording} == {True}
    offsets = [one for one in made.values() if one.effect.offset_of_its_own and not one.effect.own_in_every_recording]
    for one in offsets:
        assert one.own == (one.width - 1,)
        assert one.bounds()[-1] == (-np.inf, np.inf)
    plain = [one for one in made.values() if not one.effect.own_in_every_recording and not one.effect.offset_of_its_own]
    assert all(one.own == () for one in plain)
    assert offsets
    assert plain


def test_finer_values_stay_within_what_physics_allows_and_narrow_around_themselves():
    effect = effect_of_id("stribeck_friction").started(arm(2), joint=1)
    low, high = next(f.metadata["bounds"] for f in effect.parameters() if f.name == "speed")
    one = Instance(replace(effect, speed=(low,)), 5, {"speed": (low / 4, 4 * low)})
    same, above = finer(one)
    assert same.effect is one.effect
    assert above.effect.speed[0] == pytest.approx(2 * low)
    assert above.spans["speed"] == pytest.approx((low * np.sqrt(2), low * np.sqrt(8)))
    top = Instance(replace(effect, speed=(high,)), 5, {"speed": (high / 4, 4 * high)})
    assert [x.effect.speed[0] for x in finer(top)] == pytest.approx([high, high / 2])
    still = Instance(replace(effect, speed=(0.2,)), 1, {"speed": (0.2, 0.2)})
    assert len(finer(still)) == 1


def test_loads_are_linear_as_they_are_and_instruments_settle_about_their_values():
    import torch

    made = {one.key[0]: one for one in instances(arm(2), (5.0, 2.0))}
    load, lag = made["viscous_friction"], made["torque_scale"] if "torque_scale" in made else made["torque_bias"]
    values = torch.full((lag.width,), 0.1)
    assert settled(load, values, "model") is load
    told = settled(lag, values, "model")
    assert told.believed == "model"
    assert told.effect.linear_values()[0] == pytest.approx(0.1)


def parts(seed=1, count=8, rows=60, dt=0.1):
    rng, made = np.random.default_rng(seed), []
    for k in range(count):
        state = {"q1_rad": rng.uniform(-1, 1, rows), "dq1_rad_s": rng.uniform(-1, 1, rows)}
        made.append(Residual(f"run{k // 2}", rng.standard_normal((rows, 1)), state, dt))
    return made


def test_the_learner_sees_state_memories_time_and_place():
    given = parts()
    told = inputs(given)
    assert list(told) == ["q1_rad", "dq1_rad_s", "dq1_rad_s over the last 0.15 s", "dq1_rad_s over the last 0.6 s", "time in the recording",
                          "place in the campaign"]
    np.testing.assert_array_equal(told["q1_rad"], np.concatenate([part.state["q1_rad"] for part in given]))
    np.testing.assert_allclose(told["time in the recording"][:120], np.tile(0.1 * np.arange(60), 2))
    np.testing.assert_allclose(told["place in the campaign"], np.repeat(np.arange(8) / 7, 60))
    assert (inputs(given[:1])["place in the campaign"] == 0).all()
    del given[3].state["q1_rad"]
    assert "q1_rad" not in inputs(given)


@pytest.mark.parametrize("span", [0.15, 0.6])
def test_a_memory_follows_a_step_as_its_time_says_and_keeps_what_it_began_with(span):
    x = np.concatenate([np.ones(5), np.zeros(20)])
    told = _memory(x, 0.1, span)
    np.testing.assert_allclose(told[:5], 1.0)
    np.testing.assert_allclose(told[5:], np.exp(-0.1 * np.arange(1, 21) / span))


def test_recordings_are_dealt_whole_into_four_folds():
    which, fold = _folds(parts(), 3)
    np.testing.assert_array_equal(which, np.repeat(np.arange(4), 120))
    assert sorted(set(fold.tolist())) == [0, 1, 2, 3]
    assert all(len(set(fold[which == k].tolist())) == 1 for k in range(4))
    many, dealt = _folds(parts(count=20), 1)
    assert sorted(np.bincount([dealt[many == k][0] for k in range(10)]).tolist()) == [2, 2, 3, 3]


@pytest.mark.parametrize(("count", "rows", "dt", "told"), [
    (8, 25, 0.1, True), (8, 24, 0.1, False), (6, 60, 0.1, False), (8, 60, 0.0, False),
])
def test_the_learner_asks_for_two_hundred_rows_of_four_moving_recordings(count, rows, dt, told):
    assert bool(learned(parts(count=count, rows=rows, dt=dt), 0, explain=False)) == told


def test_what_the_learner_predicts_is_the_share_of_squares_on_recordings_it_has_not_seen():
    given = parts(count=16, rows=150)
    for part in given:
        part.r[:, 0] = 2 * np.sign(part.state["q1_rad"]) + 0.01 * part.r[:, 0]
    (one,) = learned(given, 0)
    assert one.r2 > 0.95
    assert one.joint == 1
    assert one.p_value == pytest.approx(1 / 2**8)
    assert one.depends_on == ("q1_rad",)
    assert one.real
    (none,) = learned(parts(count=16, rows=150), 0, explain=False)
    assert none.r2 < 0.05
    assert not none.real
    assert none.depends_on == ()


@dataclass(frozen=True)
class Named:
    """What a rehearsal asks of a finding."""

    members: tuple[str, ...] = ("a",)
    confidence: float = 0.5
    effect: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(id="a", joint=1))


@pytest.mark.parametrize(("hits", "wrong", "confidence"), [(5, 0, 5.5 / 6), (5, 5, 0.5), (0, 0, 0.5), (200, 0, 0.99), (3, 1, 3.5 / 5)])
def test_confidence_is_hits_and_a_half_over_hits_and_misnamed_and_one(hits, wrong, confidence):
    told = {"worlds": [{"instead_of": None, "planted": ["a joint 1"], "named": {"a joint 1": hits}},
                       {"instead_of": "a joint 1", "planted": ["b joint 1"], "named": {"a joint 1": wrong}},
                       {"instead_of": "other", "planted": ["c"], "named": {"a joint 1": 99}}]}
    assert confident(Named(), told).confidence == pytest.approx(confidence)
    same = {"worlds": [told["worlds"][0], {**told["worlds"][1], "planted": ["a2 joint 1"]}]}
    assert confident(Named(("a", "a2")), same).confidence == pytest.approx(min((hits + 0.5) / (hits + 1), 0.99))


def test_labels_name_the_joint_where_there_is_one():
    assert (label(("friction", 2)), label(("current", 0))) == ("friction joint 2", "current")
    assert World(((instance("a", (0,)), np.ones(1)),), None).keys == (("a", 0),)


def test_what_is_rehearsed_has_the_fitted_values_and_the_energy_that_own_values_take_away():
    made = tables(1, {0: 0.5, 4: 0.3})
    found = raced(Plain(made), [instance(f"e{k}", (k,)) for k in range(6)], chosen=(0, 4))
    world = _world(found, found.chosen, None)
    values = found.values(found.chosen)[1]
    assert [float(x[0]) for _, x in world.effects] == pytest.approx([values[0], values[4]])
    rng = np.random.default_rng(2)
    for table in made:
        table[..., -1] += 2 * rng.standard_normal() * table[..., P + 2]
    own = raced(Plain(made), [instance("e0", (0,)), instance("own", (2,), own=(0,))], chosen=(1,))
    one = own.chosen[0]
    taken = (own.scored(without=[one]).energy - own.scored().energy).sum()
    assert _own_size(own, one) == pytest.approx(np.sqrt(taken / own.bench.total[P + 1, P + 1]))
    own.chosen = []
    assert _own_size(own, one) == 0.0
    own.chosen = [one]
    assert [float(x[0]) for _, x in _world(own, [one], None).effects] == pytest.approx([_own_size(own, one)])


def test_each_finding_is_replaced_by_its_nearest_two_rivals_of_another_name():
    made = tables(3, {0: 0.6, 4: 0.3})
    known = [instance(f"e{k}", (k,), effect=SimpleNamespace(general=False, family="f")) for k in range(6)]
    told = worlds(raced(Plain(made), known, chosen=(0, 4)))
    assert [world.instead for world in told] == [None] + [("e0", 0)] * 2 + [("e4", 0)] * 2
    assert told[0].keys == (("e0", 0), ("e4", 0))
    assert all(("e4", 0) in world.keys and ("e0", 0) not in world.keys for world in told[1:3])
    assert worlds(raced(Plain(made), known)) == []


def diagnosis(p=0.001, found=(), remains=False, following=None, hums=()):
    lines = [SimpleNamespace(sentence=lambda hum=hum: hum) for hum in hums]
    remainder = SimpleNamespace(detected=remains, lines=lines, suggestions=[], document=lambda: {"detected": remains})
    proof = SimpleNamespace(before=0.2, after=0.05, without={})
    place = Location(1, 1.0, "spread", {}, [0.0, 1.0], [])
    return Diagnosis(None, None, "constant", 1.23456, p, 0.03, proof, [place], list(found), remainder, {"x": 1}, following, {"cd": [1.0]},
                     {"v": "1"}, [])


@pytest.mark.parametrize(("p", "detected"), [(0.01, True), (0.0101, False), (0.0, True)])
def test_a_mismatch_is_detected_at_one_in_a_hundred_and_only_then_placed(p, detected):
    told = diagnosis(p).document()
    assert told["mismatch"]["detected"] == detected
    assert bool(told["location"]) == detected
    assert told["seconds"] == 1.23
    assert told["next_experiment"] is None
    assert "rehearsal" not in told
    assert told["indistinguishable"] == []


class Told(SimpleNamespace):
    def document(self, *given):
        return {"given": given}


def test_the_document_holds_findings_with_their_errors_classes_of_several_and_the_next_experiment():
    one = Told(candidate=candidate("a", (0,)), members=("a", "b"), statement="A.")
    two = Told(candidate=candidate("c", (1,)), members=("c",), statement="C.")
    following = Told(statement=lambda: "Record more.")
    made = diagnosis(found=(one, two), following=following)
    made.proof.without[("a", 0)] = 0.11
    told = made.document()
    assert told["findings"] == [{"given": (0.11, 0.05)}, {"given": (0.2, 0.05)}]
    assert told["indistinguishable"] == [["a", "b"]]
    assert told["next_experiment"] == {"given": ("next_experiment.csv",)}
    assert made.verdict() == ("A. C. With them, the error on recordings that took no part falls from 20.0 % to 5.0 %. Record more.")
    alone = diagnosis(found=(one,), remains=True)
    assert alone.verdict() == ("A. With it, the error on recordings that took no part falls from 20.0 % to 5.0 %. Noise alone would leave "
                               "3.0 %: something systematic remains that no known effect explains.")


def test_a_verdict_without_findings_says_whether_there_is_a_mismatch_and_what_hums():
    assert diagnosis(0.5).verdict().startswith("Nothing is missing")
    assert "no known effect explains it" in diagnosis(0.001).verdict()
    assert diagnosis(0.001, hums=["a hum of 1 N m"]).verdict().endswith(" There is a hum of 1 N m.")


def test_parts_of_two_rows_teach_as_well():
    rng, made = np.random.default_rng(1), []
    for k in range(120):
        made.append(Residual(f"run{k % 6}", rng.standard_normal((2, 1)), {"q1_rad": rng.uniform(-1, 1, 2)}, 0.1))
    assert learned(made, 0, explain=False)


def test_states_are_told_joint_by_joint_and_the_carriage_where_it_moves():
    whole = campaign(arm(2), planted(arm(2)), 2, seconds=1.0)
    still, towed = (next(iter(prepare(r, Preparation(None)))) for r in whole.recordings())
    told = states(towed)
    assert list(told) == ["q1_rad", "dq1_rad_s", "ddq1_rad_s2", "q2_rad", "dq2_rad_s", "ddq2_rad_s2", "u0_m_s"]
    np.testing.assert_array_equal(told["q2_rad"], towed.q[:, 1])
    np.testing.assert_array_equal(told["ddq2_rad_s2"], towed.qdd[:, 1])
    np.testing.assert_array_equal(told["dq1_rad_s"], towed.qd[:, 0])
    assert "u0_m_s" not in states(still)


@pytest.mark.parametrize(("share", "noise", "named"), [
    (0.2, 0.0, ("q1_rad", "dq1_rad_s")), (0.05, 0.0, ("q1_rad",)), (0.0, 1.0, ("q1_rad",)),
])
def test_an_input_is_named_that_is_worth_a_quarter_of_what_is_predicted(share, noise, named):
    """Mixing an input up costs twice its share of the variance: once what it told, once what it now tells wrongly."""
    given = parts(count=12, rows=200)
    for part in given:
        law = np.sqrt(1 - share) * np.sign(part.state["q1_rad"]) + np.sqrt(share) * np.sign(part.state["dq1_rad_s"])
        part.r[:, 0] = law + noise * part.r[:, 0]
    (one,) = learned(given, 0)
    assert one.depends_on == named


def test_every_world_is_planted_and_named_as_often_as_asked_each_time_with_noise_of_its_own(monkeypatch):
    from nnhydro.diagnosis import rehearsal

    made = tables(3, {0: 0.6, 4: 0.3})
    known = [instance(f"e{k}", (k,), effect=SimpleNamespace(general=False, family="f")) for k in range(6)]
    found, noise, asked, said = raced(Plain(made), known, chosen=(0, 4)), [], [], []
    monkeypatch.setattr(rehearsal, "planted", lambda case, effects, size, seed: noise.append(seed) or effects)
    one = SimpleNamespace(members=("a", "b"), effect=SimpleNamespace(joint=2))
    monkeypatch.setattr(rehearsal, "named", lambda case, repeats, seed, without: asked.append((seed, without)) or
                        SimpleNamespace(findings=[one] if len(asked) % 2 else []))
    told = rehearsal.rehearse(None, found, 2, 7, ("x",), said.append)
    assert noise == [7 + 1000 * number + draw for number in range(5) for draw in range(2)]
    assert len(set(noise)) == len(noise), "no noise is planted twice"
    assert asked == [(7, ("x",)), (8, ("x",))] * 5
    assert said == [f"rehearsal {k} of 10" for k in range(1, 11)]
    assert told["draws"] == 2
    assert [world["instead_of"] for world in told["worlds"]] == [None, "e0", "e0", "e4", "e4"]
    assert told["worlds"][0] == {"planted": ["e0", "e4"], "instead_of": None, "named": {"a joint 2": 1, "b joint 2": 1}}


@pytest.mark.parametrize(("p", "after", "findings", "clear", "detected"), [
    (0.005, 0.16, (), False, True), (0.02, 0.16, (), False, False), (0.005, 0.14, (), False, False),  # block test, and half more than noise
    (0.005, 0.16, ("one",), False, False), (0.005, 0.16, ("one",), True, True),  # beside a finding a learner must confirm
    (0.02, 0.11, ("one",), True, True),  # what a learner clearly predicts is there, however loud other joints are
])
def test_something_remains_where_blocks_and_errors_say_so_or_a_learner_clearly_does(monkeypatch, p, after, findings, clear, detected):
    from nnhydro.diagnosis import remainder as module

    race = SimpleNamespace(noise=np.ones(2))
    told = SimpleNamespace(found=SimpleNamespace(race=race, p_value=p, table=None, believed=None), findings=findings)
    one = Learned(2, 0.3 if clear else 0.2, 0.001 if clear else 0.5, ("q1_rad",))
    for name, value in {"family_wise_p": lambda *given: p / 2, "learned": lambda *given, **keys: [one], "strongest": lambda *given: None,
                        "suggested": lambda *given: None, "nearest": lambda race, joints, seed: [joints]}.items():
        monkeypatch.setattr(module, name, value)
    rest = module.remainder(told, SimpleNamespace(remains=[], after=after), 0.1, 3)
    assert rest.detected == detected
    assert rest.share == after
    assert rest.nearest == (([2] if clear else [1, 2],) if detected else ())
    assert [x.joint for x in rest.learned] == ([2] if p <= 0.01 or clear else [])
