"""Sums over rows hold all that a linear fit asks of them."""

import numpy as np
from campaigns import GIVEN, campaign, planted, recording
from rigs import arm

from nnhydro.fitting.linear.statistics import columns_and_offset, of_segment, residual_energy, total
from nnhydro.models.baselines import BASELINES
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LinearTerm, term_kinds
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.motion import Motion
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.recordings.filtering.preprocessing import Preparation, prepare


def start(a):
    return BASELINES["constant"].start(a)


def values(model_or_loads):
    loads = getattr(model_or_loads, "loads", model_or_loads)
    return np.concatenate([term.linear_values().numpy() for term in loads.linear().values()])


def test_the_sums_over_segments_are_the_sums_over_all_rows():
    a = arm(2)
    whole = campaign(a, planted(a), noise=0.1)
    segments = [s for name in whole.names for s in whole.segments(name, GIVEN)]
    X, tau = (np.concatenate(x) for x in zip(*((columns_and_offset(start(a), s, a)[0], s.tau) for s in segments), strict=True))
    summed = total([of_segment(start(a), s, a) for s in segments])
    for j in range(2):
        np.testing.assert_allclose(summed.H[j], X[:, j].T @ X[:, j], rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(summed.g[j], X[:, j].T @ tau[:, j], rtol=1e-10, atol=1e-9)
    theta = values(planted(a)) * 1.1
    np.testing.assert_allclose(residual_energy(summed, theta), ((tau - X @ theta) ** 2).sum(0), rtol=1e-8)
    half = np.arange(len(segments[0])) % 2 == 0
    parts = of_segment(start(a), segments[0], a, half) + of_segment(start(a), segments[0], a, ~half)
    np.testing.assert_allclose(parts.H, of_segment(start(a), segments[0], a).H, rtol=1e-12)


def test_columns_times_parameters_are_the_models_torque():
    a = arm(2, drive="remote", gear={"ratio": 20.0, "efficiency": 0.7, "torque_at": "motor"})
    loads = planted(a).plus("friction", CoulombTerm((0.1, 0.2)))
    (segment,) = campaign(a, loads, 1).segments("run0", GIVEN)
    X, offset = columns_and_offset(loads, segment, a)
    np.testing.assert_allclose(X @ values(loads) + offset, segment.tau, rtol=1e-9, atol=1e-12)


def test_what_is_not_linear_in_its_parameters_passes_belt_and_gear_too():
    a = arm(2, drive="remote", gear={"ratio": 20.0, "efficiency": 0.7, "torque_at": "motor"})
    kinds = [cls for cls in term_kinds().values() if not issubclass(cls, LinearTerm)]
    assert kinds
    for cls in kinds:
        loads = planted(a).plus("other", cls.at_start(a))
        (segment,) = campaign(a, loads, 1).segments("run0", GIVEN)
        X, offset = columns_and_offset(loads, segment, a)
        np.testing.assert_allclose(X @ values(planted(a)) + offset, segment.tau, rtol=1e-9, atol=1e-12)


def test_a_model_without_linear_terms_has_no_columns_and_its_whole_torque_beside_them():
    a = arm(2)
    loads = Loads({name: term for name, term in state_loads(a).terms.items() if not isinstance(term, LinearTerm)})
    segment = next(iter(prepare(recording(a, Loads({"drag": NormalDrag((1.0, 1.0))}), seconds=0.5), Preparation(None))))
    X, c0 = columns_and_offset(loads, segment, a)
    assert X.shape == (len(segment), 2, 0)
    np.testing.assert_allclose(c0, loads.torque(Flow(a, Motion.of(segment))))
    assert np.abs(c0).max() > 0
