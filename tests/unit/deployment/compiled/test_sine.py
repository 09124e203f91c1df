"""The sine for numba is exact to rounding."""

import numpy as np
import pytest


def test_the_sine_of_numba_is_exact_to_rounding():
    numba = pytest.importorskip("numba")
    from nnhydro.deployment.compiled import sine

    both = numba.vectorize(["float64(float64)"])(lambda x: sine.sin(x)), numba.vectorize(["float64(float64)"])(lambda x: sine.cos(x))
    for reach in (1.6, 30.0, 1e4, 1e7):
        x = np.random.default_rng(1).uniform(-reach, reach, 100_000)
        for made, exact in zip(both, (np.sin, np.cos), strict=True):
            assert np.abs(made(x) - exact(x)).max() < 4e-16
