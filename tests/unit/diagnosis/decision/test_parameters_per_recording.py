"""Other parameters in one recording are told from its noise, however large that is."""

import numpy as np
import pytest
from problems import design, law, search, unknown

from nnhydro.diagnosis.constants import FEW_NATS
from nnhydro.diagnosis.decision.parameters_per_recording import gain_of_changed_parameters, nats_of_parameters_per_recording
from nnhydro.diagnosis.model.sizes import without_unknown


def dense(Y, r, size):
    """log N(r; 0, size + Y Y') with the full covariance matrix."""
    C = size * np.eye(len(r)) + Y @ Y.T
    return -0.5 * (np.linalg.slogdet(C)[1] + r @ np.linalg.solve(C, r))


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_noise_of_any_size_is_none_of_the_parameters(size):
    rng = np.random.default_rng(3)
    gains = [gain_of_changed_parameters(rng.standard_normal((60, 5)), np.sqrt(size) * rng.standard_normal(60))[0] for _ in range(200)]
    assert max(gains) < 6


def test_the_gain_is_that_of_the_densities_at_the_most_probable_sizes():
    rng = np.random.default_rng(4)
    Y = rng.standard_normal((40, 3))
    r = Y @ [0.5, -1.0, 0.3] + 0.2 * rng.standard_normal(40)
    gain, z = gain_of_changed_parameters(Y, r)
    sizes = np.geomspace(1e-4, 10, 4000)
    best = max(dense(Y, r, s) for s in sizes) - max(-0.5 * (40 * np.log(s) + r @ r / s) for s in sizes)
    assert gain == pytest.approx(best, abs=0.05)
    assert z == pytest.approx([0.5, -1.0, 0.3], abs=0.15)


def test_nothing_left_gains_nothing():
    assert gain_of_changed_parameters(np.ones((5, 2)), np.zeros(5))[0] == 0.0


def test_what_the_records_of_an_acceleration_disagree_in_is_no_change_of_parameters():
    rng = np.random.default_rng(5)
    Y = rng.standard_normal((60, 4))
    disagreed, changed = (Y[:, k] + 0.3 * rng.standard_normal(60) for k in (3, 0))
    assert gain_of_changed_parameters(Y, disagreed)[0] > 20
    assert gain_of_changed_parameters(Y, disagreed, further=1)[0] < 3
    assert gain_of_changed_parameters(Y, changed, further=1)[0] > 20


def test_columns_that_repeat_each_other_have_a_gain_however_small_the_noise():
    """Where nothing moves and nothing is read, columns whitened by the noise of a computer's digits are as large as numbers get."""
    r = np.random.default_rng(5).standard_normal(40)
    gain, z = gain_of_changed_parameters(np.full((40, 2), 1e140), r)
    assert np.isfinite(gain)
    assert np.abs(z).max() < 1e-139


@pytest.mark.parametrize("further", [0, 1])
def test_the_nats_of_every_recording_s_own_parameters_are_those_of_the_densities_less_what_the_unknown_gains(further):
    """Beside a law of size 1 each of six recordings has a mass of its own, or records that disagree, which count nothing."""
    rng, groups = np.random.default_rng(6), 6
    of = design(5, groups=groups, rows=30, noise=0.3)
    of.problem.further_columns = further
    X = rng.standard_normal((*of.y.shape, 1))
    own = np.repeat(rng.standard_normal(groups), 30)[:, None]
    of.y = of.y + X[..., 0] + 0.5 * own * of.Y[..., 1] + 2.0 * unknown(of).Phi[:, :1]
    one = search(of, (law("load"),), X, level=0.3**2)
    found, whitened = one.score((0,)), one.whitened
    assert found.unknown_nats > FEW_NATS
    fit = without_unknown(whitened, one.view.join((0,)))
    r = whitened.y - whitened.Y @ fit.mean[:2] - one.view.columns(0).Xw @ fit.mean[len(whitened.b):]
    want = -found.unknown_nats
    for g in range(groups):
        rows = of.problem.group_of == g
        Y, left = whitened.Y[rows].reshape(-1, 2), r[rows].ravel()
        gain, alone = (dense(part, left, 1.0) + left @ left / 2 for part in (Y, Y[:, 2 - further:]))
        want += max(gain - max(alone, 0.0) * bool(further), 0.0)
    assert nats_of_parameters_per_recording(one, found) == pytest.approx(want, rel=1e-9)
