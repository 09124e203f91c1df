"""Parts of a campaign: amplitudes say in which recordings a law acts, and a part is taken where the rest speaks against the whole."""

import numpy as np

from nnhydro.diagnosis.search.activity_windows import _amplitudes, _best_run


def test_the_run_of_bins_in_which_a_law_acts_is_found_from_its_products_alone():
    rng = np.random.default_rng(3)
    parts = rng.standard_normal((400, 8))
    acting = np.array([0, 0, 1, 1, 1, 0, 0, 0])
    y = parts @ acting + 0.1 * rng.standard_normal(400)
    assert _best_run(parts.T @ parts, parts.T @ y) == (2, 5)
    assert _best_run(parts.T @ parts, parts.T @ (parts @ np.ones(8))) == (0, 8)
    a, sd = _amplitudes(parts.T @ parts / 0.01, parts.T @ y / 0.01)
    assert np.all(np.abs(a - acting) < 4 * sd)
