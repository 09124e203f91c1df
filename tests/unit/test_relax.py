"""An effect of its own, or the shape that the card of another one leaves: what is kept beside loose shapes, by hand on plain rows."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from races import JOINTS, NOISE, K, Known, P, Plain, instance, raced, tables

from nnhydro.diagnosis.blocks import Blocks, block_grams
from nnhydro.diagnosis.race import Race
from nnhydro.diagnosis.relax import _size, _spread, _torques, prune, retained, shapes, spread
from nnhydro.diagnosis.score import Bench

EACH = tuple(instance(f"effect_{k}", (k,)) for k in range(K))


def test_shapes_are_half_of_the_joints_the_square_the_rates_and_what_comes_late():
    piece = SimpleNamespace(state={"dq1_rad_s": np.array([1.0, -2.0, 3.0]), "dq2_rad_s": np.array([0.0, 1.0, -1.0])}, dt=0.05)
    a, scale, rates = np.array([[1.0, 2.0], [3.0, -4.0], [5.0, 6.0]]), np.array([2.0, 4.0]), np.array([1.5, 0.5])
    made = 2 * shapes(a, piece, scale, rates)
    np.testing.assert_allclose(made[..., 0], a * [1.0, 0.0])
    np.testing.assert_allclose(made[..., 1], a * [0.0, 1.0])
    np.testing.assert_allclose(made[..., 2], a * np.abs(a) / 4.0)
    np.testing.assert_allclose(made[..., 3], a * np.array([[1.0], [3.0], [4.0]]) / 2.0)
    np.testing.assert_allclose(made[..., 4], 0.1 / 0.05 * np.stack([[2.0, -6.0], [2.0, 2.0], [2.0, 10.0]]))
    assert made.shape == (3, 2, 5)


def test_one_joint_has_no_shape_of_its_own_and_a_steady_run_none_that_comes_late():
    piece = SimpleNamespace(state={"dq1_rad_s": np.array([1.0, 2.0, 4.0])}, dt=0.0)
    made = shapes(np.array([[1.0], [2.0], [4.0]]), piece, np.array([2.0]), np.array([1.0]))
    assert made.shape == (3, 1, 3)
    assert (made[..., 2] == 0).all()
    short = SimpleNamespace(state={"dq1_rad_s": np.ones(2)}, dt=0.1)
    assert (shapes(np.array([[1.0], [2.0]]), short, np.ones(1), np.ones(1))[..., 2] == 0).all()
    three = SimpleNamespace(state={"dq1_rad_s": np.ones(3)}, dt=0.1)
    assert (shapes(np.array([[1.0], [2.0], [3.0]]), three, np.ones(1), np.ones(1))[..., 2] == 0.5).all()
    assert (_size(np.array([3.0, -4.0])), _size(np.zeros(3))) == (pytest.approx(np.sqrt(12.5)), 1.0)


def shape_left(seed=12):
    """Column 4 is what comes when the torque of column 0 grows with its square: another card's shape, not an effect of its own."""
    made = tables(seed, {0: 1.0})
    for table in made:
        a = table[..., P]
        table[..., -1] += 0.2 * a * np.abs(a)
        table[..., P + 4] = a * np.abs(a) + 0.2 * table[..., P + 4]
    return made


def kept_beside(made, lent):
    """The left-out score that column 4 gains beside column 0 and what is `lent` (n, joints, m) on each table, held by a prior of one."""
    grams, n, unit = [], [], []
    for k, (one, Z) in enumerate(zip(made, lent, strict=True)):
        G, count = block_grams(np.concatenate([one[..., :P], Z, one[..., [P, P + 4, -1]]], axis=2), 4)
        grams.append(G), n.append(count), unit.append(np.full(len(count), k))
    q = P + lent[0].shape[2]
    bench = Bench.of(Blocks(np.concatenate(grams), np.concatenate(n), np.concatenate(unit), q), NOISE, np.ones(q))
    return bench.scored(np.array([0])).total - bench.scored(np.array([0, 1])).total


