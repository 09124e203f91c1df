"""The algebra of the diagnosis: left-out scores, the family-wise test, the selection and where a residual lies."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from races import met_of
from rigs import arm

from nnhydro.diagnosis.bank import Bank, Candidate
from nnhydro.diagnosis.blocks import Blocks, block_grams
from nnhydro.diagnosis.instances import Instance, finer, instances
from nnhydro.diagnosis.locate import Residual, locate
from nnhydro.diagnosis.locks import TRIED, family_wise_p, gain_p, sign_flip_p
from nnhydro.diagnosis.placebo import whiteness
from nnhydro.diagnosis.race import Race, gains
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.tournament import run
from nnhydro.diagnosis.unknown import learned
from nnhydro.effects.catalogue import effect_of_id

UNITS, ROWS, P, K = 10, 120, 3, 8


def tables(seed, planted=(), noise=1.0):
    """Tables [Y X y] (rows, 1 joint, P + K + 1) of each unit; `planted` {column: value}."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(UNITS):
        YX = rng.standard_normal((ROWS, P + K))
        y = YX[:, :P] @ np.array([1.0, -2.0, 0.5]) + noise * rng.standard_normal(ROWS)
        for column, value in dict(planted).items():
            y = y + value * YX[:, P + column]
        made.append(np.column_stack([YX, y])[:, None, :])
    return made


def race_of(made, noise=1.0, low=-np.inf, high=np.inf, bank=None):
    grams, rows, unit = [], [], []
    for number, table in enumerate(made):
        G, n = block_grams(table, 4)
        grams.append(G)
        rows.append(n)
        unit.append(np.full(len(n), number))
    blocks = Blocks(np.concatenate(grams), np.concatenate(rows), np.concatenate(unit), P)
    scale = np.array([noise])
    torque = np.array([sum(float((t[:, 0, -1] ** 2).sum()) for t in made)])
    bank = Bank(BANK if bank is None else bank, np.full(K, low), np.full(K, high), torque, met_of(made, K))
    return Race(bank, Bench.of(blocks, scale, np.zeros(P)), scale)


def candidate(name, columns, own=()):
    return Candidate(SimpleNamespace(key=(name, 0), grid=1, plausible=lambda values: True), columns, own)


BANK = tuple(candidate(f"effect_{k}", (k,)) for k in range(K))


def test_the_left_out_energy_is_that_of_a_refit_to_the_other_units():
    made = tables(1, {0: 0.5})
    scored = race_of(made).bench.scored(np.array([0, 3]))
    take = [0, 1, 2, P + 0, P + 3]
    for number, table in enumerate(made):
        others = np.concatenate([t for i, t in enumerate(made) if i != number])[:, 0]
        theta = np.linalg.lstsq(others[:, take], others[:, -1], rcond=None)[0]
        energy = ((table[:, 0, -1] - table[:, 0, take] @ theta) ** 2).sum()
        assert scored.energy[number, 0] == pytest.approx(energy, rel=1e-6)


def test_scoring_many_candidates_at_once_gives_what_scoring_each_gives():
    race = race_of(tables(2, {1: 0.5, 4: 0.3}), bank=(*BANK, candidate("pair", (2, 5))))
    race.chosen = [race.bank.candidates[1]]
    for gain, one in gains(race, [c for c in race.bank.candidates if c is not race.chosen[0]]):
        assert gain == pytest.approx(race.total() - race.total([one]), rel=1e-9, abs=1e-9)


def test_a_planted_column_is_chosen_and_nothing_else():
    for seed in range(5):
        race = run(race_of(tables(seed, {2: 0.5})), seed)
        assert [c.key[0] for c in race.chosen] == ["effect_2"]


def test_two_planted_columns_are_chosen_in_any_order():
    race = run(race_of(tables(3, {2: 0.4, 6: -0.5})), 0)
    assert {c.key[0] for c in race.chosen} == {"effect_2", "effect_6"}


def test_noise_alone_is_left_alone():
    assert sum(len(run(race_of(tables(seed)), seed).chosen) for seed in range(20)) == 0


def test_the_family_wise_p_pays_for_looking_at_every_column():
    p = np.array([family_wise_p(race_of(tables(seed)), seed) for seed in range(100)])
    assert (p <= 0.05).mean() <= 0.12
    assert 0.35 < p.mean() < 0.65


def test_a_value_beyond_its_physical_bounds_is_never_chosen():
    assert run(race_of(tables(1, {2: -0.5}), low=0.0), 0).chosen == []


def test_an_effect_that_only_lives_by_cancelling_the_baseline_is_refused():
    made = tables(1)
    for table in made:  # column 5 is almost a baseline column, and the difference of the two is in the torque
        table[:, 0, P + 5] = table[:, 0, 0] + 0.01 * table[:, 0, P + 5]
        table[:, 0, -1] += 60 * (table[:, 0, P + 5] - table[:, 0, 0])
    assert "effect_5" not in [c.key[0] for c in run(race_of(made), 0).chosen]


