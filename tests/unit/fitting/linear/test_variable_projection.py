"""Variable projection: against closed forms, against brute force, and on McLain & Rock's twelve slews."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from mclain import ARM, golden, twelve_slews
from rigs import arm, run

from nnhydro.errors import CampaignError, ConfigError
from nnhydro.fitting.linear.variable_projection import SeparableFit, _local_minima, _polish, _vertex, bootstrap, reduce, separable, solve
from nnhydro.fitting.linear.variable_projection import solve as solve_rows
from nnhydro.fitting.travel.state_dependent import GRID, curve_bands, fit_state
from nnhydro.fitting.travel.state_rows import general, rows_of
from nnhydro.fitting.travel.travel_scale import with_best_travel_scale
from nnhydro.physics.flow import Flow
from nnhydro.physics.travel.state_model import added_mass_curve, drag_curve, state_loads, with_tau_s
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.recording import Recording
from nnhydro.recordings.splitting import units

TRUE = golden("identification")["true"]
SPREAD = golden("identification")["std_for_white_noise_of_5pct_rms_torque"]
NOISE = golden("identification")["noise_rms_Nm"]
TRAVELS = torch.linspace(0, 20, 201, dtype=torch.float64)


def slews(noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    flows = twelve_slews()
    truth = state_loads(ARM)
    return [(flow, truth.torque(flow) + noise * torch.from_numpy(rng.standard_normal((len(flow.motion), 1)))) for flow in flows]


def thirteen(fit):
    names = [*TRUE]
    values = [*fit.search.theta.tolist(), fit.tau_s[0]]
    return dict(zip(names, values, strict=True))


@given(rows=st.integers(1, 60), p=st.integers(1, 6), seed=st.integers(0, 99), scale=st.sampled_from([1e-6, 1.0, 1e5]))
def test_the_reduced_rows_have_the_same_normal_equations(rows, p, seed, scale):
    rng = np.random.default_rng(seed)
    X, y = scale * rng.standard_normal((rows, p)), rng.standard_normal(rows)
    R = reduce(X, y)
    assert R.shape == (p + 1, p + 1)
    assert not np.tril(R, -1).any()
    full = np.column_stack([X, y])
    np.testing.assert_allclose(R.T @ R, full.T @ full, rtol=1e-9, atol=1e-9 * scale**2 + 1e-12 * scale + 1e-12)


def test_parallel_columns_are_no_obstacle():
    x = np.linspace(0, 1, 50)
    R = reduce(np.column_stack([x, x, np.ones(50)]), 2 * x + 1)
    found = solve(R[None])
    assert found.energy < 1e-25
    assert found.theta[0] + found.theta[1] == pytest.approx(2.0)


def test_prior_rows_hold_what_the_data_do_not_tell():
    R = reduce(np.column_stack([np.ones(9), np.zeros(9)]), np.full(9, 3.0))
    found = solve(R[None], np.array([[0.0, 1e-3, 5e-3]]))
    np.testing.assert_allclose(found.theta, [3.0, 5.0], rtol=1e-9)


def exponentials(t, nu, y):
    return reduce(np.exp(-np.outer(t, 1.0 / np.asarray(nu))), y)[None]


@settings(max_examples=15)
@given(seed=st.integers(0, 50))
def test_one_and_two_decay_times_are_found_from_clean_data(seed):
    rng = np.random.default_rng(seed)
    t, times = np.linspace(0, 10, 200), (rng.uniform(0.5, 1.2), rng.uniform(3.0, 5.0))
    amplitudes = rng.uniform(1, 2, 2)
    fitted = separable(lambda nu: exponentials(t, nu, amplitudes[0] * np.exp(-t / times[0])), [np.linspace(0.3, 3.0, 10)])
    assert fitted.nu[0] == pytest.approx(times[0], rel=1e-5)
    two = separable(lambda nu: exponentials(t, nu, amplitudes @ np.exp(-np.outer(1 / np.array(times), t))),
                    [np.linspace(0.3, 1.5, 5), np.linspace(2.0, 6.0, 5)])
    np.testing.assert_allclose(two.nu, times, rtol=1e-2)


def test_a_minimum_on_the_edge_is_said():
    t = np.linspace(0, 1, 50)
    found = separable(lambda nu: exponentials(t, nu, np.exp(-t / 5.0)), [np.linspace(0.5, 2.0, 7)])
    assert found.at_bound
    assert "bound" in found.note


def test_the_thirteen_numbers_come_back_from_clean_slews():
    found = fit_state(state_loads(ARM), slews())
    assert found.search.note == ""
    for name, value in thirteen(found).items():
        assert value == pytest.approx(TRUE[name], abs=1e-6), name
    assert found.rms < 1e-8


@pytest.mark.parametrize("seed", range(3))
def test_the_thirteen_numbers_come_back_from_noisy_slews_within_four_deviations(seed):
    found = fit_state(state_loads(ARM), slews(NOISE, seed))
    for name, value in thirteen(found).items():
        assert abs(value - TRUE[name]) < 4 * SPREAD[name], name


def test_where_noise_moves_the_best_travel_scale_the_curve_stays():
    """In one noisy draw in seven (6 of 40) the smallest residual lies at tau_s near 10.7: the data say so, no search can do better."""
    pairs, truth = slews(NOISE, 4), state_loads(ARM)
    found, near = fit_state(state_loads(ARM), pairs), fit_state(state_loads(ARM), pairs, grid=[np.linspace(7.0, 9.0, 9)])
    assert found.tau_s[0] > 10.0
    assert found.search.energy < near.search.energy
    torch.testing.assert_close(drag_curve(found.loads, TRAVELS), drag_curve(truth, TRAVELS), rtol=0, atol=0.03)
    torch.testing.assert_close(added_mass_curve(found.loads, TRAVELS), added_mass_curve(truth, TRAVELS), rtol=0, atol=0.07)


@pytest.mark.slow
def test_ten_random_tables_of_the_travel_scale_end_in_the_same_curve():
    """There is no start value; where the table's points lie does not matter. Searches from one start end at 5.61 or 10.71 as well."""
    rng, pairs = np.random.default_rng(5), slews(NOISE, 1)
    curves = []
    for _ in range(10):
        grid = np.unique(np.concatenate([[2.0, 15.0], rng.uniform(2.0, 15.0, 25)]))
        found = fit_state(state_loads(ARM), pairs, grid=[grid])
        curves.append(torch.stack([drag_curve(found.loads, TRAVELS), added_mass_curve(found.loads, TRAVELS)]))
    for curve in curves[1:]:
        torch.testing.assert_close(curve, curves[0], rtol=0, atol=1e-4)


