"""Values of a finding and their intervals, against dense matrices, delta rules and the scatter that was planted."""

import numpy as np
import pytest
from hypotheses import made
from oscillations import with_oscillation
from problems import design, law, search, unknown, with_values
from rigs import arm

from nnhydro.diagnosis.constants import FEW_NATS, FORM, LATE, MODEL_ERROR, RHO
from nnhydro.diagnosis.model.evidence import WhiteRows
from nnhydro.diagnosis.model.sizes import without_unknown
from nnhydro.diagnosis.noise.spectrum import Bands
from nnhydro.diagnosis.search import values
from nnhydro.diagnosis.search.best_fit import best_fit, fit_at
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.values import (
    Values,
    _pool,
    _variance_between,
    intervals_of_scale,
    quantity_intervals,
    says_nothing,
    values_of,
)
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary

LAWS = tuple(law(f"law_{k}") for k in range(3))


def found(one, chosen=(0,), k=0):
    """The values of law `k` among `chosen` over the noise that the search knows."""
    return values_at(one, one.score(chosen), k)


def values_at(one, scored, k):
    """The values of law `k` of the set `scored` over the noise that the search knows."""
    one.best_fits[scored.chosen] = fit_at(one, scored, one.whitened.v)
    return values_of(one, scored, k)


def by_hand(one, chosen):
    """Mean (k,), H^-1 (p + k, p + k), and the rows D (n, joints, p + k) of the ridge fit of the laws `chosen` without the unknown."""
    white, X = one.whitened, one.view.library.parts[0][..., list(chosen)]
    D = np.concatenate([white.design.Y, X], axis=2) / np.sqrt(white.v)[..., None]
    flat = D.reshape(-1, D.shape[2])
    H = flat.T @ flat + np.diag([1.0] * white.p + [RHO**-2] * len(chosen))
    return np.linalg.solve(H, flat.T @ white.y.ravel()), np.linalg.inv(H), D


def form_by_hand(one, D, inverse):
    """What an unknown of MODEL_ERROR of the torque would move the coefficients by: both joints' blocks written out."""
    white = one.whitened
    Phi = np.zeros((*white.y.shape, white.joints * white.m))
    for j in range(white.joints):
        Phi[:, j, j * white.m:(j + 1) * white.m] = white.unknown.Phi / np.sqrt(white.v[:, j:j + 1])
    A = inverse @ D.reshape(-1, D.shape[2]).T @ Phi.reshape(-1, Phi.shape[2]) * MODEL_ERROR * white.unknown_of_unit_share
    return A @ A.T


def wider_by_hand(one, D):
    """The covariance of the coefficients where noise has errors of form and timing of what there is to explain, too, by rows."""
    design, white = one.whitened.design, one.whitened
    bands = Bands.of_design(design).of
    E = np.array([[(design.excess[(design.problem.group_of == g) & (bands == b), j] ** 2).mean() for j in range(design.y.shape[1])]
                  for g, b in zip(design.problem.group_of, bands, strict=True)])
    share = FORM**2 + (2 * np.pi * design.problem.frequency[:, None] * LATE) ** 2
    flat = (D * np.sqrt(white.v / (white.v + share * E))[..., None]).reshape(-1, D.shape[2])
    return np.linalg.inv(flat.T @ flat + np.diag([1.0] * white.p + [RHO**-2] * (D.shape[2] - white.p)))


@pytest.mark.parametrize("chosen", [(0,), (0, 2)])
def test_values_and_covariance_are_those_of_a_dense_fit_without_the_unknown(chosen):
    one = with_values(0.5, seed=4)
    mean, inverse, D = by_hand(one, chosen)
    r = one.whitened.y - D @ mean
    group = one.whitened.design.problem.group_of
    scores = np.stack([np.einsum("njk,nj->k", D[group == g], r[group == g]) for g in range(8)])
    sandwich = inverse @ scores.T @ scores @ inverse * 8 / 7
    form, inverse = form_by_hand(one, D, inverse), wider_by_hand(one, D)
    for k in chosen:
        at = one.whitened.p + chosen.index(k)
        got = found(one, chosen, k)
        assert got.mean[0] == pytest.approx(mean[at], rel=1e-6)
        assert got.covariance[0, 0] == pytest.approx(max(inverse[at, at], sandwich[at, at]) + form[at, at], rel=1e-5)


