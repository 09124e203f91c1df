"""What speaks for a finding: left-out errors, placebos, moved cut-offs; each against the same by hand on plain rows."""

from types import SimpleNamespace

import numpy as np
import pytest
from races import JOINTS, NOISE, K, P, Plain, fit, instance, raced, rows, tables

from nnhydro.diagnosis.blocks import Blocks, block_grams, parts_of
from nnhydro.diagnosis.placebo import placebo
from nnhydro.diagnosis.proof import LeftOut, prove, prove_fresh
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.steadfast import drop_made_by_filter, kept_shares

PRIOR = np.array([4.0, 0.0, 50.0])
EACH = tuple(instance(f"effect_{k}", (k,)) for k in range(K))


def phased(seed=9, units=6):
    rng, made = np.random.default_rng(seed), tables(seed, {0: 0.4}, units=units)
    for table in made:
        table[..., -1] += 2 * rng.standard_normal() * table[..., P + 2]
    return made


def left_out_error(made, columns):
    """sum |y - prediction by a fit to the other recordings| / sum |tau|, and the residuals recording by recording."""
    r, wrong, left = rows(made), 0.0, []
    take = [*range(P), *(P + k for k in columns)]
    for u, table in enumerate(made):
        theta = fit(r.Z[r.unit != u][:, take], r.y[r.unit != u], PRIOR)
        left.append(table[..., -1] - table[..., take] @ theta)
        wrong += np.abs(left[-1]).sum()
    return wrong / sum(2 * np.abs(table[..., -1]).sum() for table in made), left


def test_the_proof_is_the_error_of_refits_without_the_recording_that_is_predicted():
    made = tables(8, {0: 0.5, 4: 0.4})
    found = raced(table := Plain(made, steady=(3,)), EACH, prior=PRIOR, chosen=(4, 0))
    proof = prove(found, table, None)
    without = [proof.without[EACH[k].key] for k in (0, 4)]
    for told, columns in ((proof.before, ()), (proof.after, (0, 4)), (without[0], (4,)), (without[1], (0,))):
        assert told == pytest.approx(left_out_error(made, columns)[0], rel=1e-5)
    for told, columns in ((proof.residuals, ()), (proof.remains, (0, 4))):
        for part, want in zip(told, left_out_error(made, columns)[1], strict=True):
            np.testing.assert_allclose(part.r, want, rtol=1e-4, atol=1e-6)
    assert [(part.recording, part.dt) for part in proof.remains] == [(f"run{k}", 0.0 if k == 3 else 0.05) for k in range(7)]
    assert proof.recordings == 7
    rows_ = sum(table[..., -1].size for table in made)
    assert proof.torque == pytest.approx(sum(2 * np.abs(table[..., -1]).sum() for table in made) / rows_)


def test_values_of_a_recordings_own_are_predicted_block_by_block_from_its_other_blocks():
    made = phased()
    both = instance("both", (0, 2), own=(1,))
    found = raced(table := Plain(made), (both, EACH[4]), chosen=(0,))
    proof = prove(found, table, None)
    take, own = np.array([*range(P), P]), np.array([P + 1])
    theta = found.bench.left_out(take, own)[1]
    values, block, wrong = found.bench.own_values(take, own, theta), 0, 0.0
    for u, one in enumerate(made):
        for part in parts_of(len(one), 4):
            said = one[part][..., [0, 1, 2, P]] @ theta[u] + one[part][..., P + 2] * values[block, 0]
            wrong, block = wrong + np.abs(one[part][..., -1] - said).sum(), block + 1
    assert proof.after == pytest.approx(wrong / sum(2 * np.abs(one[..., -1]).sum() for one in made), rel=1e-9)
    assert proof.after < 0.75 * proof.before


def test_fresh_recordings_are_predicted_by_the_fit_to_all_that_were_studied():
    made, later = tables(10, {0: 0.5, 4: 0.4}), tables(11, {0: 0.5, 4: 0.4}, units=3)
    found = raced(table := Plain(made), EACH, prior=PRIOR, chosen=(4, 0))
    proof = prove(found, table, None)
    import nnhydro.diagnosis.proof as module
    fresh = Plain(later)
    original, module.Table = module.Table, lambda case, foretold: case
    try:
        told = prove_fresh(found, None, [fresh], proof)
    finally:
        module.Table = original
    r = rows(made)
    for said, columns in ((told.before, ()), (told.after, (0, 4)), (told.without[EACH[0].key], (4,))):
        take = [*range(P), *(P + k for k in columns)]
        theta = fit(r.Z[:, take], r.y, PRIOR)
        wrong = sum(np.abs(one[..., -1] - one[..., take] @ theta).sum() for one in later)
        assert said == pytest.approx(wrong / sum(2 * np.abs(one[..., -1]).sum() for one in later), rel=1e-5)
    assert told.recordings == 3
    assert told.remains is proof.remains


def test_the_parameters_of_a_set_are_those_of_its_left_out_fits():
    found = raced(Plain(phased()), (instance("both", (0, 2), own=(1,)), EACH[4]), chosen=(0,))
    one = LeftOut.of(found.bench, found.chosen)
    np.testing.assert_allclose(one.theta, found.bench.left_out(np.array([0, 1, 2, P]), np.array([P + 1]))[1])
    given = LeftOut.of(found.bench, found.chosen, np.arange(4.0))
    np.testing.assert_array_equal(given.theta, np.tile(np.arange(4.0), (6, 1)))
    assert (one.columns, one.own_columns, one.own.shape) == ([0], [1], (len(found.bench.blocks.n), 1))
    assert LeftOut.of(found.bench, []).own.shape == (len(found.bench.blocks.n), 0)


