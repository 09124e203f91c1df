"""The search for a travel scale, and the rows behind a low-pass, against the general way to the same numbers."""

import numpy as np
import pytest
import torch
from campaigns import recording, with_links
from rigs import arm

from nnhydro.errors import CampaignError
from nnhydro.fitting.linear.least_squares import fit, joint_weights, solve
from nnhydro.fitting.linear.prior import prior
from nnhydro.fitting.linear.statistics import of_segment, residual_energy, total
from nnhydro.fitting.travel import travel_scale
from nnhydro.fitting.travel.travel_scale import COARSE, _energy, _statistics, _vertex, with_best_travel_scale
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.travel.state_model import has_travel_scale, state_loads, with_tau_s
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation, prepare
from nnhydro.recordings.splitting import Unit

A = arm(1)
LOADS = state_loads(A, per_link=3)


def curved(tau_s, a=A, seed=1, seconds=3.0, how=None):
    """A segment whose torque is that of curves with the travel scale `tau_s`."""
    loads = with_tau_s(state_loads(a, per_link=3), tau_s)
    terms = {name: term.with_linear(torch.linspace(0.5, 1.5, len(term.linear_values())).double()) if name in loads.linear() and
             name != "rigid_body" else term for name, term in loads.terms.items()}
    r = recording(a, Loads(terms), seed=seed, seconds=seconds, rate=50.0)
    return next(iter(prepare(r, how or Preparation(None))))


def same(one, other):
    for name in ("H", "g", "s", "n"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(("keys", "how"), [
    ({}, Preparation(None)), ({}, Preparation(LowPass(4.0))),
    ({"links": 2, "drive": {"kind": "remote", "pulley_ratio": 1.3, "angle2": "relative"}}, Preparation(None)),
    ({"gear": {"ratio": 5.0, "efficiency": 0.7, "torque_at": "motor"}}, Preparation(LowPass(4.0))),
])
def test_the_sums_for_many_travel_scales_are_those_of_a_model_with_each(keys, how):
    keys = dict(keys)
    a = arm(keys.pop("links", 1), **keys)
    segment, loads = curved(5.0, a, how=how), state_loads(a, per_link=3)
    loads = loads.plus("friction", ViscousTerm((0.1,) * a.n_links))
    scales = np.array([3.0, 8.0])
    for scale, sums in zip(scales, _statistics(loads, segment, a, scales), strict=True):
        same(sums, of_segment(with_tau_s(loads, float(scale)), segment, a))


def unit(name, *segments):
    return Unit(name, name, False, lambda: segments)


@pytest.fixture(scope="module")
def found():
    segments = [curved(6.3, seed=seed) for seed in (1, 2, 3)]
    return segments, with_best_travel_scale(LOADS, [unit(f"run{k}", segment) for k, segment in enumerate(segments)], A)


def test_the_travel_scale_that_made_the_recordings_is_found(found):
    _, told = found
    assert told.tau_s == pytest.approx(6.3, abs=0.15)
    assert has_travel_scale(told.loads)
    assert {term.tau_s[0] for term in told.loads.terms.values() if hasattr(term, "tau_s")} == {told.tau_s}
    assert told.grid[int(np.argmin(told.energy))] == pytest.approx(6.3, abs=0.34)


def test_the_energies_are_those_of_the_penalised_fit_at_each_scale(found):
    segments, told = found
    before, every = prior(LOADS, A), {}
    for scale in (2.0, 9.0, 15.0):
        every[scale] = total([of_segment(with_tau_s(LOADS, scale), segment, A) for segment in segments])
    first = fit(every[9.0], before, np.ones(1))  # the middle of the table
    weight = joint_weights(every[2.0], before, first.rms, np.ones(1))
    assert len(COARSE) == 14
    for scale, sums in every.items():
        theta = solve(sums, before, weight).theta
        z = np.linalg.lstsq(before.F, theta - before.mean, rcond=None)[0]
        want = float(weight @ residual_energy(sums, theta) + z @ z)
        assert _energy(sums, before, weight) == pytest.approx(want, rel=1e-9)
        k = int(np.argmin(np.abs(told.grid - scale)))
        assert told.energy[k] == pytest.approx(want, rel=1e-6)
    np.testing.assert_allclose(np.diff(told.grid) > 0, True)
    assert set(COARSE) <= set(told.grid)


def test_of_many_recordings_sixteen_spread_over_the_campaign_decide():
    segment, asked = curved(5.0, seconds=0.6), []

    def of(k):
        def segments():
            asked.append(k)
            return (segment,)
        return Unit(f"run{k}", f"run{k}", False, segments)

    with_best_travel_scale(LOADS, [of(k) for k in range(31)], A)
    assert sorted(set(asked)) == list(range(0, 31, 2))
    asked.clear()
    with_best_travel_scale(LOADS, [of(k) for k in range(3)], A)
    assert sorted(set(asked)) == [0, 1, 2]


def test_the_sums_of_a_recording_are_computed_once_however_many_fits_it_belongs_to(monkeypatch):
    asked = []
    monkeypatch.setattr(travel_scale, "_statistics", lambda *given: asked.append(given) or _statistics(*given))
    segments = [curved(5.0, seed=seed, seconds=2.0) for seed in (1, 2, 3)]
    every = [unit(f"run{k}", segment) for k, segment in enumerate(segments)]
    first, again = (with_best_travel_scale(state_loads(A, per_link=3), every, A) for _ in range(2))
    assert len(asked) == 2 * 3  # coarse and fine
    assert first.tau_s == again.tau_s
    heavier = with_links(A, mass_kg=9.0)
    other = with_best_travel_scale(state_loads(heavier, per_link=3), every, heavier)
    assert len(asked) > 2 * 3
    assert other.energy.tolist() != first.energy.tolist()


def test_without_a_stretch_to_fit_the_user_is_told_where_to_look():
    for chosen in ([], [Unit("run", "run", False, tuple)]):
        with pytest.raises(CampaignError, match="see nnhydro check"):
            with_best_travel_scale(LOADS, chosen, A)
    assert not has_travel_scale(Loads({"drag": NormalDrag((1.0,))}))


def test_the_vertex_is_that_of_the_parabola_and_an_end_is_itself():
    x = np.array([1.0, 2.0, 4.0, 7.0])
    assert _vertex(x, (x - 3.2) ** 2 + 5) == pytest.approx(3.2)
    assert _vertex(x, x) == 1.0
    assert _vertex(x, -x) == 7.0
    assert _vertex(x, np.array([3.0, 2.0, 2.0, 3.0])) == pytest.approx(np.roots(np.polyder(np.polyfit(x[:3], [3.0, 2.0, 2.0], 2)))[0])