def test_what_smoothly_remains_widens_an_interval_as_it_could_move_the_value(monkeypatch):
    of = design(3, groups=8, rows=30, noise=0.05)
    smooth = unknown(of).Phi
    X = np.einsum("nm,mjk->njk", smooth, np.random.default_rng(7).standard_normal((smooth.shape[1], 2, 3)))
    of.y = of.y + 0.5 * X[..., 0] + 0.5 * smooth[:, ::-1][:, :2]
    one = search(of, LAWS, X, level=0.05**2)
    scored = one.score((0,))
    assert scored.unknown_nats > FEW_NATS
    with_rest = values_at(one, scored, 0).covariance[0, 0]
    monkeypatch.setattr(values, "FEW_NATS", np.inf)
    without = values_at(one, scored, 0).covariance[0, 0]
    assert with_rest > 2 * without


def test_an_interval_is_no_narrower_than_the_evidence_that_grants_laws_their_form():
    one = with_values(0.5, seed=4)
    scored = one.score((0,))
    quiet = fit_at(one, scored, 1e-4 * one.whitened.v)
    evidence = without_unknown(one.whitened, one.view.join((0,))).covariance(np.array([len(one.whitened.b)]))[0, 0]
    one.best_fits[scored.chosen] = quiet
    assert values_of(one, scored, 0).covariance[0, 0] >= evidence > 10 * quiet.posterior.covariance(quiet.coefficients)[-1, -1]


def test_an_error_of_the_baseline_s_form_widens_where_noise_tells_nothing():
    one = with_values(0.5, seed=4, noise=1e-5)
    _, inverse, D = by_hand(one, (0,))
    at = one.whitened.p
    assert found(one).covariance[0, 0] == pytest.approx(form_by_hand(one, D, inverse)[at, at], rel=0.05)
    assert form_by_hand(one, D, inverse)[at, at] > 100 * inverse[at, at]


def test_an_unknown_of_unit_share_makes_each_joint_s_torque_all_groups_as_much():
    white = with_values(0.0).whitened
    T = white.unknown_of_unit_share.reshape(white.joints, white.m)
    energy = T**2 * (white.unknown.Phi**2).sum(axis=0) / white.design.duration
    for j in range(white.joints):
        shares = np.bincount(white.unknown.group, energy[j])
        np.testing.assert_allclose(shares, white.design.scale[j]**2 / len(shares))


@pytest.mark.parametrize("groups", [12, 4])
def test_values_that_differ_between_recordings_widen_the_interval_to_their_scatter(groups):
    spread, sds, means = 0.5, [], []
    for seed in range(20):
        beta = 0.8 + spread * np.random.default_rng(seed + 900).standard_normal(groups)
        got = found(with_values(beta, seed, groups, noise=0.01))
        sds.append(float(np.sqrt(got.covariance[0, 0])))
        means.append(float(got.mean[0]))
    if groups == 12:  # of fewer, blocks of the same recording know of half of it only
        assert np.mean(sds) == pytest.approx(np.std(means), rel=0.35)
    assert np.mean(sds) > 0.4 * np.std(means)
    assert float(np.sqrt(found(with_values(0.8, 1, groups, noise=0.01)).covariance[0, 0])) < 0.2 * np.mean(sds)


def test_the_scatter_of_few_recordings_is_counted_over_their_blocks():
    one = with_values(0.5, seed=6, groups=4)
    mean, inverse, D = by_hand(one, (0,))
    r, unit = one.whitened.y - D @ mean, one.whitened.design.problem.block_of
    scores = np.stack([np.einsum("njk,nj->k", D[unit == g], r[unit == g]) for g in range(8)])
    at = one.whitened.p
    sandwich = (inverse @ scores.T @ scores @ inverse)[at, at] * 8 / 7
    form, inverse = form_by_hand(one, D, inverse)[at, at], wider_by_hand(one, D)
    assert found(one).covariance[0, 0] == pytest.approx(max(inverse[at, at], sandwich) + form, rel=1e-5)