def moved_case(table, others, passed=2.0):
    """A case with moved ones, `Table` of which is the plain table itself."""
    table.passed_hz = passed
    table.moved = tuple(others)
    return table


def test_a_gain_is_asked_again_at_the_moved_cut_offs_with_the_noise_that_passes_there(monkeypatch):
    monkeypatch.setattr("nnhydro.diagnosis.steadfast.Table", lambda case: case)
    here, low, high = Plain(tables(14, {0: 0.5, 4: 0.4})), Plain(tables(15, {0: 0.5})), Plain(tables(16, {0: 0.5, 4: 0.4}))
    low.passed_hz, high.passed_hz = 1.4, 2.6
    case = moved_case(here, (low, high))
    found = raced(here, EACH, prior=PRIOR, chosen=(0, 4))
    shares = kept_shares(case, found, None, found.chosen)
    for place, k in enumerate((0, 4)):
        gain = found.loss(found.chosen[place])
        for told, moved, hz in zip(shares[place], (low, high), (1.4, 2.6), strict=True):
            there = raced(moved, [EACH[0], EACH[4]], NOISE * np.sqrt(hz / 2.0), PRIOR, (0, 1))
            want = there.loss(there.chosen[place])
            assert told == pytest.approx(want / gain, rel=1e-9), k
    drop_made_by_filter(case, found, None)
    assert [c.key[0] for c in found.chosen] == ["effect_0"]
    assert [line.partition(":")[0] for line in found.log] == ["effect_0 joint 0", "effect_4 joint 0", "effect_0 joint 0"]
    assert kept_shares(case, found, None, []) == []


def test_a_placebo_is_the_same_column_taken_from_other_recordings():
    made = tables(17, {0: 0.6, 4: 0.3}, units=4, rows=(60, 90))
    found = raced(table := Plain(made, steady=(3,)), EACH, prior=PRIOR, chosen=(0, 4))
    gain, best = placebo(found, table, None, found.chosen[0])
    assert gain == pytest.approx(found.total(without=[found.chosen[0]]) - found.total())
    gains = []
    for shift in (1, 2):
        grams, n, unit, plain = [], [], [], []
        for k, t in enumerate(made):
            source = made[(k + shift) % 3][..., P] if k != 3 else np.zeros((1, JOINTS))
            wrong = source[np.linspace(0, len(source) - 1, len(t)).round().astype(int)] if k != 3 else np.zeros(t.shape[:2])
            parts = 1 if k == 3 else 4
            G, count = block_grams(np.concatenate([t[..., :P], wrong[..., None], t[..., [P + 4, -1]]], axis=2), parts)
            grams.append(G), n.append(count), unit.append(np.full(len(count), k))
            plain.append(block_grams(t[..., [*range(P), P + 4, -1]], parts)[0])
        count, unit = np.concatenate(n), np.concatenate(unit)
        with_it = Bench.of(Blocks(np.concatenate(grams), count, unit, P + 1), NOISE, np.array([*PRIOR, 0.0])).scored(np.array([0])).total
        alone = Bench.of(Blocks(np.concatenate(plain), count, unit, P), NOISE, PRIOR).scored(np.array([0])).total
        gains.append(alone - with_it)
    assert best == pytest.approx(max(gains), rel=1e-6, abs=1e-6)
    assert gain > 20 > best


def test_at_most_nine_placebos_are_tried(monkeypatch):
    calls = []
    from nnhydro.diagnosis import placebo as module
    real = module._shuffled
    monkeypatch.setattr(module, "_shuffled", lambda *given: calls.append(given[-1]) or real(*given))
    table = Plain(tables(18, {0: 0.6}, units=13, rows=(30, 40)))
    found = raced(table, EACH[:2], chosen=(0,))
    placebo(found, table, None, found.chosen[0])
    assert calls == list(range(1, 10))


def test_a_gain_that_shrinks_with_the_cut_off_moved_is_still_a_gain(monkeypatch):
    """A low cut-off rightly hides a ripple: only what gains nothing at one of them is made by the filter."""
    shares = {"effect_0": [1.1, 0.05], "effect_4": [-0.01, 1.2], "wave": [-0.01, 0.7], "other": [-0.01, -0.02]}
    monkeypatch.setattr("nnhydro.diagnosis.steadfast.kept_shares", lambda case, found, believed, chosen: [shares[c.key[0]] for c in chosen])
    found = raced(Plain(tables(14)), EACH, chosen=(0, 4))
    drop_made_by_filter(None, found, None)
    assert [c.key[0] for c in found.chosen] == ["effect_0"]
    own = SimpleNamespace(spread={}, own_in_every_recording=True)
    waves = [instance(name, (k,), effect=own) for k, name in ((1, "wave"), (2, "other"))]
    found = raced(Plain(tables(14)), [EACH[0], *waves], chosen=(0, 1, 2))
    drop_made_by_filter(None, found, None)
    assert [c.key[0] for c in found.chosen] == ["effect_0", "wave"], "the pitch of a wave may lie above the lower cut-off"
