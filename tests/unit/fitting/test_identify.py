"""Coefficients that were planted are found again, with intervals that mean what they say."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import GIVEN, campaign, dry, heavier, planted, recording, sensor_torque, steady_table, with_links, with_torque
from rigs import arm

from nnhydro.errors import CampaignError, ConfigError
from nnhydro.fitting.identify import _notes, estimates, identify
from nnhydro.fitting.linear.least_squares import Solution, bootstrap, fit, solve
from nnhydro.fitting.linear.prior import Prior, prior
from nnhydro.fitting.linear.statistics import block, of_segment, total
from nnhydro.models.baselines import BASELINES
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import inertial_directions
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign

EXACT = 1e-6  # relative: what is left of float64 after a fit with priors a billion times weaker than noise-free data


def start(a):
    return BASELINES["constant"].start(a)


def values(model_or_loads):
    loads = getattr(model_or_loads, "loads", model_or_loads)
    return np.concatenate([term.linear_values().numpy() for term in loads.linear().values()])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_noise_free_recordings_give_the_planted_coefficients_back(count):
    a = arm(count)
    model = identify(campaign(a, planted(a)))
    np.testing.assert_allclose(values(model), values(planted(a)), rtol=EXACT, atol=EXACT)


@pytest.mark.parametrize("keys", [
    {"drive": "remote"}, {"drive": {"kind": "remote", "pulley_ratio": 1.5}},
    {"gear": {"ratio": 25.0, "efficiency": 0.8, "torque_at": "motor"}},
    {"gear": {"ratio": 25.0, "efficiency": 0.8}}, {"gravity_m_s2": 9.81},
], ids=str)
def test_belts_gears_losses_and_weight_are_seen_through(keys):
    a = arm(2, **keys)
    model = identify(campaign(a, planted(a)))
    np.testing.assert_allclose(values(model), values(planted(a)), rtol=EXACT, atol=EXACT)


def test_a_mass_that_was_weighed_wrongly_is_corrected_within_what_was_known():
    truth = with_links(arm(2), known_to=0.05)
    wrong = heavier(truth, 1.04)
    noise_free = campaign(truth, planted(truth), 6)
    model = identify(Campaign.of(wrong, list(noise_free.recordings())))
    for r in noise_free.recordings():  # mass of link 1 and the fixed part of inertias trade off; torques do not
        (segment,) = noise_free.segments(r.name, GIVEN)
        got = sensor_torque(wrong, model.loads, Motion.of(segment))
        assert np.abs(got - r.tau).max() < 1e-3 * np.abs(r.tau).max()
    drag = model.loads.terms["normal_drag"].C_D
    np.testing.assert_allclose(drag, planted(truth).terms["normal_drag"].C_D, rtol=2e-3)


@pytest.mark.parametrize(("known_to", "said"), [(0.01, True), (0.3, False)])
def test_a_mass_far_from_what_is_stated_is_told_with_the_value_to_check(known_to, said):
    truth, stated = heavier(arm(2), 1.5), with_links(arm(2), known_to=known_to)
    runs = campaign(truth, planted(truth), 6)
    warnings = [line for line in identify(Campaign.of(stated, list(runs.recordings()))).fit["warnings"] if "arm.yaml" in line]
    assert bool(warnings) == said
    assert all("rigid_body" in line and "check that value and its known_to" in line for line in warnings)


def test_a_value_that_moved_is_not_said_to_be_what_was_assumed():
    truth = with_links(arm(2), known_to=0.05)
    wrong = heavier(truth, 1.1)  # two standard deviations
    noisy = campaign(truth, planted(truth), 3, noise=0.2)
    for name, e in identify(Campaign.of(wrong, list(noisy.recordings()))).fit["parameters"].items():
        if "what was assumed" in e.get("note", "") and name.startswith("rigid_body.mass"):
            assert e["value"] == pytest.approx(wrong.links[int(name[-2]) - 1].mass_kg, rel=0.5 * 0.05)


def test_what_is_known_exactly_does_not_move_and_says_so():
    a = with_links(arm(2), known_to=0.0)
    wrong = heavier(a, 1.1)
    model = identify(Campaign.of(wrong, list(campaign(a, planted(a), noise=0.01).recordings())))
    assert model.loads.terms["rigid_body"] == start(wrong).terms["rigid_body"]
    rigid = {name: e for name, e in model.fit["parameters"].items() if name.startswith("rigid_body")}
    assert {e["note"] for e in rigid.values()} == {"known exactly beforehand"}
    assert all(e["ci95"] == [e["value"], e["value"]] for e in rigid.values())


@pytest.mark.parametrize("changes", [{"mass_kg": 0.0}, {"inertia_kg_m2": 0.0}, {"mass_kg": 0.0, "inertia_kg_m2": 0.0}], ids=str)
def test_arms_whose_mass_or_inertia_is_not_in_the_torque_are_fitted(changes):
    a = with_links(arm(2), **changes)
    np.testing.assert_allclose(values(identify(campaign(a, planted(a)))), values(planted(a)), rtol=EXACT, atol=EXACT)


def test_a_dry_arm_has_masses_to_calibrate_and_no_water():
    a = arm(2, density=0.0)
    model = identify(campaign(a, dry(a)), "rigid")
    assert list(model.loads.terms) == ["rigid_body"]
    np.testing.assert_allclose(values(model), values(dry(a)), rtol=EXACT)


def test_what_the_motions_do_not_excite_keeps_its_prior_and_says_so():
    a = arm(2)
    model = identify(Campaign.of(a, [], (steady_table(a, planted(a)),)))  # locked tows know nothing of added mass
    estimates = model.fit["parameters"]
    for j in (1, 2):
        assert "do not excite it" in estimates[f"added_mass.C_M[{j}]"]["note"]
        assert estimates[f"added_mass.C_M[{j}]"]["value"] == pytest.approx(0.8)
        assert np.ptp(estimates[f"added_mass.C_M[{j}]"]["ci95"]) > 2.0
        assert estimates[f"normal_drag.C_D[{j}]"].get("note", "") == ""
        assert estimates[f"normal_drag.C_D[{j}]"]["value"] == pytest.approx(planted(a).terms["normal_drag"].C_D[j - 1], rel=1e-6)


def test_a_coefficient_beyond_what_physics_allows_stops_at_its_bound_and_says_so():
    a = arm(1)
    model = identify(campaign(a, planted(a).plus("more", NormalDrag((-2.0,)))))
    assert model.loads.terms["normal_drag"].C_D == (0.0,)
    assert "bound" in model.fit["parameters"]["normal_drag.C_D[1]"]["note"]
    ceiling = identify(campaign(a, planted(a, C_M=(9.0,))))
    assert ceiling.loads.terms["added_mass"].C_M[0] == pytest.approx(5.0)


def test_models_that_have_nothing_to_fit_stay_what_they_are():
    a = arm(2)
    for name in ("textbook", "drag-only"):
        model = identify(campaign(a, planted(a)), name)
        assert model.loads == BASELINES[name].start(a)
        assert "parameters" not in model.fit


def test_the_order_of_recordings_changes_nothing():
    a = arm(2)
    whole = campaign(a, planted(a), 5, noise=0.05)
    turned = Campaign.of(a, list(whole.recordings())[::-1])
    np.testing.assert_allclose(values(identify(turned)), values(identify(whole)), rtol=1e-9, atol=1e-9)


def test_intervals_hold_the_truth_and_widen_with_the_noise():
    a = arm(2)
    widths = []
    for noise in (0.003, 0.03):
        estimates = identify(campaign(a, planted(a), 8, noise=noise)).fit["parameters"]
        found = [estimates[f"{name}[{j}]"] for name in ("normal_drag.C_D", "added_mass.C_M") for j in (1, 2)]
        truth = [*planted(a).terms["normal_drag"].C_D, *planted(a).terms["added_mass"].C_M]
        assert all(abs(e["value"] - x) < 2 * np.ptp(e["ci95"]) for e, x in zip(found, truth, strict=True))
        widths.append([np.ptp(e["ci95"]) for e in found])
    assert (np.array(widths[1]) > 2 * np.array(widths[0])).all()


@pytest.mark.parametrize("count", [1, 2])
def test_few_recordings_still_get_finite_intervals(count):
    a = arm(1)
    estimates = identify(campaign(a, planted(a), count, noise=0.02)).fit["parameters"]
    for e in estimates.values():
        assert np.isfinite([e["value"], *e["ci95"]]).all()
        assert e["ci95"][0] <= e["value"] <= e["ci95"][1]


def test_inertial_directions_are_the_derivatives_of_mass_moment_and_inertia():
    a = arm(2)
    F = inertial_directions(a)
    assert F.shape == (6, 6)
    m, c, k = a.links[0].mass_kg, a.links[0].com_m, a.links[0].known_to
    np.testing.assert_allclose(F[[0, 2, 4], 0], k * m * np.array([1.0, c, c**2]))
    np.testing.assert_allclose(F[[0, 2, 4], 1], k * c * np.array([0.0, m, 2 * m * c]))


def test_no_usable_recording_is_an_error_that_says_where_to_look():
    a = arm(1)
    whole = with_torque(campaign(a, planted(a), 2), lambda name, tau: tau * np.nan)
    with pytest.raises(CampaignError, match="nnhydro check"):
        identify(whole)


def test_an_unknown_baseline_is_refused_with_the_names():
    with pytest.raises(ConfigError, match="drag-only"):
        identify(campaign(arm(1), planted(arm(1)), 1), "no-such")


@pytest.mark.slow
def test_ninety_five_per_cent_intervals_hold_the_truth_about_as_often():
    a, inside = with_links(arm(1), known_to=0.0), []
    clean = campaign(a, planted(a), 12, seconds=2.0, rate=50.0)
    truth = values(planted(a))[3:]
    loads = start(a)
    for seed in range(60):
        rng = np.random.default_rng(seed)
        noisy = with_torque(clean, lambda name, tau, rng=rng: tau + 0.05 * tau.std() * rng.standard_normal(tau.shape))
        blocks = [of_segment(loads, s, a) for name in noisy.names for s in noisy.segments(name, GIVEN)]
        before = prior(loads, a)
        solution = fit(total(blocks), before, np.ones(1))
        low, high = np.quantile(bootstrap(blocks, before, solution.weight, 200, seed), [0.025, 0.975], axis=0)[:, 3:]
        inside.append((low <= truth) & (truth <= high))
    assert 0.85 <= np.mean(inside) <= 1.0


def test_a_recording_without_a_finite_stretch_is_left_out_of_the_fit():
    a = arm(1)
    good = campaign(a, planted(a), 3)
    bad = replace(recording(a, planted(a), "bad", seed=9), tau=np.full((400, 1), np.nan))
    model = identify(Campaign.of(a, [*good.recordings(), bad]))
    assert model.fit["recordings"] == 3
    np.testing.assert_allclose(values(model), values(planted(a)), rtol=EXACT)


def noted(theta, sd, bounds=(0.2, 2.5), mean=1.1, known=1.0):
    """The note on one drag coefficient."""
    loads = Loads({"drag": NormalDrag((theta,))})
    told = Solution(np.array([theta]), np.array([[sd**2]]), np.ones(1), np.ones(1), np.zeros(1, dtype=bool), 1.0)
    before = Prior(np.array([mean]), np.array([[known]]), np.array([-9.0]), np.array([9.0]))
    return _notes(loads, told, before)[0]


def test_notes_say_what_must_not_be_taken_at_face_value():
    low, high = NormalDrag((1.0,)).linear_bounds()[0]
    assert noted(1.0, 0.1) == ""
    assert noted(low, 0.1) == noted(high, 0.1) == "ended on its bound: another cause may be hiding here"
    assert noted(low + 1e-6, 0.1) == noted(high - 1e-6, 0.1) == ""
    assert noted(1.2, 0.71).endswith("the value is what was assumed")
    assert noted(1.2, 0.69) == ""
    assert noted(1.59, 0.71).endswith("the value is what was assumed")
    assert noted(1.61, 0.71).endswith("it moved within its uncertainty")
    assert noted(1.11, 0.01, known=0.01).endswith("it moved within its uncertainty")
    assert noted(1.2, 0.01, known=0.01).endswith("it moved 10 times its uncertainty")
    assert noted(1.0, 0.1, known=0.0) == "known exactly beforehand"


def test_two_recordings_have_gaussian_intervals_and_three_are_resampled():
    a = arm(1)
    loads = Loads({"drag": NormalDrag((1.0,))})
    rng = np.random.default_rng(1)
    blocks = []
    for _ in range(3):
        X = rng.standard_normal((100, 1, 1))
        blocks.append(block(X, X[..., 0] + 0.3 * rng.standard_normal((100, 1))))
    before = prior(loads, a)
    told = solve(total(blocks[:2]), before, np.array([1 / 0.09]))
    (one,) = estimates(loads, told, blocks[:2], before, 0)
    sd = np.sqrt(told.covariance[0, 0])
    assert one.ci95 == pytest.approx((told.theta[0] - 1.96 * sd, told.theta[0] + 1.96 * sd))
    (many,) = estimates(loads, solve(total(blocks), before, np.array([1 / 0.09])), blocks, before, 0)
    assert 0.2 < (many.ci95[1] - many.ci95[0]) / (one.ci95[1] - one.ci95[0]) < 1.5
    assert one.document() == {"value": one.value, "unit": "1", "ci95": list(one.ci95)}