def test_the_profile_shows_the_other_minima_that_trap_a_search_from_one_start():
    grid = np.linspace(2.0, 15.0, 53)
    found = fit_state(state_loads(ARM), slews(), grid=[grid])
    trapped = sorted({round(run["tau_s_found"], 2) for run in golden("identification")["local_minima"]["runs"]})
    assert trapped == [5.61, 8.0, 10.71]
    assert sorted(nu[0] for nu in found.search.minima) == pytest.approx(trapped, abs=0.1)
    assert found.search.profile.argmin() == np.abs(grid - 8.0).argmin()


def test_ordinates_start_values_do_not_matter():
    pairs = slews(NOISE, 2)
    loads = state_loads(ARM)
    elsewhere = with_tau_s(loads, 3.0).with_linear(np.zeros(15))
    one, other = (fit_state(start, pairs) for start in (loads, elsewhere))
    assert one.tau_s == other.tau_s
    np.testing.assert_array_equal(one.search.theta, other.search.theta)


def test_the_fast_rows_are_the_rows_of_the_terms():
    a = arm(2)
    loads = state_loads(a)
    free = type(loads)({name: term for name, term in loads.terms.items() if name != "rigid_body"})
    flow = Flow(a, run(2))
    pairs = [(flow, loads.torque(flow))]
    for nu in ((7.3,), (7.3, 4.0)):
        for fast, slow in zip(rows_of(free, pairs)(nu), general(free, pairs)(nu), strict=True):
            np.testing.assert_allclose(fast, slow, rtol=1e-10, atol=1e-10)


