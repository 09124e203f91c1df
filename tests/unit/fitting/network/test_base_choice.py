"""Which physics a hybrid stands on: the one beside which watched recordings are left least once something is learned."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
import torch
from campaigns import GIVEN, campaign, planted
from rigs import arm

from nnhydro.features.feature_set import feature_sets
from nnhydro.features.strip_law.law import SURROUNDED
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.linear.several_arms import calibrated_on
from nnhydro.fitting.network import base_choice
from nnhydro.fitting.network.base_choice import baseline_choice, on_best_base
from nnhydro.fitting.network.linear_part import left_over, linear_part
from nnhydro.fitting.network.rows import Rows, base_rows, torque_rms, training_rows
from nnhydro.models.baselines import baseline
from nnhydro.recordings.splitting import units

JOINTS, LAW, UNITS = 2, 4, 6
S = torch.ones(JOINTS).double()
COEFFICIENTS = torch.tensor([1.0, -0.5, 0.3, 0.8])
PLAIN, RICHER = object(), object()


def problem(noise=0.3, n=240):
    """Rows whose torque is linear in the law's columns but for `noise`, the columns, and three members that watch a unit each."""
    generator = torch.Generator().manual_seed(1)
    columns = torch.randn(n, JOINTS, LAW, generator=generator)
    target = columns @ COEFFICIENTS + noise * torch.randn(n, JOINTS, generator=generator)
    rows = Rows(torch.zeros(n, 1), torch.ones(1), torch.ones(n, JOINTS), target, torch.arange(n) % UNITS)
    watched = torch.zeros(3, UNITS, dtype=torch.bool)
    watched[0, 0] = watched[1, 2] = watched[2, 5] = True
    return rows, SimpleNamespace(columns=columns, law_size=LAW, shared=LAW, free_size=0, tiers=torch.full((LAW,), SURROUNDED)), watched


def choice(monkeypatch, gone, spoilt):
    """What is chosen where the richer baseline takes the share `gone` of what is linear away and adds noise of the size `spoilt`."""
    rows, linear, watched = problem(noise=0.1)
    noise = torch.randn(rows.target.shape, generator=torch.Generator().manual_seed(9))
    given = {PLAIN: torch.zeros_like(noise), RICHER: gone * linear.columns @ COEFFICIENTS + spoilt * noise}
    monkeypatch.setattr(base_choice, "base_rows", lambda chosen, a, base: given[base])
    found = on_best_base((PLAIN, RICHER), rows, linear, watched, 0, S, (), None)
    return (*found, rows, linear, watched)


def test_a_baseline_that_leaves_less_but_nothing_to_be_learned_is_not_stood_on(monkeypatch):
    base, kept, _, rows, *_ = choice(monkeypatch, gone=0.9, spoilt=0.2)
    alone = rows.target - base_choice.base_rows((), None, RICHER)
    assert float(alone.abs().mean()) < 0.3 * float(rows.target.abs().mean()), "alone it is by far the better one"
    assert base is PLAIN
    assert torch.equal(kept.target, rows.target)


def test_a_baseline_that_knows_what_cannot_be_learned_is_stood_on(monkeypatch):
    rows, linear, watched = problem(noise=0.1)
    noise = torch.randn(rows.target.shape, generator=torch.Generator().manual_seed(9))
    given = {PLAIN: torch.zeros_like(noise), RICHER: noise}
    monkeypatch.setattr(base_choice, "base_rows", lambda chosen, a, base: given[base])
    rich = replace(rows, target=rows.target + noise)
    base, moved, (own, _) = on_best_base((PLAIN, RICHER), rich, linear, watched, 0, S, (), None)
    assert base is RICHER
    torch.testing.assert_close(moved.target, rows.target)
    torch.testing.assert_close(own.shared, linear_part(rows, linear, watched, 0)[0].shared, rtol=1e-4, atol=1e-5)


def test_two_alike_are_no_reason_to_leave_the_plain_one(monkeypatch):
    assert choice(monkeypatch, gone=0.3, spoilt=0.0)[0] is PLAIN
    rows, linear, watched = problem()
    assert on_best_base((None,), rows, linear, watched, 0, S, (), None)[0] is None
    assert on_best_base((PLAIN, RICHER), rows, linear, watched & False, 0, S, (), None)[0] is PLAIN, "nobody watches"


def test_what_is_left_is_counted_on_the_recordings_that_a_member_watches_and_in_units_of_the_torque():
    rows, linear, watched = problem()
    own, _ = linear_part(rows, linear, watched, 0)
    off, total, count = rows.target[:, None].double() - own.of(linear.columns.double()), 0.0, 0
    for member in range(len(watched)):
        mine = watched[member][rows.unit]
        total, count = total + float(off[mine, member].abs().sum()), count + int(mine.sum()) * JOINTS
    assert left_over(rows, [own, own], linear.columns, watched, S) == pytest.approx([total / count] * 2)
    assert left_over(rows, [own], linear.columns, watched, 2 * S) == pytest.approx([total / count / 2])


def test_a_baseline_takes_its_torque_from_the_targets_of_the_rows():
    a = arm(2)
    chosen = units(campaign(a, planted(a), 3, seconds=2.0, rate=25.0), GIVEN)
    base = calibrated_on(baseline("constant"), chosen, a, GIVEN)
    config, floor = TrainingConfig(features=tuple(feature_sets())[:1]), 0.1 * torque_rms(chosen)
    whole, left = (training_rows(chosen, a, config, floor, stand).target for stand in (None, base))
    torch.testing.assert_close(whole - left, base_rows(chosen, a, base), rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize(("count", "blocks"), [(8, 2), (4, 4), (3, 3)])
def test_of_few_motions_one_after_the_other_tells_which_baseline_predicts_it(monkeypatch, count, blocks):
    chosen, asked = [SimpleNamespace(group=f"run{i}", steady=False) for i in range(count)], []
    monkeypatch.setattr(base_choice, "calibrated_on", lambda name, fitted, a, how: (name, fitted))

    def left(model, held_out):
        name, fitted = model
        assert sorted(unit.group for unit in (*fitted, *held_out)) == [unit.group for unit in chosen]
        asked.append(name)
        return 1.0 if name == "constant" else 0.5

    monkeypatch.setattr(base_choice, "_misfit", left)
    monkeypatch.setattr(base_choice, "baseline", lambda name: name)
    assert baseline_choice(chosen, None, None) == ("constant", "state")
    assert asked == ["constant"] * blocks + ["state"] * blocks
