"""The evidence in closed form is the log density of the rows under their full covariance matrix, whatever their order."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problems import dense, design, law, search, unknown_part, whitened
from scipy.stats import multivariate_normal

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.model.evidence import Columns, WhiteRows, added_evidence, posterior
from nnhydro.diagnosis.model.sizes import LARGEST, Sizes, fit_sizes, none

LAWS = (law("a"), law("b", 2), law("c", per_recording=True), law("d", 2, per_recording=True))


@given(seed=st.integers(0, 10_000), joints=st.integers(1, 2), tau=st.floats(0.01, 2.0), k=st.integers(0, 3))
def test_the_evidence_is_the_density_of_the_rows_under_their_full_covariance(seed, joints, tau, k):
    of = design(seed, joints=joints)
    white = whitened(of, seed)
    X = np.random.default_rng(seed + 1).standard_normal((*of.y.shape, k))
    t = Sizes.even(white, tau).vector(white)
    got = posterior(white, Columns.of(white, white.weigh(X)) if k else None, t).log_evidence
    assert got == pytest.approx(dense(white, X if k else None, t), rel=1e-7, abs=1e-6)


def test_the_posterior_is_that_of_ridge_regression_with_the_prior_as_its_penalty():
    of = design(5, joints=1)
    white = whitened(of)
    X = np.random.default_rng(6).standard_normal((*of.y.shape, 2))
    fit = posterior(white, Columns.of(white, white.weigh(X)), none(white).vector(white))
    D = np.concatenate([of.Y[:, 0], X[:, 0]], axis=1) * white.sw
    precision = np.diag([1.0, 1.0, RHO**-2, RHO**-2])
    inverse = np.linalg.inv(D.T @ D + precision)
    at = np.array([0, 1, len(white.b), len(white.b) + 1])
    np.testing.assert_allclose(fit.mean[at], inverse @ D.T @ white.y[:, 0], rtol=1e-6)
    np.testing.assert_allclose(fit.covariance(at), inverse, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(fit.variances()[at] * fit.scale[at] ** 2, np.diag(inverse), rtol=1e-6)
    assert not fit.mean[white.p:len(white.b)].any(), "an unknown of the smallest size is none"


@given(seed=st.integers(0, 1000))
def test_groups_of_size_0_change_neither_evidence_nor_fit_nor_projections(seed):
    of = design(seed, joints=2)
    white, rng = whitened(of, seed), np.random.default_rng(seed + 1)
    X = rng.standard_normal((*of.y.shape, 2))
    t = Sizes.even(white, 0.5).vector(white) * np.concatenate([np.ones(white.p), rng.integers(0, 2, len(white.b) - white.p)])
    columns = Columns.of(white, white.weigh(X))
    fit = posterior(white, columns, t)
    assert fit.log_evidence == pytest.approx(dense(white, X, t), rel=1e-7, abs=1e-6)
    s = np.concatenate([t, np.full(2, RHO)])
    G = np.block([[white.G, columns.cross], [columns.cross.T, columns.gram]])
    inverse = np.linalg.inv(np.eye(len(s)) + G * s[:, None] * s)
    np.testing.assert_allclose(fit.mean, s * (inverse @ (s * np.concatenate([white.b, columns.Xy]))), rtol=1e-5, atol=1e-8)
    np.testing.assert_allclose(fit.variances(), np.diag(inverse), rtol=1e-6)
    np.testing.assert_allclose(fit.covariance(slice(None)), inverse * s[:, None] * s, rtol=1e-5, atol=1e-8)
    cross = rng.standard_normal((len(s), 3))
    C = fit.projection(cross)
    np.testing.assert_allclose(C.T @ C, (cross * s[:, None]).T @ inverse @ (cross * s[:, None]), rtol=1e-5, atol=1e-8)


@given(order=st.permutations(range(len(LAWS))))
def test_the_order_in_which_laws_are_named_changes_nothing(order):
    one = search(design(7), LAWS)
    columns = [one.view.join(o) for o in (order, sorted(order))]
    t = Sizes.even(one.whitened, 0.3).vector(one.whitened)
    got, want = (posterior(one.whitened, c, t).log_evidence for c in columns)
    assert got == pytest.approx(want, rel=1e-9)
    assert one.score(order) is one.score(sorted(order))


@given(seed=st.integers(0, 1000))
def test_the_order_of_rows_changes_nothing(seed):
    of = design(8)
    white = whitened(of)
    order = np.random.default_rng(seed).permutation(len(of.y))
    t = Sizes.even(white, 0.3).vector(white)
    shuffled = WhiteRows(of, white.unknown, white.v, order)
    assert posterior(shuffled, None, t).log_evidence == pytest.approx(posterior(white, None, t).log_evidence, rel=1e-9)


def test_columns_on_some_rows_are_those_of_a_problem_of_these_rows_alone():
    of = design(12)
    white = whitened(of)
    X = np.random.default_rng(13).standard_normal((*of.y.shape, 3))
    rows = np.arange(0, len(of.y), 2)
    part = WhiteRows(of, white.unknown, white.v, rows)
    np.testing.assert_allclose(part.weigh(X), white.weigh(X)[rows])
    got, half = Columns.of(part, part.weigh(X)), np.zeros_like(of.y)
    half[rows] = 1.0
    want = Columns.of(white, white.weigh(X) * half[..., None])
    for name in ("cross", "gram", "Xy"):
        np.testing.assert_allclose(getattr(got, name), getattr(want, name), rtol=1e-10, atol=1e-10)


@given(seed=st.integers(0, 1000), start=st.floats(0.002, 2.0))
def test_fitted_sizes_are_never_less_probable_than_those_they_begin_with(seed, start):
    of = design(seed)
    of.y = of.y + unknown_part(of, 0.5 * (seed % 3))
    white = whitened(of, even=True)
    first = Sizes.even(white, start)
    fit, sizes = fit_sizes(white, None, first)
    assert fit.log_evidence >= posterior(white, None, first.vector(white)).log_evidence - 1e-9
    assert sizes.tau.max() <= LARGEST
    assert fit.log_evidence == pytest.approx(posterior(white, None, sizes.vector(white)).log_evidence, rel=1e-12)


def test_the_group_that_holds_the_unknown_gets_the_size_and_the_others_none():
    of = design(14, groups=8, rows=60)
    of.y = of.y + unknown_part(of, 1.0)
    white = whitened(of, even=True)
    _, sizes = fit_sizes(white, None, Sizes.even(white, 0.1), updates=20)
    assert sizes.tau[0, 0] > 0.5
    assert sizes.tau[1].max() < 0.1
    assert sizes.tau[0, 1] < 0.1


def test_where_nothing_is_free_every_variance_is_that_of_the_prior(capfd):
    of = design(16, p=0)
    fit = posterior(white := whitened(of), None, none(white).vector(white))
    assert fit.variances().tolist() == [1.0] * len(white.b)
    assert capfd.readouterr() == ("", ""), "LAPACK prints what it is not asked"


@pytest.mark.parametrize("draws", [None, 4])
def test_what_columns_add_is_the_ratio_of_the_densities_with_and_without_them(draws):
    rng = np.random.default_rng(3)
    X, r = rng.standard_normal((5, 30, 2)), rng.standard_normal((30,) if draws is None else (30, draws))
    M = RHO**2 * np.einsum("lna,lnb->lab", X, X) + np.eye(2)
    _, added = added_evidence(M, np.einsum("lna,n...->la...", X, r))
    density = multivariate_normal(np.zeros(30), np.eye(30)).logpdf(r.T)
    for columns, got in zip(X, added, strict=True):
        with_them = multivariate_normal(np.zeros(30), np.eye(30) + RHO**2 * columns @ columns.T).logpdf(r.T)
        assert got == pytest.approx(with_them - density, rel=1e-9)
