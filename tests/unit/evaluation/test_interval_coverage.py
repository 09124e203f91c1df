"""How often intervals hold the measured torque, worked out by hand."""

import numpy as np
import pytest

from nnhydro.evaluation.interval_coverage import Coverage, coverage_document


def test_the_shares_are_counted_as_the_gaussian_has_them():
    r = np.array([[0.5], [1.0], [1.5], [3.0]])
    covered = Coverage.of(r, np.zeros_like(r), np.ones_like(r))
    assert covered.shares() == {"50": 0.25, "80": 0.5, "95": 0.75}
    assert covered.width == pytest.approx(4 / 6)
    twice = covered + covered
    assert twice.shares() == covered.shares()
    assert coverage_document(twice, covered)["wider_than_fitted"] == pytest.approx(1.0)