def test_what_a_finding_keeps_beside_loose_shapes_of_another_is_what_the_scores_with_them_say():
    made = shape_left()
    found = raced(table := Plain(made), EACH, chosen=(0, 4))
    asked, other = found.chosen[1], found.chosen[0]
    value = found.values(found.chosen)[1][0]
    rms = np.sqrt(np.concatenate([(value * t[..., P]) ** 2 for t in made]).mean(axis=0))
    speeds = [np.concatenate([piece.state[f"dq{j + 1}_rad_s"] for piece in table.pieces]) for j in range(JOINTS)]
    rates = np.array([np.sqrt((x**2).mean()) for x in speeds])
    lent = [shapes(value * one[..., P], piece, rms, rates) for piece, one in zip(table.pieces, made, strict=True)]
    loose = kept_beside(made, lent)
    assert found.loss(other) > 3 * found.loss(asked)
    assert retained(found, table, None, asked) == pytest.approx(loose / found.loss(asked), rel=1e-9)
    assert retained(found, table, None, asked) < 0.35 < retained(found, table, None, other)
    prune(found, table, None)
    assert [c.key[0] for c in found.chosen] == ["effect_0"]
    assert found.log[1].startswith("effect_4 joint 0: keeps ")


def test_no_shape_is_lent_by_what_explains_less_than_three_times_as_much():
    made = shape_left()
    for table in made:
        table[..., -1] += 0.45 * table[..., P + 4]  # now an effect of its own, half as strong as the other
    found = raced(table := Plain(made), EACH, chosen=(0, 4))
    asked, other = found.chosen[1], found.chosen[0]
    assert found.loss(other) < 3 * found.loss(asked)
    assert retained(found, table, None, asked) > 0.9
    prune(found, table, None)
    assert len(found.chosen) == 2


@dataclass(frozen=True)
class Levelled:
    """An effect with a level; its card says that a law of other form spreads over half of it."""

    level: tuple[float, ...] = (2.0,)
    spread: ClassVar = {"level": (0.5,)}


@dataclass(eq=False)
class AtLevel(Known):
    """An instance whose columns hang on the level of its effect: column 0 at 2, column 1 at 1, column 2 at a half."""

    def __post_init__(self):
        self.of = {2.0: (0,), 1.0: (1,), 0.5: (2,)}[self.effect.level[0]]


def test_what_the_other_values_on_a_card_can_take_over_is_no_effect_of_its_own_however_much_it_explains():
    made = tables(12, {0: 1.0})
    for table in made:  # a law that bends over a range of levels; column 4 is what it leaves, seen by another card
        table[..., -1] += 0.6 * table[..., P + 1]
        table[..., P + 4] = 0.6 * table[..., P + 1] + 0.1 * table[..., P + 4]
    lender = AtLevel(("effect_0", 0), (), effect=Levelled())
    found = raced(table := Plain(made), [lender, *EACH[1:]], chosen=(0, 4))
    other, asked = found.chosen
    assert found.loss(asked) < found.loss(other) < 3 * found.loss(asked)
    assert [one.effect.level for one in spread(other)] == [(1.0,)]
    assert spread(asked) == []
    sizes = np.sqrt((np.concatenate(made)[..., [P, P + 1]] ** 2).sum(axis=(0, 1)))
    half = 0.5 * found.values(found.chosen)[1][0] * sizes[0] / sizes[1]  # of the finding's own torque
    loose = kept_beside(made, [half * one[..., [P + 1]] for one in made])
    assert retained(found, table, None, asked) == pytest.approx(loose / found.loss(asked), rel=1e-9)
    assert retained(found, table, None, asked) < 0.35 < retained(found, table, None, other)
    plain = raced(table, EACH, chosen=(0, 4))
    assert retained(plain, table, None, plain.chosen[1]) > 0.9, "without other values on the card it keeps all"


def test_a_spread_column_is_half_as_large_as_the_torque_of_its_own_finding():
    made = tables(12, {0: 1.0})
    lenders = [AtLevel((name, 0), (), effect=Levelled((level,))) for name, level in (("effect_0", 2.0), ("effect_1", 1.0))]
    table, scales = Plain(made), [np.array([3.0, 4.0]), np.array([0.6, 0.8])]
    instances, size = _spread(table, None, raced(table, lenders).bank.candidates, scales)
    assert [one.of for one in instances] == [(1,), (2,)]
    for k, scale in enumerate(scales):
        x = np.concatenate([one[..., P + instances[k].of[0]] for one in made])
        assert np.sqrt(((size[k] * x) ** 2).mean(axis=0).sum()) == pytest.approx(0.5 * np.sqrt((scale**2).sum()))


def test_the_torque_of_a_finding_is_what_it_does_in_all_recordings_alike():
    made = tables(14, {0: 0.4, 3: -0.3})
    found = raced(table := Plain(made), [instance("both", (2, 0, 3), own=(0,)), EACH[4]], chosen=(0,))
    values = found.values(found.chosen)[1]
    (told,) = _torques(found, table, None, found.chosen)
    for one, torque in zip(made, told, strict=True):  # column 2 has a value of its own in every recording
        np.testing.assert_allclose(torque, values[1] * one[..., P] + values[2] * one[..., P + 3])


