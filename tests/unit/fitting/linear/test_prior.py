"""What is known beforehand, against what recordings say."""

import numpy as np
import pytest
from campaigns import GIVEN, campaign, planted
from rigs import arm

from nnhydro.fitting.linear.least_squares import solve
from nnhydro.fitting.linear.prior import prior
from nnhydro.fitting.linear.statistics import of_segment, total
from nnhydro.models.baselines import BASELINES
from nnhydro.physics.load_sum import Loads


def start(a):
    return BASELINES["constant"].start(a)


def values(model_or_loads):
    loads = getattr(model_or_loads, "loads", model_or_loads)
    return np.concatenate([term.linear_values().numpy() for term in loads.linear().values()])


def test_weak_data_leave_the_prior_and_strong_data_overrule_it():
    a = arm(1)
    whole = campaign(a, planted(a), 2)
    stats = total([of_segment(start(a), s, a) for name in whole.names for s in whole.segments(name, GIVEN)])
    before = prior(start(a), a)
    np.testing.assert_allclose(solve(stats, before, np.array([1e-12])).theta, before.mean, rtol=1e-6)
    np.testing.assert_allclose(solve(stats, before, np.array([1e12])).theta, values(planted(a)), rtol=1e-6)


def test_of_nothing_nothing_is_known_beforehand():
    none = prior(Loads({}), arm(2))
    assert [x.shape for x in (none.mean, none.F, none.lowest, none.highest)] == [(0,), (0, 0), (0,), (0,)]


@pytest.mark.parametrize("keys", [{"friction": [{"coulomb_Nm": 0.4, "viscous_Nm_s": 0.3, "known_to": 0.25}]},
                                  {"drive": {"kind": "direct", "rotor_inertia_kg_m2": [0.08], "known_to": 0.25}}])
def test_the_prior_of_a_stated_value_is_as_wide_as_it_is_known(keys):
    a = arm(1, **keys)
    loads = Loads({name: term for name, term in BASELINES["rigid"].start(a).terms.items() if name.startswith("stated_")})
    before = prior(loads, a)
    np.testing.assert_allclose(np.diag(before.F), 0.25 * before.mean)
    assert (before.mean + before.F @ before.lowest >= -1e-12).all()
