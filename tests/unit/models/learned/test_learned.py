"""Networks and hybrids of any weights: mirror, rest, bounds, and the mean of the members."""

from dataclasses import replace

import pytest
import torch
from rigs import arm, at_rest, mirrored_about_Y, run, states
from torch.func import jacrev
from untrained import learned

from nnhydro.features.feature_set import feature_sets
from nnhydro.models.learned.learned import CAUTION, LEFT_OUT, WIDENING, view_of
from nnhydro.models.learned.shrinkage import jackknife, shrink

KINDS = pytest.mark.parametrize("hybrid", [False, True], ids=["network", "hybrid"])
LINKS = pytest.mark.parametrize("links", [1, 2, 3])


@KINDS
@LINKS
@pytest.mark.parametrize("make", [states, run])
@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_the_mirrored_motion_gives_the_mirrored_torque_for_any_weights(hybrid, links, make, gravity):
    model = learned(arm(links, gravity_m_s2=gravity), hybrid)
    one, other = model.torque(make(links)), model.torque(mirrored_about_Y(make(links)))
    scale = float(one.abs().max())
    torch.testing.assert_close(other / scale, -one / scale, rtol=0.0, atol=1e-11)  # sin(pi - q) is sin q to the last digit only


@pytest.mark.parametrize(("parallel", "hidden", "names"), [
    *((False, (5, 4, 3), (name,)) for name in feature_sets()), *((True, (6,), (name,)) for name in feature_sets()),
    (False, (6,), tuple(feature_sets())), (True, (5, 4, 3), tuple(feature_sets()))], ids=str)
def test_the_mirror_is_exact_for_every_architecture_and_feature_set(parallel, names, hidden):
    a = arm(2)
    model = learned(a, hybrid=False, names=names, law=(), hidden=hidden, parallel=parallel)
    for motion in (states(2), run(2)):
        one, other = model.torque(motion), model.torque(mirrored_about_Y(motion))
        scale = float(one.abs().max()) + 1e-300
        torch.testing.assert_close(other / scale, -one / scale, rtol=0.0, atol=1e-11)
    assert not model.torque(still_and_straight(2)).any()


def still_and_straight(links):
    """At rest with the links in line: nothing tells left from right, so no torque can have a sign."""
    motion = at_rest(links)
    motion.q[:, 1:] = 0.0
    return motion


@KINDS
@LINKS
def test_an_arm_at_rest_in_still_water_needs_no_torque_for_any_weights(hybrid, links):
    assert not learned(arm(links), hybrid).torque(still_and_straight(links)).any()


@KINDS
@LINKS
def test_the_correction_stays_within_its_bound_times_the_scale(hybrid, links):
    a = arm(links)
    model = learned(a, hybrid, bound=0.5)
    for motion in (states(links), run(links)):
        base = model.baseline.torque(motion) if model.baseline is not None else 0.0
        scale = view_of(a, motion, model.floor).scale
        assert bool(((model.torque(motion) - base).abs() <= 0.5 * scale + 1e-12).all())
        assert bool(((model.members(motion) - base).abs() <= 0.5 * scale + 1e-12).all())


@KINDS
def test_the_prediction_is_the_mean_of_the_members_of_a_hybrid_shrunk_towards_its_baseline(hybrid):
    model = learned(arm(2), hybrid)
    members = model.members(run(2))
    assert members.shape == (3, 60, 2)
    torch.testing.assert_close(model.std(run(2)), members.std(0))
    if model.baseline is None:
        torch.testing.assert_close(model.torque(run(2)), members.mean(0))
        return
    base, view = model.baseline.torque(run(2)), view_of(model.arm, run(2), model.floor)
    doubted = (1 + WIDENING * model.excess(view, model.standardised_features(view))) ** 2 * jackknife(members - base, model.fit[LEFT_OUT])
    torch.testing.assert_close(model.torque(run(2)) - base, shrink((members - base).mean(0), doubted, view.scale))
    assert bool(((model.torque(run(2)) - base).abs() <= (members - base).mean(0).abs() + 1e-12).all())


def test_the_less_caution_the_more_is_used_of_what_members_disagree_about():
    model, motion = learned(arm(2), True), run(2)
    base, mean = model.baseline.torque(motion), model.members(motion).mean(dim=0)
    used = [replace(model, fit={**model.fit, CAUTION: q}).torque(motion) - base for q in (1.0, 0.1, 0.0)]
    torch.testing.assert_close(used[0], model.torque(motion) - base)
    assert bool((used[1].abs() >= used[0].abs()).all())
    assert float((used[1] - used[0]).abs().max()) > 0
    torch.testing.assert_close(used[2], mean - base)


def test_beyond_what_it_has_seen_the_net_holds_its_inputs_at_the_edge():
    model = learned(arm(2), False)
    x = model.inputs(view_of(model.arm, states(2, seed=4), model.floor))
    assert bool(((x >= model.lowest) & (x <= model.highest)).all())


def test_torques_have_a_gradient_with_respect_to_every_state():
    model = learned(arm(2), True)

    def torque(q, qd, qdd):
        motion = states(2, 1)
        return model.torque(type(motion)(motion.t, q[None], qd[None], qdd[None], motion.u0, motion.du0, True))[0]

    m = states(2, 1)
    gains = jacrev(torque, argnums=(0, 1, 2))(m.q[0], m.qd[0], m.qdd[0])
    assert all(bool(torch.isfinite(g).all()) and g.abs().sum() > 0 for g in gains)