def test_two_links_with_curves_of_their_own_are_identified():
    a = arm(2)
    truth = state_loads(a, tau_s=6.5, curve_per_link=True)
    flows = [Flow(a, run(2, rows=400, seed=seed)) for seed in range(6)]
    pairs = [(flow, truth.torque(flow)) for flow in flows]
    found = fit_state(state_loads(a, curve_per_link=True), pairs)
    assert found.tau_s[0] == pytest.approx(6.5, abs=1e-4)
    for link in range(2):
        torch.testing.assert_close(drag_curve(found.loads, TRAVELS, link), drag_curve(truth, TRAVELS, link), rtol=0, atol=2e-3)


@pytest.mark.slow
def test_the_band_of_the_curve_holds_the_truth_and_is_of_the_size_of_the_noise():
    truth, s, inside = state_loads(ARM), TRAVELS[5:100:10], []
    for seed in range(6):
        bands = curve_bands(fit_state(state_loads(ARM), slews(NOISE, seed)), s.numpy(), draws=100)
        for name, curve in (("C_D", drag_curve), ("C_M", added_mass_curve)):
            low, high = bands[name]
            value = curve(truth, s).numpy()
            inside.append((value >= low - 1e-9) & (value <= high + 1e-9))
            assert 1e-3 < np.median(high - low) < 0.2, name
    assert np.mean(inside) > 0.85  # of 120 points that do not miss independently


def test_bootstrap_of_equal_blocks_does_not_scatter():
    t = np.linspace(0, 10, 200)
    block = exponentials(t, (2.0,), np.exp(-t / 2.0))[0]
    nus, thetas = bootstrap(lambda nu: np.stack([exponentials(t, nu, np.exp(-t / 2.0))[0]] * 4), np.array([1.5, 2.0, 2.5]), 20, 0)
    assert block.shape == (2, 2)
    assert set(nus) == {2.0}
    np.testing.assert_allclose(thetas, 1.0)


def test_nothing_to_fit_is_said():
    with pytest.raises(CampaignError, match="at least one slew"):
        fit_state(state_loads(ARM), [])
    with pytest.raises(ConfigError, match="one travel scale"):
        curve_bands(fit_state(state_loads(ARM), slews()[:3], grid=[GRID[::6], GRID[::6]]), TRAVELS.numpy())


def recorded(flow, tau, name):
    m = flow.motion
    return Recording(name, m.t.numpy(), m.q.numpy(), tau.numpy(), m.qd.numpy(), m.qdd.numpy())


def test_a_campaign_finds_its_travel_scale_one_recording_at_a_time():
    truth = state_loads(ARM, tau_s=7.3)
    flows = twelve_slews()
    campaign = Campaign.of(ARM, [recorded(flow, truth.torque(flow), f"slew{i}") for i, flow in enumerate(flows)])
    chosen = units(campaign, campaign.plan())
    found = with_best_travel_scale(state_loads(ARM), chosen, ARM)
    assert found.tau_s == pytest.approx(7.3, abs=0.1)
    assert found.grid[found.energy.argmin()] == pytest.approx(7.3, abs=0.2)
    with pytest.raises(CampaignError, match="nnhydro check"):
        with_best_travel_scale(state_loads(ARM), [], ARM)


@pytest.mark.parametrize(("best", "edge"), [(10.0, True), (10.0004, True), (10.01, False), (10.99, False), (10.9996, True), (11.0, True)])
def test_a_minimum_within_a_thousandth_of_the_grids_end_lies_at_the_edge(best, edge):
    def at(nu):
        return np.array([[[1e-9, 0.0], [0.0, 1.0 + (nu[0] - best) ** 2]]])

    assert separable(at, [np.linspace(10.0, 11.0, 5)]).at_bound == edge


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
    for tau, edge in ((0.2, True), (9.0, True), (0.5 + 3.5 * 2e-3, False), (4.0 - 3.5 * 2e-3, False)):
        assert separable(decays((tau,)), grid).at_bound == edge
    note = SeparableFit((1.0,), np.ones(1), 0.0, 2e6, grid, np.ones(15), ((1.0,),), False)
    assert "hardly excited" in note.note
    assert "ended on its bound" in SeparableFit((1.0,), np.ones(1), 0.0, 2e6, grid, np.ones(15), ((1.0,),), True).note
    assert SeparableFit((1.0,), np.ones(1), 0.0, 9e5, grid, np.ones(15), ((1.0,),), False).note == ""


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
