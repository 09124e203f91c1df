"""A library beside one noise: what laws gain by Schur complements is what dense densities say; products are carried over as they are."""

import numpy as np
import pytest
from problems import dense, design, law, library, search, whitened, written_out

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.model.evidence import posterior
from nnhydro.diagnosis.model.sizes import Sizes, none
from nnhydro.diagnosis.search.weighted_library import PER_RECORDING_SCREENED, WeightedLibrary

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


def test_what_a_fit_takes_of_a_column_is_what_ridge_regression_on_its_columns_would():
    of = design(21, groups=4, rows=20)
    one = search(of, LAWS, even=False)
    view = one.view
    A = np.concatenate([view.whitened.Y.reshape(-1, view.whitened.p), view.columns(0).Xw.reshape(-1, 1)], axis=1)
    scale = np.concatenate([np.ones(view.whitened.p), [RHO]])
    t = none(view.whitened).vector(view.whitened)
    C = view.projection((0,), posterior(view.whitened, view.join((0,)), t))
    X = view.columns(1).Xw.reshape(len(A), 2)
    taken = (X.T @ A * scale) @ np.linalg.solve(np.eye(len(scale)) + (A * scale).T @ (A * scale), (A * scale).T @ X)
    np.testing.assert_allclose(C[:, 1:3].T @ C[:, 1:3], taken, rtol=1e-5)


def test_a_value_of_each_recording_s_own_has_columns_only_where_its_law_acts():
    of = design(22)
    made = library(of, LAWS)
    made.columns(2)[of.problem.group_of == 1] = 0.0
    view = WeightedLibrary(whitened(of), made)
    assert view.acting_groups(2) == [0, 2, 3]
    Xw = view.columns(2).Xw
    assert Xw.shape[2] == 3
    for place, group in enumerate((0, 2, 3)):
        assert not Xw[of.problem.group_of != group, :, place].any(), "a recording has its value alone"


def test_laws_with_own_values_that_never_gained_much_are_not_asked_again():
    laws = tuple(law(f"own{k}", per_recording=True) for k in range(PER_RECORDING_SCREENED + 5))
    of = design(23, groups=3, rows=10)
    of.y = of.y + library(of, laws).columns(7)[..., 0] * np.array([3.0, -2.0, 4.0])[of.problem.group_of][:, None]
    view = search(of, laws, library(of, laws).parts[0]).view
    fit = posterior(view.whitened, None, none(view.whitened).vector(view.whitened))
    first, second = view.gains((), fit), view.gains((), fit)
    asked = np.isfinite(second)
    assert asked.sum() == PER_RECORDING_SCREENED
    assert first[~asked].max() <= first[asked].min()
    assert int(np.argmax(second)) == 7
    np.testing.assert_allclose(second[asked], first[asked])


def test_draws_of_noise_are_the_same_for_a_seed_and_their_products_are_those_of_their_rows():
    view = search(design(24), LAWS, even=False).view
    e, products = view.noise_draws(3, 5)
    assert view.noise_draws(3, 5)[0] is e
    np.testing.assert_array_equal(search(design(24), LAWS, even=False).view.noise_draws(3, 5)[0], e)
    assert not np.array_equal(view.noise_draws(4, 5)[0], e)
    want = np.einsum("njd,njk->dk", e, view.whitened.weigh(np.concatenate([view.library.columns(k) for k in view.shared], axis=2)))
    np.testing.assert_allclose(products, want, rtol=1e-9)
