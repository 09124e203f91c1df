"""Sizes of the unknown: those of the largest marginal likelihood, in shares of the torque, and none where nothing is left."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from problems import design, unknown, whitened

from nnhydro.diagnosis.constants import SMALLEST_SIZE
from nnhydro.diagnosis.model.evidence import WhiteRows, posterior
from nnhydro.diagnosis.model.sizes import LARGEST, Sizes, fit_sizes, nats_of_sizes, none, without_unknown
from nnhydro.diagnosis.model.unknown import Unknown

M = 12  # columns of the unknown that are orthonormal


def orthonormal(level, seed=0, rows=40):
    """Rows of unit noise whose torque has the rms `level` along each of M orthonormal columns of one group, and those columns."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.standard_normal((rows, M)))[0]
    b = level * rng.choice([-1.0, 1.0], M) * np.sqrt(np.linspace(0.5, 1.5, M))
    of = SimpleNamespace(Y=np.zeros((rows, 1, 0)), y=(Q @ b)[:, None], problem=SimpleNamespace(group_of=np.zeros(rows, int)),
                         scale=np.ones(1), duration=float(rows))
    return WhiteRows(of, Unknown(Q, np.ones(M), np.zeros(M, int), ("all",)), np.ones((rows, 1))), b


def times(of, factor):
    """The design with the torque, and what is measured in it, multiplied."""
    return SimpleNamespace(**{**vars(of), "Y": factor * of.Y, "y": factor * of.y, "scale": factor * of.scale})


@pytest.mark.parametrize("level", [1.3, 1.8])
def test_along_orthonormal_columns_the_size_is_that_of_the_torque_less_the_noise(level):
    """log p = -sum [log(1 + tau^2) + b^2 / (1 + tau^2)] / 2 is largest at tau^2 = mean b^2 - 1."""
    white, b = orthonormal(level)
    fit, sizes = fit_sizes(white, None, Sizes.even(white, 0.5), updates=60)
    want = np.sqrt((b**2).mean() - 1)

    def evidence(tau):
        return -0.5 * (M * np.log(1 + tau**2) + (b**2).sum() / (1 + tau**2))

    assert fit.log_evidence == pytest.approx(evidence(sizes.tau[0, 0]), abs=1e-6)
    assert evidence(sizes.tau[0, 0]) > evidence(want) - 0.05, "climbed until a step gains no more"
    assert sizes.tau[0, 0] == pytest.approx(want, rel=0.25)


def test_where_the_torque_is_less_than_the_noise_the_size_falls():
    white, _ = orthonormal(0.3)
    fit, sizes = fit_sizes(white, None, Sizes.even(white, 0.5))
    assert sizes.tau[0, 0] < 0.25
    assert fit.log_evidence > posterior(white, None, Sizes.even(white, 0.5).vector(white)).log_evidence


def test_the_fit_is_never_less_probable_than_at_the_sizes_it_begins_with():
    for seed in range(5):
        white = whitened(design(seed))
        for start in (0.01, 0.3, LARGEST):
            even = Sizes.even(white, start)
            assert fit_sizes(white, None, even)[0].log_evidence >= posterior(white, None, even.vector(white)).log_evidence


def test_sizes_are_shares_of_the_torque_whatever_its_unit():
    of, factor = design(4), 7.0
    one, other = WhiteRows(of, unknown(of), np.ones_like(of.y)), WhiteRows(times(of, factor), unknown(of), np.full_like(of.y, factor**2))
    (_, sizes), (_, again) = (fit_sizes(white, None, Sizes.even(white, 0.2)) for white in (one, other))
    np.testing.assert_allclose(again.tau, sizes.tau, rtol=1e-6)


