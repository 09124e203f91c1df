"""The score of a set, and what the unknown can make of a law: each against its formula, term by term."""

import numpy as np
import pytest
from problems import design, evidences, law, planted, search, unknown

from nnhydro.diagnosis.constants import FORM, UNLISTED
from nnhydro.diagnosis.model.sizes import Sizes, fit_sizes, nats_of_sizes, without_unknown
from nnhydro.diagnosis.search.library import bound_bonus
from nnhydro.diagnosis.search.scored_set import imitated_nats


@pytest.mark.parametrize("chosen", [(), (0,), (0, 2), (1, 4), (0, 5)])
def test_a_score_is_evidence_plus_prior_plus_bounds_less_what_form_costs(chosen):
    one = planted()
    got, (on, off) = one.score(chosen), evidences(one, chosen)
    doubt = np.log(1 / UNLISTED - 1) + nats_of_sizes(one.whitened, got.fit, got.sizes)
    assert on > off + doubt
    assert got.unknown_nats == pytest.approx(on - off, abs=1e-4)
    prior = sum(one.view.library.log_prior(k) for k in chosen)
    bound = 0.0
    if 5 in chosen:
        at = got.places(one.view)[5]
        sd = np.sqrt(np.diag(got.fit.covariance(np.arange(at.start, at.stop))))
        bound = bound_bonus(np.array([0.0]), np.array([np.inf]), got.fit.mean[at], sd)
    assert got.score == pytest.approx(on - doubt - FORM**2 * (on - off) + prior + bound, abs=1e-4)


def test_an_unknown_that_gains_less_than_the_odds_of_an_unlisted_cause_is_none():
    of = design(4, groups=8, rows=60)
    smooth = unknown(of).Phi[:, 0]
    gained = []
    for size in np.linspace(0.0, 0.4, 21):
        of.y[:, 0] += (size > 0) * 0.02 * smooth
        one = search(of, (law("any"),))
        fits = [fit_sizes(one.whitened, None, Sizes.even(one.whitened, size)) for size in (0.1, 0.004)]
        fit, sizes = max(fits, key=lambda found: found[0].log_evidence)
        gained.append(fit.log_evidence - nats_of_sizes(one.whitened, fit, sizes) - without_unknown(one.whitened, None).log_evidence)
        assert (one.score(()).unknown_nats > 0) == (gained[-1] > np.log(1 / UNLISTED - 1))
    assert any(0.1 < nats < np.log(1 / UNLISTED - 1) for nats in gained)
    assert gained[-1] > np.log(1 / UNLISTED - 1)


def test_what_the_unknown_can_make_of_a_law_is_all_of_a_smooth_one_and_little_of_noise():
    of = design(4, groups=8, rows=60, noise=0.05)
    X = np.random.default_rng(2).standard_normal((*of.y.shape, 2))
    X[..., 0] = unknown(of).Phi[:, :2]
    of.y = of.y + X.sum(axis=2)
    one = search(of, (law("smooth"), law("rough")), X, level=0.05**2)
    both = one.score((0, 1))
    energy = [float(b @ one.view.columns(k).gram @ b) / 2 for k in (0, 1) for b in [both.fit.mean[both.places(one.view)[k]]]]
    smooth, rough = (imitated_nats(one.view, both, k) for k in (0, 1))
    assert smooth > 0.9 * energy[0]
    assert rough < 0.1 * energy[1]
