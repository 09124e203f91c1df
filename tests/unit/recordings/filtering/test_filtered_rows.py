"""Some rows behind a low-pass are those of all rows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from nnhydro.recordings.filtering.filtered_rows import filtered_rows, reach
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.segment import Segment


def filtered(cutoff, rows=400, dt=0.01):
    t = dt * np.arange(rows)
    zero = np.zeros((rows, 1))
    return Segment("run", t, zero, zero, zero, t * 0, t * 0, zero, np.ones(rows, dtype=bool), None if cutoff is None else LowPass(cutoff))


@pytest.mark.parametrize(("cutoff", "dt"), [(4.0, 0.01), (10.0, 0.01), (2.0, 0.05)])
def test_some_rows_behind_a_low_pass_are_those_of_all_rows(cutoff, dt):
    segment = filtered(cutoff, 900, dt)
    columns = np.random.default_rng(1).standard_normal((900, 2, 3))
    half = reach(segment)
    assert half == int(np.ceil(6 / (cutoff * dt)))
    inside = np.arange(half, 900 - half, 7)
    whole = segment.filter(columns)
    np.testing.assert_allclose(filtered_rows(segment, columns, inside), whole[inside], atol=2e-5)
    np.testing.assert_allclose(filtered_rows(segment, columns, inside[3:4]), whole[inside[3:4]], atol=2e-5)
    assert filtered_rows(segment, columns, inside).shape == (len(inside), 2, 3)


def test_what_a_row_sees_does_not_depend_on_who_else_is_asked():
    segment = filtered(4.0, 900)
    columns = 1e6 * np.random.default_rng(1).standard_normal((900, 2))
    half = reach(segment)
    together = filtered_rows(segment, columns, np.array([300, 301, 302 + half]))
    for told, row in zip(together, (300, 301, 302 + half), strict=True):
        np.testing.assert_allclose(told, filtered_rows(segment, columns, np.array([row]))[0], rtol=0, atol=1e-8)


def test_near_the_ends_the_outermost_rows_go_on():
    segment = filtered(4.0)
    steady = np.full((400, 2), 3.0)
    np.testing.assert_allclose(filtered_rows(segment, steady, np.array([0, 1, 200, 398, 399])), 3.0, rtol=1e-6)
    half, jump = reach(segment), np.where(np.arange(400) == 0, 1.0, 0.0)[:, None]  # the first row alone: it stands for all before it
    longer = filtered(4.0, 400 + half)
    before = np.concatenate([np.ones((half, 1)), jump])
    np.testing.assert_allclose(filtered_rows(segment, jump, np.arange(5)), filtered_rows(longer, before, half + np.arange(5)), atol=1e-12)


@pytest.mark.parametrize(("cutoff", "dt", "filters"), [(None, 0.01, False), (46.0, 0.01, False), (45.0, 0.01, False), (44.0, 0.01, True)])
def test_rows_that_are_not_filtered_are_as_they_are(cutoff, dt, filters):
    segment = replace(filtered(cutoff, dt=dt))
    columns = np.random.default_rng(1).standard_normal((400, 2))
    rows = np.array([3, 50, 51])
    assert (reach(segment) > 0) == filters
    assert np.array_equal(filtered_rows(segment, columns, rows), columns[rows]) != filters


def test_a_segment_of_a_stub_needs_only_its_filter_and_its_step():
    assert reach(SimpleNamespace(low_pass=LowPass(6.0), dt=0.1)) == 0
    assert reach(SimpleNamespace(low_pass=LowPass(6.0), dt=0.01)) == 100