def test_two_effects_of_their_own_both_keep_their_gains_and_one_alone_is_not_asked():
    found = raced(table := Plain(tables(13, {0: 0.8, 4: 0.8})), EACH, chosen=(0, 4))
    assert retained(found, table, None, found.chosen[0]) > 0.8
    prune(found, table, None)
    assert len(found.chosen) == 2
    alone = raced(table, EACH, chosen=(0,))
    prune(alone, table, None)
    assert len(alone.chosen) == 1
    assert alone.log == []


def test_of_what_keeps_too_little_beside_loose_shapes_the_weakest_goes_first(monkeypatch):
    asked = []
    monkeypatch.setattr("nnhydro.diagnosis.relax.retained", lambda race, *given: asked.append(given[-1]) or 0.34)
    table = Plain(tables(13, {0: 0.8, 2: 0.2, 4: 0.5}))
    found = raced(table, EACH, chosen=(0, 2, 4))
    prune(found, table, None)
    assert [c.key[0] for c in found.chosen] == ["effect_0"], "the last stays"
    assert [c.key[0] for c in asked] == ["effect_0", "effect_2", "effect_4", "effect_0", "effect_4"]
    monkeypatch.setattr("nnhydro.diagnosis.relax.retained", lambda *given: 0.36)
    kept = raced(table, EACH, chosen=(0, 2, 4))
    prune(kept, table, None)
    assert len(kept.chosen) == 3, "a third of the gain and a little more is enough"


def losses(monkeypatch, **each):
    """What each choice explains, whatever its columns say."""
    monkeypatch.setattr(Race, "loss", lambda found, c: each[c.key[0]])


@pytest.mark.parametrize(("more", "lent"), [(2.9, 0), (3.1, 1)])
def test_loose_shapes_are_lent_by_what_explains_three_times_as_much(more, lent, monkeypatch):
    lenders = []
    monkeypatch.setattr("nnhydro.diagnosis.relax.shapes", lambda a, *given: lenders.append(a) or shapes(a, *given))
    found = raced(table := Plain(tables(12, {0: 1.0, 4: 0.5})), EACH, chosen=(0, 4))
    losses(monkeypatch, effect_0=more, effect_4=1.0)
    retained(found, table, None, found.chosen[1])
    assert len(lenders) == lent * len(table.pieces)


@pytest.mark.parametrize(("more", "lent"), [(0.9, 0), (1.1, 1)])
def test_to_what_has_a_value_of_its_own_in_every_recording_all_shapes_are_lent_by_what_explains_more(more, lent, monkeypatch):
    lenders = []
    monkeypatch.setattr("nnhydro.diagnosis.relax.shapes", lambda a, *given: lenders.append(a) or shapes(a, *given))
    drift = instance("drift", (4, 5), own=(1,))
    found = raced(table := Plain(tables(12, {0: 1.0, 4: 0.5})), [*EACH[:4], drift], chosen=(0, 4))
    losses(monkeypatch, effect_0=more, drift=1.0)
    retained(found, table, None, found.chosen[1])
    assert len(lenders) == lent * len(table.pieces)


@pytest.mark.parametrize(("more", "lent"), [(0.9, 0), (1.1, 1)])
def test_the_other_values_of_a_card_are_lent_by_what_explains_more(more, lent, monkeypatch):
    asked = []
    monkeypatch.setattr("nnhydro.diagnosis.relax.spread", lambda c: asked.append(c.key[0]) or spread(c))
    found = raced(table := Plain(tables(12, {0: 1.0})), [AtLevel(("effect_0", 0), (), effect=Levelled()), *EACH[1:]], chosen=(0, 4))
    losses(monkeypatch, effect_0=more, effect_4=1.0)
    retained(found, table, None, found.chosen[1])
    assert asked == ["effect_0"] * lent


def test_every_lender_lends_the_shapes_of_its_own_torque():
    made = tables(12, {0: 1.0, 2: -1.2})
    for table in made:  # column 4 is what comes when the torque of column 2, not that of column 0, grows with its square
        a = table[..., P + 2]
        table[..., -1] += 0.2 * a * np.abs(a)
        table[..., P + 4] = a * np.abs(a) + 0.2 * table[..., P + 4]
    found = raced(table := Plain(made), EACH, chosen=(0, 2, 4))
    asked = found.chosen[2]
    assert retained(found, table, None, asked) < 0.35
    assert min(found.loss(c) for c in found.chosen[:2]) > 3 * found.loss(asked)
