"""The numbers of the sine: pi in parts, and polynomials that meet the functions to their last digit."""

from functools import reduce

import numpy as np

from nnhydro.deployment.sine import PI, ROUND, P, Q


def polynomial(powers, z):
    """The polynomial, highest power first."""
    return reduce(lambda total, c: total * z + c, powers, np.zeros_like(z))


def test_polynomials_give_sine_and_cosine_over_half_a_turn():
    r = np.linspace(-np.pi / 2, np.pi / 2, 10_001)
    z = r**2
    assert np.abs(r + r * z * polynomial(P, z) - np.sin(r)).max() < 4e-16
    assert np.abs(1 - z / 2 + z**2 * polynomial(Q, z) - np.cos(r)).max() < 4e-16


def test_the_parts_of_pi_add_up_and_the_first_are_exact_times_whole_numbers():
    assert sum(PI[::-1]) == np.pi
    for part in PI[:2]:
        assert float(part).as_integer_ratio()[0].bit_length() <= 27, "times a k of 26 bits nothing is rounded"


def test_adding_and_subtracting_rounds_to_the_nearest_whole_number():
    x = np.array([-2.7, -0.4, 0.0, 0.6, 1e8 + 0.3])
    np.testing.assert_array_equal((x + ROUND) - ROUND, np.rint(x))
