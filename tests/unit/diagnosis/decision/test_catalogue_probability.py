"""A name that leaves much of what there is to explain is less probable than a cause on no card; a standard term is asked for its form."""

import numpy as np
import pytest
from problems import design, law, search, unknown

import nnhydro.diagnosis.decision.catalogue_probability as deciding
from nnhydro.diagnosis.constants import FEW_NATS, FORM, LEAST_GAIN, TRUSTED_RATIO
from nnhydro.diagnosis.decision import catalogue_probability
from nnhydro.diagnosis.decision.catalogue_probability import LISTED, listed_probability, share_left_of_form
from nnhydro.diagnosis.decision.decide import decide
from nnhydro.diagnosis.decision.scatter import scatter_between_recordings
from nnhydro.effects.catalogue import catalogue

OTHERS = tuple(law(f"law_{k}") for k in range(30))


def hidden(rest):
    """A search in which one smooth law acts beside `rest` of a smooth function that is on no card."""
    of = design(4, groups=8, rows=60, noise=0.02)
    smooth = unknown(of).Phi
    rng = np.random.default_rng(7)
    X = rng.standard_normal((*of.y.shape, 1 + len(OTHERS)))
    X[..., 0] = smooth @ rng.standard_normal((smooth.shape[1], 2))
    X /= np.sqrt((X**2).mean(axis=(0, 1)))
    of.y = of.y + 0.3 * X[..., 0] + rest * smooth[:, ::-1][:, :2]
    return search(of, (law("smooth"), *OTHERS), X, level=0.02**2)


def standard(same=0.0, other=0.0, more=()):
    """A search with a standard term of joint 1 of size 0.3, beside another function of its variable, and one of other variables."""
    of = design(4, groups=8, rows=60, noise=0.02)
    columns = unknown(of).Phi  # three of the angle of joint 1, three of pairs
    own = columns[:, 0] + 0.5 * np.random.default_rng(8).standard_normal(len(columns))  # partly rougher than the unknown
    of.y[:, 0] += 0.3 * own + same * columns[:, 1] + other * columns[:, 3]
    X = np.random.default_rng(7).standard_normal((*of.y.shape, 1 + len(more)))
    X[..., 0] = own[:, None] * np.array([1.0, 0.0])
    for k in range(len(more)):
        X[..., 1 + k] = columns[:, 1:2] * np.array([1.0, 0.0])
    return search(of, (law("term", joint=1, standard=True, depends_on=("q",)), *more), X, level=0.02**2)


def left(one):
    """The share that the first law leaves of what the unknown makes of it."""
    return one.share_left(one.score(()), one.score((0,)))


@pytest.mark.parametrize("rest", [0.01, 0.03, 0.1])
def test_the_probability_of_a_special_cause_falls_with_the_share_that_it_leaves(rest):
    one = hidden(rest)
    scatter = scatter_between_recordings(one, one.score((0,)), 0)
    want = LISTED / (1 + (max(left(one), 0.0) / FORM) ** 4 + (scatter / TRUSTED_RATIO) ** 4)
    assert one.nats_of_unknown(one.score((0,)), [0]) > FEW_NATS
    assert listed_probability(one, one.score((0,)), 0) == pytest.approx(want)


@pytest.mark.parametrize(("recordings", "parts"), [(0.3, 0.1), (0.1, 0.3)])
def test_the_larger_scatter_of_the_size_counts(monkeypatch, recordings, parts):
    one = hidden(0.001)
    monkeypatch.setattr(catalogue_probability, "scatter_between_recordings", lambda *given: recordings)
    monkeypatch.setattr(catalogue_probability, "scatter_between_parts", lambda *given: parts)
    share = max(left(one), 0.0) / FORM
    want = LISTED / (1 + share**4 + (0.3 / TRUSTED_RATIO) ** 4)
    assert listed_probability(one, one.score((0,)), 0) == pytest.approx(want)


def test_what_leaves_no_more_than_chance_is_the_cause_as_far_as_any_list_can_tell():
    one = hidden(0.0)
    assert listed_probability(one, one.score((0,)), 0) == pytest.approx(LISTED, abs=1e-3)


def varying(spread, varies=False):
    """A search in which a law acts with sizes about 0.3 that differ between the recordings by the share `spread`."""
    of = design(4, groups=8, rows=60, noise=0.02)
    X = np.random.default_rng(7).standard_normal((*of.y.shape, 1))
    sizes = 0.3 * (1 + spread * np.resize([1.0, -1.0], 8))
    of.y = of.y + sizes[of.problem.group_of][:, None] * X[..., 0]
    return search(of, (law("one", varies=varies),), X, level=0.02**2)


@pytest.mark.parametrize(("spread", "least", "most"), [(0.0, 0.95, LISTED), (0.1, 0.9, 0.95), (0.25, 0.4, 0.52), (0.6, 0.0, 0.05)])
def test_a_cause_has_one_size_in_all_recordings(spread, least, most):
    one = varying(spread)
    assert least <= listed_probability(one, one.score((0,)), 0) <= most


