"""A number for people: as many figures as are known, and the interval of what is derived."""

import numpy as np
import pytest
import torch
from hypotheses import made
from rigs import arm

from nnhydro.effects.quantity import Quantity, format_quantity, intervals, polar
from nnhydro.physics.motion import tensor


def bent(k, p, k2, k3):
    return made("umbilical_stiffness", arm(1), 1, stiffness=(k,), preload=(p,), quadratic=(k2,), cubic=(k3,))


@pytest.mark.parametrize(("value", "interval", "text"), [
    (0.5, (0.47, 0.53), "0.50 +- 0.03 N"), (0.5, None, "0.5 N"), (1.0, (0.2, 5.0), "1.0 N (95 %: 0.2 to 5.0)"),
    (3.0, (3.0, 3.0), "3 +- 0 N"), (0.1234, (0.1112, 0.1356), "0.123 +- 0.012 N"), (12345.0, (8345.0, 16345.0), "12345 +- 4000 N"),
    (0.06, (0.0, 0.13), "0.06 N (95 %: 0.00 to 0.13)"),
])
def test_numbers_are_told_with_the_figures_of_their_uncertainty(value, interval, text):
    assert format_quantity(Quantity(value, "N"), interval) == text


def test_the_interval_of_a_derived_quantity_follows_from_the_covariance():
    spring = made("umbilical_stiffness", arm(1), 1, stiffness=(2.0,), preload=(-1.0,), quadratic=(), cubic=())
    covariance = torch.tensor([[0.01, 0.002], [0.002, 0.04]], dtype=torch.float64)
    low, high = intervals(lambda v: spring.with_linear(v).quantities(), spring.linear_values(), covariance)["rest_angle"]
    gradient = np.array([-0.25, -0.5])  # of -preload/stiffness
    assert (high - low) / 2 == pytest.approx(1.96 * np.sqrt(gradient @ covariance.numpy() @ gradient), rel=1e-5)


def test_a_quantity_that_is_absent_at_a_limit_is_zero_there():
    """A contact that does not bend tells no bending; one that bends by less than its uncertainty has an interval all the same."""
    def bent(values):
        return {"bending": Quantity(float(values[0]), "rad")} if float(values[0]) > 0 else {}

    (low, high), = intervals(bent, tensor([1e-6]), tensor([[1e-6]]), {0: (0.0, 1.0)}).values()
    assert (high - low) / 2 == pytest.approx(1.96e-3, rel=1e-3)


def test_at_a_limit_the_interval_follows_from_the_slope_on_its_inner_side():
    def quantities(x):
        return {"square": Quantity(float(max(x[0], 0.0)) * 3.0, "1")}

    at, covariance = torch.zeros(1, dtype=torch.float64), torch.tensor([[0.04]], dtype=torch.float64)
    low, high = intervals(quantities, at, covariance, {0: (0.0, 1.0)})["square"]
    assert (high - low) / 2 == pytest.approx(1.96 * 0.2 * 3.0, rel=1e-3)


def test_a_value_known_to_all_its_digits_adds_nothing_to_an_interval():
    spring = made("umbilical_stiffness", arm(1), 1, stiffness=(2.0,), preload=(-1.0,), quadratic=(), cubic=())
    covariance = torch.tensor([[0.01, 0.0], [0.0, 1e-40]], dtype=torch.float64)
    low, high = intervals(lambda v: spring.with_linear(v).quantities(), spring.linear_values(), covariance)["rest_angle"]
    assert (high - low) / 2 == pytest.approx(1.96 * 0.025, rel=1e-5)


@pytest.mark.parametrize(("deviation", "low"), [(0.1, 0.5 - 0.196), (1.0, 0.0)])
def test_the_interval_of_a_length_ends_at_0_and_that_of_its_direction_does_not(deviation, low):
    covariance = torch.eye(2, dtype=torch.float64) * deviation**2
    found = intervals(lambda v: polar(float(v[0]), float(v[1]), "N", "force"), tensor([0.5, 0.0]), covariance)
    assert found["force"] == pytest.approx((low, 0.5 + 1.96 * deviation), rel=1e-4)
    assert found["direction"] == pytest.approx((-1.96 * deviation / 0.5, 1.96 * deviation / 0.5), rel=1e-4)