def test_values_are_in_the_units_of_the_effect():
    plain, large = found(with_values(0.5, 7)), found(with_values(0.5 * 20.0, 7, scale=20.0))
    np.testing.assert_allclose(large.mean, 20 * plain.mean, rtol=1e-9)
    np.testing.assert_allclose(large.covariance, 400 * plain.covariance, rtol=1e-9)


@pytest.mark.parametrize(("limits", "beta", "value", "bounded"), [
    ((0.0, np.inf), 0.6, 0.6, False),
    ((0.0, np.inf), -0.6, 0.0, False),
    ((-np.inf, 0.0), 0.6, 0.0, False),
    ((0.0, 0.4), 0.6, 0.4, True),
    ((-0.4, 0.0), -0.6, -0.4, True),
    ((-0.4, 0.4), 0.2, 0.2, False),
])
def test_a_value_is_cut_at_its_bounds_and_says_so_where_the_bound_is_not_zero(limits, beta, value, bounded):
    laws = (law("law_0", limits=(limits,)), *LAWS[1:])
    got = found(with_values(20 * beta, 8, noise=0.01, scale=20.0,
                            laws=(law("law_0", limits=(tuple(20 * np.array(limits)),)), *LAWS[1:])))
    assert got.mean[0] == pytest.approx(20 * value, rel=0.02, abs=1e-9)
    assert got.bounded == bounded
    assert found(with_values(beta, 8, noise=0.01, laws=laws)).bounded == bounded


@pytest.mark.parametrize(("beta", "between"), [
    (np.array([0.5, -0.5, 0.5, -0.5, -0.5, -0.5, 0.5, -0.5]), 0.0),
    (np.array([0.5, -0.5, 0.9, -0.1, 0.3, -0.7, 0.2, -0.4]), np.var([0.5, 0.5, 0.9, 0.1, 0.3, 0.7, 0.2, 0.4], ddof=1)),
])
def test_values_of_each_recording_s_own_are_told_by_their_rms_with_the_spread_of_the_delta_rule(beta, between):
    one = with_values(beta, 9, noise=0.05, laws=(law("law_0", per_recording=True), *LAWS[1:]))
    scored = one.score((0,))
    got = found(one)
    rms = np.sqrt((beta**2).mean())
    assert got.mean[0] == pytest.approx(rms, rel=0.05)
    at = scored.places(one.view)[0]
    sds = np.sqrt(np.diag(scored.fit.covariance(np.arange(at.start, at.stop))))
    slopes = beta / (len(beta) * rms)
    assert np.sqrt(got.covariance[0, 0]) == pytest.approx(np.sqrt((slopes**2 * (sds**2 + between)).sum()), rel=0.5)


def test_a_recording_that_hardly_tells_its_value_counts_little():
    beta, variances = np.array([[0.5], [-0.52], [0.49], [0.4]]), np.array([1e-4, 1e-4, 1e-4, 0.04])
    rms, covariance = _pool(beta, np.diag(variances))
    assert rms[0] == pytest.approx(0.5, abs=0.01)
    assert np.sqrt(covariance[0, 0]) == pytest.approx(0.01 / np.sqrt(3), rel=0.5)


def test_sizes_that_differ_by_more_than_they_are_known_to_count_alike():
    sizes, variances = np.array([1.0, 2.0, 3.0]), np.array([1e-8, 1e-8, 1e-4])
    assert _variance_between(sizes, variances) == pytest.approx(np.var(sizes, ddof=1), rel=0.5)
    assert _variance_between(np.full(3, 2.0), variances) == 0.0
    assert _pool(sizes[:, None], np.diag(variances))[0][0] == pytest.approx(np.sqrt((sizes**2).mean()), rel=0.01)