def test_friction_may_differ_between_recordings_as_it_does_with_temperature():
    one = varying(0.6, varies=True)
    assert listed_probability(one, one.score((0,)), 0) > 0.95
    assert {name for name, effect in catalogue().items() if effect.varies} == {
        "coulomb_friction", "viscous_friction", "load_friction", "stribeck_friction", "torque_bias", "ambient_current"}


def test_a_law_whose_size_differs_between_recordings_is_not_named():
    one = varying(0.6)
    told = decide(one, one.score((0,)), 0)
    assert told.claimed.chosen == ()
    assert "the size differs between recordings" in told.decisions[0].reason


def test_a_special_cause_that_leaves_a_third_of_the_unknown_is_not_named():
    rest = next(r for r in np.geomspace(0.01, 0.3, 40) if 0.28 < left(hidden(r)) < 0.45)
    one = hidden(rest)
    told = decide(one, one.score((0,)), 0)
    assert told.claimed.chosen == ()
    assert "outside the catalogue" in told.decisions[0].reason


@pytest.mark.parametrize("same", [0.1, 0.2, 0.4])
def test_a_standard_term_leaves_the_share_of_what_any_function_of_its_variable_explains(same):
    one = standard(same)
    assert share_left_of_form(one, one.score((0,)), 0) == pytest.approx(same**2 / (0.3**2 + same**2), rel=0.25)


def test_a_standard_term_of_another_form_than_its_variable_acts_in_is_not_named():
    true, wrong = standard(same=0.02), standard(same=0.3)
    assert decide(true, true.score((0,)), 0).claimed.chosen == (0,)
    told = decide(wrong, wrong.score((0,)), 0)
    assert told.claimed.chosen == ()
    assert "outside the catalogue" in told.decisions[0].reason


def test_what_other_variables_do_is_no_evidence_against_a_standard_term():
    one = standard(other=0.6)
    assert one.nats_of_unknown(one.score((0,)), [0]) > FEW_NATS
    assert listed_probability(one, one.score((0,)), 0) == pytest.approx(LISTED, abs=1e-2)


def test_two_laws_of_one_variable_are_asked_for_their_form_together():
    one = standard(same=0.3, more=(law("second", joint=1, standard=True, depends_on=("q",)),))
    alone, both = one.score((0,)), one.score((0, 1))
    assert share_left_of_form(one, alone, 0) > 0.3
    assert share_left_of_form(one, both, 0) == share_left_of_form(one, both, 1) == 0.0


def test_a_constant_is_asked_whether_it_is_the_mean_of_a_function_of_the_angle():
    of = design(4, groups=8, rows=60, noise=0.02)
    columns, X = unknown(of).Phi, np.zeros((*of.y.shape, 1))
    X[:, 0] = 1.0
    offset = (law("offset", joint=1, standard=True, depends_on=("nothing",)),)

    def claimed(pull):
        """Whether an offset is named beside a cable that pulls by `pull` times as much, and of which it may be the mean."""
        of.y[:, 0] = design(4, groups=8, rows=60, noise=0.02).y[:, 0] + 0.3 + 0.3 * pull * columns[:, 0]
        one = search(of, offset, X, level=0.02**2)
        return listed_probability(one, one.score((0,)), 0)

    assert claimed(0.0) == pytest.approx(LISTED, abs=1e-3)
    assert claimed(0.2) > 0.9
    assert claimed(1.0) < 0.5


def test_of_two_terms_that_are_as_probable_the_form_of_the_better_counts(monkeypatch):
    """The second law holds what the first misses of their variable: where it is as probable, either is told."""
    of = design(4, groups=8, rows=60, noise=0.02)
    columns = unknown(of).Phi
    rough = 0.02 * np.random.default_rng(8).standard_normal(len(columns))
    of.y[:, 0] += 0.3 * (columns[:, 0] + columns[:, 1])
    X = np.zeros((*of.y.shape, 2))
    X[:, 0, 0], X[:, 0, 1] = columns[:, 0] + rough, columns[:, 0] + columns[:, 1]
    both = [law(name, joint=1, standard=True, depends_on=("q",)) for name in ("wrong", "right")]
    alone, beside = (search(of, laws, X[..., :len(laws)], level=0.02**2) for laws in (both[:1], both))
    assert listed_probability(alone, alone.score((0,)), 0) < 0.5
    assert beside.score((1,)).score > beside.score((0,)).score - LEAST_GAIN
    assert listed_probability(beside, beside.score((0,)), 0) > 0.9
    monkeypatch.setattr(deciding, "LEAST_GAIN", -1e4)  # as if the second were not probable enough
    assert listed_probability(beside, beside.score((0,)), 0) < 0.5