def test_a_prior_is_one_for_the_baseline_and_size_times_weight_times_torque_for_the_unknown():
    of = design(1)
    white = whitened(of)
    sizes = Sizes(np.array([[0.2, SMALLEST_SIZE], [0.4, 0.1]]))
    s = white.unknown.s
    joint_1, joint_2 = (np.concatenate(parts) for parts in ((0.2 * s[:3], np.zeros(3)), (0.4 * s[:3], 0.1 * s[3:])))
    np.testing.assert_allclose(sizes.vector(white), [1, 1, *(joint_1 * of.scale[0]), *(joint_2 * of.scale[1])], rtol=1e-12)


def test_a_group_of_the_smallest_size_is_none_and_is_not_climbed_from():
    white = whitened(design(2))
    assert not none(white).vector(white)[white.p:].any()
    start = Sizes(np.array([[SMALLEST_SIZE, 0.3], [0.3, SMALLEST_SIZE]]))
    climbed = fit_sizes(white, None, start)[1].tau
    assert climbed[0, 0] == climbed[1, 1] == SMALLEST_SIZE
    off = without_unknown(white, None)
    assert off.log_evidence == posterior(white, None, np.r_[np.ones(white.p), np.zeros(len(white.b) - white.p)]).log_evidence


def test_groups_shrink_to_the_smallest():
    sizes = Sizes(np.array([[0.3, 0.4], [0.3, SMALLEST_SIZE]]))
    np.testing.assert_allclose(sizes.times(0.01).tau, [[0.003, 0.004], [0.003, SMALLEST_SIZE]])


def test_sizes_do_not_hang_on_the_order_of_the_rows():
    of = design(6)
    white = whitened(of)
    order = np.random.default_rng(1).permutation(len(of.y))
    moved = SimpleNamespace(**{**vars(of), "Y": of.Y[order], "y": of.y[order]})
    turned = WhiteRows(moved, replace(white.unknown, Phi=white.unknown.Phi[order]), white.v[order])
    (fit, sizes), (again, others) = (fit_sizes(w, None, Sizes.even(w, 0.2)) for w in (white, turned))
    np.testing.assert_allclose(others.tau, sizes.tau, rtol=1e-6)
    assert again.log_evidence == pytest.approx(fit.log_evidence, abs=1e-6)


@pytest.mark.parametrize("level", [1.8, 2.0, 2.4])
def test_the_evidence_less_the_nats_of_its_sizes_is_the_integral_over_all_sizes(level):
    """int p(y | tau) d log tau / log(LARGEST / SMALLEST_SIZE) by quadrature, from the closed form of orthonormal columns."""
    white, b = orthonormal(level)
    fit, sizes = fit_sizes(white, None, Sizes.even(white, 0.5), updates=60)
    x = np.linspace(np.log(SMALLEST_SIZE), np.log(LARGEST), 20001)
    power = 1 + np.exp(2 * x)
    log_p = -0.5 * (M * np.log(power) + (b**2).sum() / power)
    integral = np.log(np.trapezoid(np.exp(log_p - log_p.max()), x) / np.ptp(x)) + log_p.max()
    assert fit.log_evidence - nats_of_sizes(white, fit, sizes) == pytest.approx(integral, abs=0.5)


def test_sizes_cost_no_more_than_their_groups_gain_and_nothing_where_there_are_none():
    for seed in range(4):
        white = whitened(design(seed))
        fit, sizes = fit_sizes(white, None, Sizes.even(white, 0.2))
        cost = nats_of_sizes(white, fit, sizes)
        assert cost >= 0
        for group in np.argwhere(sizes.tau > SMALLEST_SIZE):
            rest = sizes.tau.copy()
            rest[tuple(group)] = SMALLEST_SIZE
            fewer = posterior(white, None, Sizes(rest).vector(white))
            saved = cost - nats_of_sizes(white, fewer, Sizes(rest))
            assert saved <= max(fit.log_evidence - fewer.log_evidence, 0) + 1.0, "what one group costs is about what it gains at most"
    assert nats_of_sizes(white, without_unknown(white, None), none(white)) == 0.0