def test_a_fit_that_explains_nearly_all_does_not_hang_on_the_form_of_the_rest():
    """Where the evidence is weighted by what it grants to the form of laws, values are those of least squares all the same."""
    one = with_values(0.8, 5, groups=8, rows=60, noise=0.01)
    loud = np.where(np.arange(len(one.whitened.v)) % 3 == 0, 1.0, 1e-4)[:, None] * np.ones_like(one.whitened.v)
    coarse = Search(WeightedLibrary(WhiteRows(one.whitened.design, one.whitened.unknown, loud), one.view.library), one.start)
    fit = best_fit(coarse, coarse.score((0,)))
    assert fit.posterior.mean[fit.coefficients][-1] == pytest.approx(0.8, abs=0.002)
    assert np.median(fit.whitened.v) == pytest.approx(1e-4, rel=0.2), "the noise that is left, not what was granted"
    told = values_of(coarse, coarse.score((0,)), 0)
    assert told.covariance[0, 0] > fit.posterior.covariance(fit.coefficients)[-1, -1], "its interval is that of the noise that was granted"


def test_the_best_fit_of_a_set_is_found_once():
    one = with_values(0.5, 3)
    assert best_fit(one, one.score((0,))) is best_fit(one, one.score((0,)))


@pytest.mark.parametrize(("beta", "nothing"), [((0.8, 0.4), False), ((0.0, 0.0), True)])
def test_a_law_says_nothing_where_the_interval_of_each_of_its_values_holds_0_with_all_that_it_hangs_on(beta, nothing):
    """Its octave is known exactly, whether it is there or not."""
    one = with_oscillation((1.05, 0.6), (1.05, 0.6), beta=beta, seed=2)
    assert says_nothing(one, one.score((0,)), 0) == nothing


def test_a_law_without_nonlinear_values_is_asked_for_its_linear_values_alone():
    one = with_values(0.0, seed=3)
    assert not says_nothing(one, one.score((0,)), 0)


def test_the_interval_of_a_value_ends_at_its_physical_bounds():
    """A contact bends by no negative angle; its friction pushes in no motion."""
    rubbing = made("coulomb_friction", arm(1), 1, level=(0.1,), bending=(0.001,))
    spans = quantity_intervals(rubbing, Values(np.array([0.1]), np.diag([0.1**2, 0.001**2]), names=("bending",)))
    assert spans["bending"] == pytest.approx((0.0, 0.00296), rel=1e-3)
    assert spans["level"] == pytest.approx((0.0, 0.296), rel=1e-3)


def test_a_scale_known_to_a_tenth_moves_all_linear_values_together_and_no_other():
    values = Values(np.array([2.0, -4.0]), np.diag([0.01, 0.01, 0.5]), names=("speed",)).with_scale_known_to(0.1)
    np.testing.assert_allclose(values.covariance, [[0.05, -0.08, 0.0], [-0.08, 0.17, 0.0], [0.0, 0.0, 0.5]])


@pytest.mark.parametrize("spread", [0.05, 2.0])
def test_a_scale_known_to_a_factor_widens_an_interval_by_that_factor_and_leaves_angles_alone(spread):
    """k (q - 0.3): the stiffness has the scale, the rest angle has none; however wide, the stiffness stays above 0."""
    spring = made("umbilical_stiffness", arm(1), 1, stiffness=(2.0,), preload=(-0.6,), quadratic=(), cubic=())
    spans = intervals_of_scale(spring, {"stiffness": (2.0, 2.0), "rest_angle": (0.2, 0.4)}, spread)
    factor = np.exp(1.96 * np.sqrt(np.log1p(spread**2)))
    assert spans["stiffness"] == pytest.approx((2.0 / factor, 2.0 * factor))
    assert spans["rest_angle"] == pytest.approx((0.2, 0.4))
    if spread < 0.1:
        assert spans["stiffness"] == pytest.approx((2.0 - 1.96 * 2.0 * spread, 2.0 + 1.96 * 2.0 * spread), rel=0.02)


def test_of_a_machine_that_nothing_drives_values_and_their_spread_are_those_over_the_factor_that_is_kept():
    driven, free = with_values(0.8, seed=3), with_values(0.8, seed=3)
    of = free.whitened.design
    of.undriven, of.shares_of_model = True, lambda laws: np.full(len(laws), 0.5)
    before, after = (found(machine) for machine in (driven, free))
    kept = best_fit(free, free.score((0,))).scale_factor
    assert abs(kept - 1.0) > 0.05
    np.testing.assert_allclose(after.mean, before.mean / kept)
    np.testing.assert_allclose(after.covariance, before.covariance / kept**2)
