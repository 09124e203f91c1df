"""Columns of the linear part of a recording: kept from one fit to the next, but those of the recording and the fit at hand."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, TINY, campaign, planted, recording
from rigs import arm, scaled

from nnhydro.fitting.network import linear_columns
from nnhydro.fitting.network.linear_columns import Linear, RowRange
from nnhydro.fitting.network.row_store import RowStore
from nnhydro.fitting.network.rows import free_range, rows_and_linear
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import prepare
from nnhydro.recordings.splitting import units

FLOOR = torch.ones(2).double()


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch):
    """Begin with an empty store, and count what is computed."""
    asked, compute = [], linear_columns._shared_columns
    monkeypatch.setattr(linear_columns, "_SHARED", linear_columns.RecentMemo(10**9))
    monkeypatch.setattr(linear_columns, "_shared_columns", lambda *given: asked.append(1) or compute(*given))
    return asked


def columns(a, r, low_pass=None, config=TINY, floor=FLOOR, free=False):
    """The columns of a recording as a fit takes them."""
    whole = replace(campaign(a, planted(a), count=1), arm=a)
    unit = replace(units(whole, GIVEN)[0], segments=lambda: tuple(replace(part, low_pass=low_pass) for part in prepare(r, GIVEN)))
    seen = free_range([unit], a) if free else None
    return rows_and_linear([unit], a, config, floor, None, RowStore(2**40), seen)[1].columns


def test_another_fit_to_the_same_recording_finds_its_columns_and_adds_its_own(nothing_kept):
    a = arm()
    r = recording(a, planted(a))
    first, again = columns(a, r), columns(a, r)
    assert torch.equal(first, again)
    assert len(nothing_kept) == 1
    assert not torch.equal(columns(a, r, floor=2 * FLOOR), first), "odd features depend on the floor of the scale"
    assert columns(a, r, free=True).shape[2] > first.shape[2]
    assert len(nothing_kept) == 1


@pytest.mark.parametrize("change", [
    lambda a, r: (scaled(a, 1.1), r, None, TINY),
    lambda a, r: (a, replace(r, u0=np.full(len(r.t), 0.1)), None, TINY),
    lambda a, r: (a, replace(r, current=np.tile([0.1, 0.0], (len(r.t), 1))), None, TINY),
    lambda a, r: (a, r, LowPass(20.0), TINY),
    lambda a, r: (a, r, None, TINY.model_copy(update={"law": ("reynolds", "span")})),
], ids=["arm", "carriage", "current", "filter", "law"])
def test_columns_are_computed_anew_for_whatever_they_depend_on(change, nothing_kept):
    a = arm()
    r = recording(a, planted(a))
    first = columns(a, r)
    second = columns(*change(a, r))
    assert len(nothing_kept) == 2
    assert second.shape != first.shape or not torch.equal(second, first)


def test_what_two_stretches_hold_at_most_is_what_either_holds():
    def of(low, high, swift):
        return RowRange(*(torch.tensor(x) for x in (low, high, swift)))
    both = of([1.0, -2.0], [3.0, 0.0], [5.0]).and_of(of([0.0, -1.0], [2.0, 4.0], [6.0]))
    assert (both.lowest.tolist(), both.highest.tolist(), both.swiftest.tolist()) == ([0.0, -2.0], [3.0, 4.0], [6.0])
    one, other = (Linear(torch.full((n, 1, 3), float(n)), 2, 2, 0, torch.zeros(2), of([0.0], [1.0], [1.0])) for n in (2, 4))
    assert one.and_of(other).columns.shape == (6, 1, 3)
