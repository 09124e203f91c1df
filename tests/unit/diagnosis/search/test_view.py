"""A library beside one noise: what laws gain by Schur complements is what dense densities say; products are carried over as they are."""

import numpy as np
import pytest
from problems import dense, design, law, library, search, whitened, written_out

from nnhydro.diagnosis.model.evidence import posterior
from nnhydro.diagnosis.model.sizes import Sizes
from nnhydro.diagnosis.search.view import WeightedLibrary

LAWS = (law("a"), law("b", 2), law("c", per_recording=True), law("d", 2, per_recording=True))


@pytest.mark.parametrize("beside", [(), (0,), (2,), (1, 3)])
def test_what_a_law_gains_beside_a_set_is_the_difference_of_two_dense_evidences(beside):
    of = design(9, groups=3, rows=10)
    view = search(of, LAWS, even=False).view
    t = Sizes.even(view.whitened, 0.2).vector(view.whitened)
    columns = view.join(beside)
    gains = view.gains(beside, posterior(view.whitened, columns, t))
    base = dense(view.whitened, written_out(view, beside), t)
    for k in set(range(len(LAWS))) - set(beside):
        assert gains[k] == pytest.approx(dense(view.whitened, written_out(view, (*beside, k)), t) - base, rel=1e-5, abs=1e-5)


def test_columns_of_a_grown_library_are_those_computed_anew():
    of = design(15)
    first, more = library(of, LAWS), library(of, (law("e"), law("f", 2)), seed=16)
    white = whitened(of)
    grown = first.with_more(more, first.key_counts)
    step, whole = WeightedLibrary(white, grown, before=WeightedLibrary(white, first)), WeightedLibrary(white, grown)
    for name in ("cross", "Xy"):
        np.testing.assert_allclose(getattr(step, name), getattr(whole, name), rtol=1e-10, atol=1e-10)
    for k in range(len(grown.hypotheses)):
        for name in ("Xw", "gram"):
            np.testing.assert_allclose(getattr(step.columns(k), name), getattr(whole.columns(k), name), rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(step.between(k), whole.between(k), rtol=1e-10, atol=1e-10)
    assert grown.log_prior(0) == first.log_prior(0), "finer values are no further laws"
