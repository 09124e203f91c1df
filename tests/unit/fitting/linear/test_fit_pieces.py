"""Pieces of the fits by brute force: scores of a penalty, ridges, minima of a table, intervals for few motions, notes and weights."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch
from rigs import arm
from scipy.stats import norm
from scipy.stats import t as student

from nnhydro.fitting.linear import least_squares
from nnhydro.fitting.linear.penalised_fit import WEIGHTS, _score_gcv, _score_held_out, bend_rows, penalised_fit, penalised_over_scales
from nnhydro.fitting.linear.variable_projection import SeparableFit, _local_minima, _polish, _vertex, bootstrap, reduce, separable
from nnhydro.fitting.linear.variable_projection import solve as solve_rows
from nnhydro.fitting.travel import state_dependent
from nnhydro.fitting.travel.state_dependent import _joint_scale, curve_bands
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.travel.state_model import bspline_loads, drag_curve, state_loads, with_tau_s


def tables(seed=1, blocks=4, rows=30, p=3):
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((blocks, rows, p))
    y = X @ np.array([1.0, -2.0, 0.5])[:p] + 0.5 * rng.standard_normal((blocks, rows))
    return X, y, np.stack([reduce(a, b) for a, b in zip(X, y, strict=True)])


PENALTY = np.array([[1.0, -2.0, 1.0, 0.3], [0.0, 1.0, -1.0, 0.0]])


def ridge(X, y, rows):
    stacked = np.vstack([X, rows[:, :-1]])
    return np.linalg.lstsq(stacked, np.concatenate([y, rows[:, -1]]), rcond=None)[0]


@pytest.mark.parametrize("weight", [0.1, 10.0])
def test_the_left_out_score_is_the_misfit_of_blocks_to_fits_without_them(weight):
    X, y, blocks = tables()
    rows = weight * PENALTY
    theta = [ridge(np.delete(X, b, 0).reshape(-1, 3), np.delete(y, b, 0).ravel(), rows) for b in range(4)]
    own = sum(float(((y[b] - X[b] @ theta[b]) ** 2).sum()) for b in range(4))
    assert _score_held_out(blocks, rows) == pytest.approx(own, rel=1e-9)


@pytest.mark.parametrize("weight", [0.1, 10.0])
def test_the_generalised_score_is_that_of_Craven_and_Wahba(weight):
    X, y, blocks = tables()
    Z, z, rows = X.reshape(-1, 3), y.ravel(), weight * PENALTY
    hat = Z @ np.linalg.inv(Z.T @ Z + rows[:, :3].T @ rows[:, :3]) @ Z.T
    left = z - Z @ ridge(Z, z, rows)
    assert _score_gcv(blocks, 120, rows) == pytest.approx(120 * float((left**2).sum()) / (120 - np.trace(hat)) ** 2, rel=1e-9)


def test_a_weight_is_a_pure_number_and_the_best_of_those_tried_is_chosen():
    X, y, blocks = tables()
    found = penalised_fit(blocks, 120, PENALTY, weights=np.array([1e-4, 1e-2, 1.0, 100.0]))
    unit = np.linalg.norm(X) / np.linalg.norm(PENALTY[:, :-1])
    scores = [_score_held_out(blocks, np.sqrt(w) * unit * PENALTY) for w in (1e-4, 1e-2, 1.0, 100.0)]
    np.testing.assert_allclose(found.scores, scores, rtol=1e-6)
    assert found.weight == (1e-4, 1e-2, 1.0, 100.0)[int(np.argmin(scores))]
    np.testing.assert_allclose(found.theta, ridge(X.reshape(-1, 3), y.ravel(), np.sqrt(found.weight) * unit * PENALTY), rtol=1e-6)
    louder = penalised_fit(np.stack([reduce(1e3 * a, 1e3 * b) for a, b in zip(X, y, strict=True)]), 120, PENALTY)
    assert louder.weight == penalised_fit(blocks, 120, PENALTY).weight
    assert (WEIGHTS[0], WEIGHTS[-1]) == (pytest.approx(1e-8), pytest.approx(1e2))
    assert penalised_fit(blocks, 120, PENALTY, weights=np.array([1e9])).at_bound


def test_of_several_scales_the_one_whose_best_weight_predicts_best_is_taken():
    X, y, _ = tables()
    y = np.einsum("brp,p->br", np.exp(2.0 * X), [1.0, 2.0, 3.0]) + y

    def at(nu):
        return np.stack([reduce(np.exp(nu[0] * a), b) for a, b in zip(X, y, strict=True)])

    nu, told = penalised_over_scales(at, [np.array([1.0, 2.0, 3.0])], PENALTY, np.array([1e-6, 1e-3]))
    assert nu == (2.0,)
    assert told.scores.min() == pytest.approx(min(penalised_fit(at((v,)), 1, PENALTY, weights=np.array([1e-6, 1e-3])).scores.min()
                                                  for v in (1.0, 2.0, 3.0)))


def test_bends_stand_at_the_places_of_their_curve_and_drag_begins_at_nothing_inertia_at_one():
    a = arm(1)
    loads = state_loads(a)
    rows, sizes = bend_rows(loads), [len(term.linear_values()) for term in loads.linear().values()]
    assert rows.shape[1] == sum(sizes) + 1
    flat = np.zeros(sum(sizes))
    names, start, curves = list(loads.linear()), 0, []
    for name, size in zip(names, sizes, strict=True):
        if name != "rigid_body":
            curves.append(slice(start, start + size))
        start += size
    drag, mass = curves
    flat[mass] = 1.0
    assert np.abs(rows[:, :-1] @ flat - rows[:, -1]).max() == pytest.approx(0.0, abs=1e-12), "constant from the known start: no bend"
    flat[drag] = 0.7
    assert np.abs(rows[:, :-1] @ flat - rows[:, -1]).max() > 0.1
    assert not rows[:, :-1][:, [k for k in range(sum(sizes)) if not any(c.start <= k < c.stop for c in curves)]].any()
    assert len(bend_rows(bspline_loads(a, 5))) == 10


@pytest.mark.parametrize(("profile", "minima"), [
    ([3.0, 1.0, 2.0, 0.5, 4.0], [(3,), (1,)]), ([1.0, 2.0, 3.0], [(0,)]), ([3.0, 2.0, 1.0], [(2,)]), ([2.0, 1.0, 1.0, 2.0], [(1,), (2,)]),
])
def test_local_minima_are_points_that_no_neighbour_undercuts_best_first(profile, minima):
    assert _local_minima(np.array(profile)) == minima


def test_local_minima_of_a_plane_are_lowest_along_both_axes():
    x, y = np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij")
    assert _local_minima((x - 1) ** 2 + (y - 4) ** 2) == [(1, 4)]


def test_the_vertex_of_a_table_is_that_of_the_parabolas_along_each_axis():
    grid = (np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 2.0, 3.0]))
    x, y = np.meshgrid(*grid, indexing="ij")
    profile = 2 * (x - 2.6) ** 2 + 3 * (y - 1.7) ** 2 + 7
    nu, lowest = _vertex(profile, grid, (2, 1))
    assert nu == pytest.approx((2.6, 1.7))
    assert lowest == pytest.approx(7.0)
    nu, lowest = _vertex(profile, grid, (3, 1))
    assert nu == pytest.approx((4.0, 1.7)), "at an end the table says no more"
    assert lowest == pytest.approx(2 * 1.4**2 + 7)
    assert _vertex(-profile, grid, (2, 1))[0] == (3.0, 2.0)


def test_polishing_stays_between_the_neighbours_and_never_ends_above_its_start():
    grid = (np.array([0.0, 1.0, 2.0, 3.0]),)
    assert _polish(lambda nu: (nu[0] - 1.37) ** 2, grid, (1,), 1e-8) == pytest.approx((1.37,), abs=1e-4)
    assert _polish(lambda nu: -nu[0], grid, (1,), 1e-8)[0] == pytest.approx(2.0, abs=1e-3)
    assert _polish(lambda nu: abs(nu[0] - 1.0) + 5 * (nu[0] != 1.0), grid, (1,), 1e-8) == (1.0,)
    both = _polish(lambda nu: (nu[0] - 1.2) ** 2 + (nu[1] - 0.7) ** 2, grid * 2, (1, 1), 1e-8)
    assert both == pytest.approx((1.2, 0.7), abs=1e-3)


def decays(taus, noise=0.0, seed=1):
    """Rows of c exp(-t / tau) in three blocks, for separable: nu is tau."""
    t, rng = np.linspace(0, 5, 60), np.random.default_rng(seed)
    y = sum(c * np.exp(-t / tau) for c, tau in zip((2.0, 1.0), taus, strict=False)) + noise * rng.standard_normal(60)

    def at(nu):
        X = np.stack([np.exp(-t / tau) for tau in nu], axis=1)
        return np.stack([reduce(X[k::3], y[k::3]) for k in range(3)])
    return at


def test_the_best_shape_is_found_with_its_condition_and_whether_it_is_an_end():
    grid = (np.linspace(0.5, 4.0, 15),)
    found = separable(decays((1.3,)), grid)
    assert found.nu == pytest.approx((1.3,), rel=1e-5)
    assert found.theta == pytest.approx([2.0], rel=1e-5)
    assert found.energy == pytest.approx(0.0, abs=1e-8)
    assert not found.at_bound
    assert found.profile.shape == (15,)
    assert found.evaluations > 15
    for tau, edge in ((0.2, True), (9.0, True), (0.5 + 3.5 * 2e-3, False), (4.0 - 3.5 * 2e-3, False)):
        assert separable(decays((tau,)), grid).at_bound == edge
    note = SeparableFit((1.0,), np.ones(1), 0.0, 2e6, grid, np.ones(15), ((1.0,),), 3, False)
    assert "hardly excited" in note.note
    assert "ended on its bound" in SeparableFit((1.0,), np.ones(1), 0.0, 2e6, grid, np.ones(15), ((1.0,),), 3, True).note
    assert SeparableFit((1.0,), np.ones(1), 0.0, 9e5, grid, np.ones(15), ((1.0,),), 3, False).note == ""


def test_the_condition_is_that_of_scaled_columns():
    X = np.random.default_rng(1).standard_normal((50, 3)) * [1.0, 1e6, 1e-6]
    told = solve_rows(reduce(X, np.ones(50))[None])
    s = np.linalg.svd(X / np.linalg.norm(X, axis=0), compute_uv=False)
    assert told.condition == pytest.approx(s[0] / s[-1], rel=1e-6)
    twice = solve_rows(reduce(np.column_stack([X[:, 0], X[:, 0]]), X[:, 0])[None])
    assert twice.theta == pytest.approx([0.5, 0.5])


def test_a_bootstrap_draws_whole_blocks_and_its_prior_stays():
    at, grid = decays((1.3,), 0.05), np.linspace(1.0, 1.6, 7)
    nus, thetas = bootstrap(at, grid, 40, 3)
    rng = np.random.default_rng(3)
    for draw in range(40):
        picked = rng.integers(0, 3, 3)
        best = min(((np.linalg.lstsq(R[:, :-1], R[:, -1], rcond=None), R, nu) for nu in grid for R in [at((nu,))[picked].reshape(-1, 2)]),
                   key=lambda pair: float(((pair[1][:, -1] - pair[1][:, :-1] @ pair[0][0]) ** 2).sum()))
        assert nus[draw] == best[2]
        assert thetas[draw] == pytest.approx(best[0][0], rel=1e-5)
    held = bootstrap(at, grid, 10, 3, prior=np.array([[1e6, 1e6 * 7.0]]))[1]
    assert held == pytest.approx(np.full((10, 1), 7.0), rel=1e-3)


@pytest.mark.parametrize("count", [2, 3, 12])
def test_bands_of_few_motions_are_wider_as_students_t_is(count, monkeypatch):
    rng = np.random.default_rng(1)
    nus, thetas = np.full(400, 5.0), rng.standard_normal((400, 12))
    monkeypatch.setattr(state_dependent, "bootstrap", lambda *given: (nus, thetas))
    free = with_tau_s(Loads({name: term for name, term in state_loads(arm(1)).terms.items() if name != "rigid_body"}), 5.0)
    told = SimpleNamespace(tau_s=(5.0,), search=SimpleNamespace(grid=(np.linspace(2, 15, 21),)), free=free, loads=free,
                           blocks=lambda nu: np.zeros((count, 3, 3)))
    s = np.array([1.0, 2.5, 4.0])
    low, high = curve_bands(told, s)["C_D"]
    drawn = np.array([drag_curve(free.with_linear(theta), torch.from_numpy(s)).numpy() for theta in thetas])
    middle = drag_curve(free, torch.from_numpy(s)).numpy()
    wider = student.ppf(0.975, count - 1) / norm.ppf(0.975) * np.sqrt(count / (count - 1))
    q = np.quantile(drawn, [0.025, 0.975], axis=0)
    np.testing.assert_allclose(low, middle + wider * np.minimum(q[0] - middle, 0))
    np.testing.assert_allclose(high, middle + wider * np.maximum(q[1] - middle, 0))


def test_joints_count_alike_where_there_are_several():
    tau = torch.tensor([[3.0, 0.0], [-3.0, 0.0]], dtype=torch.float64)
    np.testing.assert_allclose(_joint_scale([(None, tau), (None, tau)]), [3.0, 1.0])
    np.testing.assert_allclose(_joint_scale([(None, tau[:, :1])]), [1.0])


@pytest.mark.parametrize("width", [0, 1, 4])
def test_of_values_known_to_one_and_noise_of_unit_size_the_misfit_pulls_as_much_as_the_prior(width):
    rng = np.random.default_rng(width)
    A, y = rng.standard_normal((20, width)), rng.standard_normal((20, 3))
    z = least_squares.ridge(A, y)
    np.testing.assert_allclose(A.T @ (y - A @ z), z, atol=1e-12)
