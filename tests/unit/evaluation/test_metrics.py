"""The error measures are those of the document, add up over recordings, and do not care for units."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from nnhydro.evaluation.metrics import Misfit, error_interval, interval_of_share

MEASURED = np.array([[1.0, 0.0], [-2.0, 4.0], [3.0, -4.0]])
MODELLED = np.array([[1.5, 0.0], [-2.0, 3.0], [2.0, -4.0]])

torques = arrays(float, st.tuples(st.integers(2, 12), st.just(2)), elements=st.floats(-50, 50, allow_subnormal=False))


def of(measured, modelled):
    return Misfit.of(np.asarray(measured, float), np.asarray(modelled, float))


def test_the_measures_of_a_small_example_are_those_worked_out_by_hand():
    m = of(MEASURED, MODELLED)
    assert m.error == pytest.approx((0.5 + 1.0 + 1.0) / (1 + 2 + 4 + 3 + 4))
    assert m.nrmse == pytest.approx([((0.25 + 1.0) / 14) ** 0.5, (1.0 / 32) ** 0.5])
    residual, torque = MEASURED - MODELLED, MEASURED
    assert m.vaf == pytest.approx(list(1 - residual.var(0) / torque.var(0)))
    assert m.rows == 3


def test_a_perfect_model_leaves_nothing():
    m = of(MEASURED, MEASURED)
    assert (m.error, m.nrmse, m.vaf) == (0.0, [0.0, 0.0], [1.0, 1.0])


def test_a_model_that_says_nothing_has_error_one():
    m = of(MEASURED, 0 * MEASURED)
    assert m.error == 1.0
    assert m.nrmse == [1.0, 1.0]
    assert m.vaf == pytest.approx([0.0, 0.0])


def test_a_constant_offset_costs_error_but_no_variance():
    m = of(MEASURED, MEASURED + 0.3)
    assert m.error > 0
    assert m.vaf == pytest.approx([1.0, 1.0])


def test_zero_torque_gives_numbers_that_json_can_hold():
    silent, wrong = of(np.zeros((3, 2)), np.zeros((3, 2))), of(np.zeros((3, 2)), np.ones((3, 2)))
    assert silent.error == 0.0
    assert np.isfinite([wrong.error, *wrong.nrmse, *wrong.vaf]).all()
    assert wrong.error > 1e6


@given(torques, st.integers(1, 11), st.floats(-2, 2))
def test_the_sums_of_parts_are_the_sums_of_the_whole(measured, cut, factor):
    cut = min(cut, len(measured) - 1)
    modelled = factor * measured[::-1]
    whole = of(measured, modelled)
    parts = Misfit.total([of(measured[:cut], modelled[:cut]), of(measured[cut:], modelled[cut:])])
    assert parts.rows == whole.rows
    for name in ("abs_residual", "abs_torque", "sq_residual", "sq_torque", "residual", "torque"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=1e-9, atol=1e-9)


@given(torques, st.sampled_from([1e-3, 0.5, -1.0, 7.0]))
def test_units_and_signs_do_not_matter(measured, factor):
    modelled = 0.7 * measured + 0.1
    one, other = of(measured, modelled), of(factor * measured, factor * modelled)
    if one.abs_torque.min() > 1e-3:
        assert other.error == pytest.approx(one.error, rel=1e-9)
        assert other.nrmse == pytest.approx(one.nrmse, rel=1e-9)


@given(torques, st.integers(0, 100))
def test_the_order_of_rows_does_not_matter(measured, seed):
    order = np.random.default_rng(seed).permutation(len(measured))
    modelled = measured + np.sin(measured)
    one, other = of(measured, modelled), of(measured[order], modelled[order])
    assert other.error == pytest.approx(one.error, rel=1e-9, abs=1e-12)


def some_parts(count=10, seed=1):
    rng = np.random.default_rng(seed)
    return [of(x := rng.standard_normal((50, 2)), x + rng.uniform(0.05, 0.2) * rng.standard_normal((50, 2))) for _ in range(count)]


def test_the_interval_holds_the_error_and_is_repeatable():
    parts = some_parts()
    low, high = error_interval(parts, 1)
    assert low < Misfit.total(parts).error < high
    assert error_interval(parts, 1) == (low, high)
    assert error_interval(parts, 2) != (low, high)


def test_the_interval_narrows_with_more_recordings():
    few, many = (np.ptp(error_interval(some_parts(count), 1)) for count in (5, 80))
    assert many < 0.6 * few


def test_one_recording_has_an_interval_without_width():
    (part,) = some_parts(1)
    assert error_interval([part], 0) == pytest.approx((part.error, part.error))


@given(st.integers(1, 6), st.integers(0, 50))
def test_the_interval_lies_between_the_best_and_the_worst_recording(count, seed):
    parts = some_parts(count, seed)
    errors = [part.error for part in parts]
    low, high = error_interval(parts, seed)
    assert min(errors) - 1e-12 <= low <= high <= max(errors) + 1e-12


def test_the_interval_of_a_share_is_that_of_its_closed_form_and_of_no_tries_it_is_everything():
    low, high = interval_of_share(0, 20)
    assert (low, high) == (0.0, pytest.approx(1 - 0.025 ** (1 / 20)))
    assert interval_of_share(20, 20) == (pytest.approx(0.025 ** (1 / 20)), 1.0)
    z, n, p = 1.959963984540054, 20, 0.25
    middle, half = (p + z**2 / (2 * n)) / (1 + z**2 / n), z * (p * (1 - p) / n + z**2 / (4 * n**2)) ** 0.5 / (1 + z**2 / n)
    assert interval_of_share(5, 20, "wilson") == (pytest.approx(middle - half), pytest.approx(middle + half))
    assert interval_of_share(0, 0) == (0.0, 1.0)
