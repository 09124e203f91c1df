"""How much of what was learned is used, judged recording by recording."""

import numpy as np
import pytest
import torch
from training_rows import watched_rows

from nnhydro.fitting.network.stacking import CAUTIONS, NETWORKS, held_out, losses, stack


def test_a_correction_is_used_as_far_as_held_out_recordings_confirm_it():
    rows = watched_rows()
    target, unit = rows.target.double(), rows.unit
    for share, t in ((1.0, 1.0), (1 / 0.75, 0.75), (2.0, 0.5), (-1.0, 0.0), (30.0, 0.0)):
        b, trust = stack(target, {1.0: share * target}, unit)
        assert b == 1.0
        assert trust == pytest.approx(np.full(2, t))
    assert stack(target, {0.0: 0.5 * target, 1.0: target}, unit)[0] == 1.0
    assert stack(target, {1.0: 3.0 * target, 0.0: target}, unit)[0] == 0.0, "networks that only harm are left out"
    assert stack(target, {b: (0.5 - 0.001 * b) * target for b in NETWORKS}, unit, (1.0,))[0] == 1.0, "a hair does not tell against them"


def test_caution_is_given_up_only_where_members_predict_kinds_that_they_have_not_seen():
    rows = watched_rows()
    target, unit = rows.target.double(), rows.unit
    members = torch.stack([0.2 * target, 1.6 * target])  # they disagree, and are right in the mean

    def choice(factor):
        said = {q: held_out(factor * members, torch.ones(2, len(unit), dtype=torch.bool), rows.scale.double(), 1 / 3, q) for q in CAUTIONS}
        return stack(target, said, unit)[0]

    assert choice(1.0) == CAUTIONS[-1]
    assert choice(-1.0) == CAUTIONS[0], "what is wrong anyway is no reason to be less cautious"


def test_what_helps_many_and_ruins_one_recording_is_not_used():
    rows = watched_rows()
    target, unit = rows.target.double(), rows.unit
    ruinous = torch.where((unit == 3)[:, None], -4.0 * target, 0.4 * target)
    _, trust = stack(target, {1.0: ruinous}, unit)
    assert trust == pytest.approx(np.zeros(2))
    assert float((target - ruinous).abs().sum() / target.abs().sum()) < 1.3, "on average it hardly harms"


def test_rows_at_rest_say_nothing_and_a_recording_that_becomes_worse_weighs_by_how_many_times():
    target = torch.tensor([2.0, 2.0, 1.0, 1.0], dtype=torch.float64)[:, None]
    unit, correction = torch.tensor([0, 0, 1, 1]), torch.tensor([1.0, 1.0, -0.5, -0.5], dtype=torch.float64)[:, None]
    moving = losses(target, correction, unit, (1.0,))
    torch.testing.assert_close(moving[0, :, 0], torch.tensor([2.0 / 3.0, 3.0 / 3.0 + 2.0 * 0.5], dtype=torch.float64))
    resting = [torch.cat([x, 0 * x]) for x in (target, correction)]
    torch.testing.assert_close(losses(*resting, torch.cat([unit, unit]), (1.0,)), moving)