def test_an_effect_that_is_most_of_the_measured_torque_is_no_cancelling_one():
    made = tables(1)
    for table in made:  # a heavy payload: most of what is measured, and like a baseline column
        table[:, 0, P + 5] = table[:, 0, 0] + 0.3 * table[:, 0, P + 5]
        table[:, 0, -1] += 20 * table[:, 0, P + 5]
    heavy = race_of(made)
    one = next(c for c in heavy.bank.candidates if c.key[0] == "effect_5")
    values = heavy.scored([one]).theta[P:]
    assert values[0] ** 2 * heavy.bench.total[P + 5, P + 5] > 0.5 * heavy.torque
    assert heavy.physical([one], np.array([5]), values)
    assert not heavy.physical([one], np.array([5]), -values), "the same torque with the other sign is in no way in what is measured"
    assert not heavy.physical([one], np.array([5]), 1.3 * values), "a third more than is there, which the rest takes back"
    assert [c.key[0] for c in run(heavy, 0).chosen] == ["effect_5"]


def test_a_phase_of_each_recordings_own_is_found_where_no_common_value_is():
    rng, made = np.random.default_rng(5), tables(5)
    for table in made:
        a, b = np.cos(x := rng.uniform(0, 2 * np.pi)), np.sin(x)
        table[:, 0, -1] += a * table[:, 0, P + 2] + b * table[:, 0, P + 3]
    common, own = candidate("common", (2, 3)), candidate("own", (), (2, 3))
    assert [c.key[0] for c in run(race_of(made, bank=(common, own)), 0).chosen] == ["own"]
    assert run(race_of(tables(5), bank=(common, own)), 0).chosen == []


def test_the_order_of_units_does_not_matter():
    made = tables(4, {1: 0.3})
    columns = np.array([1, 4])
    assert race_of(made).bench.scored(columns).total == pytest.approx(race_of(made[::-1]).bench.scored(columns).total, rel=1e-12)


def test_the_region_where_a_residual_lies_is_found():
    rng = np.random.default_rng(0)
    parts = []
    for number in range(6):
        q, qd = rng.uniform(-1, 1, 400), rng.uniform(-1, 1, 400)
        r = np.column_stack([0.01 * rng.standard_normal(400), np.where(q > 0.6, 0.5, 0.0) + 0.01 * rng.standard_normal(400)])
        parts.append(Residual(f"run{number}", r, {"q1_rad": q, "dq1_rad_s": qd}, 0.01))
    first = locate(parts, np.array([0.01, 0.01]))[0]
    assert first.joint == 2
    assert first.share > 0.95
    low, high = first.conditions["q1_rad"]
    assert low > 0.3
    assert high == pytest.approx(1.0, abs=0.05)
    assert first.recordings == []


def test_the_sign_flip_test_keeps_its_level_and_one_violent_recording_does_not_decide():
    rng = np.random.default_rng(0)
    p = np.array([sign_flip_p(rng.standard_t(2, 10)) for _ in range(400)])
    assert (p <= 0.05).mean() <= 0.08
    assert sign_flip_p(np.array([100.0, *-np.ones(7)])) > 0.5
    assert sign_flip_p(np.array([5.0, 4, 3, 6, 2, 5, 4, -0.3])) <= 0.05
    assert sign_flip_p(np.ones(3)) == 1.0


def test_the_p_of_a_phase_of_its_own_is_one_without_gain_and_falls_with_it():
    assert gain_p(-5.0, 10) == 1.0
    assert gain_p(60.0, 100) < 0.01 < gain_p(30.0, 100)


def test_what_is_paid_for_is_what_is_tried():
    assert len(instances(arm(2), (1.0, 2.0))) == TRIED


def test_finer_values_lie_half_way_and_close_in_on_the_best():
    effect = effect_of_id("stribeck_friction").started(arm(2), joint=1)
    one = Instance(replace(effect, speed=(0.2,)), 5, {"speed": (0.1, 0.4)})
    best, *others = finer(one)
    assert best.spans["speed"] == pytest.approx((0.1 * 2**0.5, 0.2 * 2**0.5))
    assert sorted(other.effect.speed[0] for other in others) == pytest.approx([0.1 * 2**0.5, 0.2 * 2**0.5])
    assert {finer(other)[1].key for other in others} == {one.key}


def _parts(seed, law):
    rng, made = np.random.default_rng(seed), []
    for number in range(8):
        state = {"q1_rad": rng.uniform(-1, 1, 200), "dq1_rad_s": rng.uniform(-1, 1, 200)}
        made.append(Residual(f"run{number}", (law(state) + rng.standard_normal(200))[:, None], state, 0.1))
    return made


def test_the_learner_finds_a_law_without_a_name_and_nothing_in_noise():
    (found,) = learned(_parts(1, lambda s: 3.0 * np.sin(3 * s["q1_rad"])), 0)
    assert found.real
    assert found.depends_on == ("q1_rad",)
    assert not any(one.real for seed in range(5) for one in learned(_parts(seed, lambda s: 0.0), 0))


def test_white_residuals_are_called_white_and_slow_ones_are_not():
    white = np.mean([whiteness(_parts(seed, lambda s: 0.0), 0) for seed in range(20)])
    assert white < 0.12
    slow = [Residual(p.recording, np.cumsum(p.r, axis=0), p.state, p.dt) for p in _parts(0, lambda s: 0.0)]
    assert whiteness(slow, 0) > 0.8
