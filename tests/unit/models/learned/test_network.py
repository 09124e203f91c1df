"""The perceptron is the document's, its torques obey the mirror exactly, vanish at rest and stay within their bound."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted
from rigs import arm, at_rest, mirrored_about_Y, run, states
from torch.func import grad, jacrev

from nnhydro.features.body_columns import body_columns
from nnhydro.features.feature_set import feature_sets, features
from nnhydro.features.strip_law.law import law_columns
from nnhydro.features.strip_law.neurons import directions
from nnhydro.features.strip_law.state import StripView, state_sets, strip_states
from nnhydro.fitting.config import TrainingConfig
from nnhydro.models.learned.learned import LEFT_OUT, WIDENING, LearnedTorque, swiftness, view_of
from nnhydro.models.learned.linear_parts import StripLaw
from nnhydro.models.learned.network import Ensemble, odd_output, soft_bound
from nnhydro.models.learned.shrinkage import jackknife, shrink
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow

GOLDEN = json.loads((Path(__file__).parents[3] / "golden" / "network.json").read_text())
DEFAULTS = TrainingConfig()
EXACT = {"rtol": 1e-12, "atol": 1e-12}


def t(x):
    return torch.tensor(x, dtype=torch.float64)


def of_document(nets):
    """Networks in the document's form (offset weights in the last column) as one ensemble, a member each."""
    widest = max(len(net["W1"]) for net in nets)

    def wider(W, rows, columns):  # a neuron without weights changes nothing
        return torch.nn.functional.pad(W, (0, columns - W.shape[1], 0, rows - W.shape[0]))

    W1 = torch.stack([wider(t(net["W1"]).T, len(net["W1"][0]), widest) for net in nets])
    hidden = [t(net["W2"]).T[:-1] for net in nets]
    offsets = torch.stack([t(net["W2"]).T[-1:] for net in nets])
    W2 = torch.cat([torch.stack([wider(W, widest, W.shape[1]) for W in hidden]), offsets], dim=1)
    return Ensemble((W1[:, :-1], W2[:, :-1]), (W1[:, -1:], W2[:, -1:]), W2.shape[2])


def z_hat(ensemble, V):
    """Outputs (outputs,) of an ensemble of one for one input."""
    return ensemble(V[None])[0, 0]


@pytest.mark.parametrize("case", GOLDEN["common_middle_layer"], ids=lambda case: f"{len(case['W1'])} hidden")
def test_a_common_middle_layer_gives_the_golden_torques_and_gains(case):
    net = of_document([case])
    for sample in case["samples"]:
        V = t(sample["V"])
        torch.testing.assert_close(z_hat(net, V), t(sample["z_hat"]), **EXACT)
        torch.testing.assert_close(jacrev(lambda v: z_hat(net, v))(V), t(sample["gain_matrix_dzhat_dV"]), **EXACT)


@pytest.mark.parametrize("case", GOLDEN["common_middle_layer"], ids=lambda case: f"{len(case['W1'])} hidden")
def test_its_gradients_are_the_golden_ones(case):
    net = of_document([case])
    for sample in case["samples"]:
        def loss(tensors, sample=sample):
            return 0.5 * ((z_hat(net.with_tensors(tensors), t(sample["V"])) - t(sample["z_target"])) ** 2).sum()

        torch.testing.assert_close(loss(net.tensors()), t(sample["half_squared_error"]), **EXACT)
        w1, w2, c1, c2 = grad(loss)(net.tensors())
        for weight, offset, golden in ((w1, c1, "grad_W1"), (w2, c2, "grad_W2")):
            torch.testing.assert_close(torch.cat([weight[0].T, offset[0].T], dim=1), t(sample[golden]), rtol=1e-11, atol=1e-12)


def test_a_golden_step_down_the_gradient_gives_the_golden_weights():
    case, step = GOLDEN["common_middle_layer"][0], GOLDEN["gradient_step_on_case0_sample0"]
    sample, eta = case["samples"][0], step["eta"]
    for key in ("W1", "W2"):
        np.testing.assert_allclose(np.array(case[key]) - eta * np.array(sample[f"grad_{key}"]), step[f"{key}_new"], rtol=1e-12)
    after = of_document([{"W1": step["W1_new"], "W2": step["W2_new"]}])
    torch.testing.assert_close(z_hat(after, t(sample["V"])), t(step["z_hat_after"]), **EXACT)


@pytest.mark.parametrize("case", GOLDEN["parallel_middle_layers"], ids=lambda case: f"{len(case['V'])} inputs")
def test_parallel_middle_layers_are_nets_side_by_side(case):
    stacks = of_document(case["nets"])  # one a torque, each with a hidden layer of its own
    net = Ensemble(stacks.weights, stacks.offsets, len(case["nets"]))
    V = t(case["V"])
    assert net.members == 1
    torch.testing.assert_close(z_hat(net, V), t(case["z_hat"]), **EXACT)
    torch.testing.assert_close(jacrev(lambda v: z_hat(net, v))(V), t(case["gain_matrix_dzhat_dV"]), **EXACT)


LAYERS = pytest.mark.parametrize("parallel", [False, True], ids=["common", "parallel"])


@LAYERS
@pytest.mark.parametrize("hidden", [(5,), (4, 3), (3,) * 7], ids=len)
def test_an_ensemble_of_any_depth_knows_its_layout(parallel, hidden):
    net = random_ensemble((6, *hidden, 2), parallel=parallel)
    assert (net.members, net.hidden, net.outputs) == (3, hidden, 2)
    assert net(t(np.ones((4, 6)))).shape == (3, 4, 2)
    factor = t([[[2.0, 3.0]], [[1.0, 0.0]], [[-1.0, 5.0]]])
    x = t(np.random.default_rng(2).standard_normal((4, 6)))
    torch.testing.assert_close(net.times(factor)(x), net(x) * factor, **EXACT)


def test_with_parallel_layers_one_torques_weights_do_not_touch_the_other():
    net, x = random_ensemble((4, 5, 5, 2), parallel=True), t(np.random.default_rng(1).standard_normal((10, 4)))
    first = [w.clone() for w in net.tensors()]
    for w in first:
        w[1::2] += 1.0  # the second torque's stacks
    other = net.with_tensors(first)
    assert torch.equal(other(x)[..., 0], net(x)[..., 0])
    assert float((other(x)[..., 1] - net(x)[..., 1]).abs().min()) > 0


def random_ensemble(sizes, members=3, seed=1, parallel=False):
    g = torch.Generator().manual_seed(seed)
    layout = Ensemble.fresh(sizes, members, seed, parallel)
    return layout.with_tensors([torch.randn(w.shape, generator=g, dtype=torch.float64) for w in layout.tensors()])


def test_members_of_an_ensemble_do_not_mix():
    sizes, x = (5, 7, 6, 2), t(np.random.default_rng(1).standard_normal((10, 5)))
    whole = random_ensemble(sizes)
    for member in range(3):
        alone = whole.with_tensors([w[member:member + 1] for w in whole.tensors()])
        torch.testing.assert_close(alone(x)[0], whole(x)[member], **EXACT)


def test_fresh_networks_give_zero_and_differ_inside():
    fresh = Ensemble.fresh((4, 8, 2), 2, seed=3)
    assert not fresh(torch.randn(5, 4)).any()
    assert not torch.equal(fresh.weights[0][0], fresh.weights[0][1])
    assert torch.equal(fresh.weights[0], Ensemble.fresh((4, 8, 2), 2, seed=3).weights[0])
    assert not torch.equal(fresh.weights[0], Ensemble.fresh((4, 8, 2), 2, seed=4).weights[0])


def test_the_bound_is_never_passed_and_outputs_up_to_half_of_it_pass_unchanged():
    y = torch.linspace(-1e3, 1e3, 1001, dtype=torch.float64)
    assert float(soft_bound(y, 2.0).abs().max()) <= 2.0
    assert torch.equal(soft_bound(y * 1e-3, 2.0), y * 1e-3)
    beyond = torch.tensor([0.999, 1.0, 1.001, 1.5, 5.0], dtype=torch.float64)
    slopes = torch.stack([grad(lambda v: soft_bound(v, 2.0))(value) for value in beyond])
    assert bool((slopes[1:] <= slopes[:-1] + 1e-12).all())
    assert float(slopes[2]) == pytest.approx(1.0, abs=1e-5)


@LAYERS
@pytest.mark.parametrize("parity", [(-1, -1, 1, 1), (1, -1, 1, -1), (-1, -1, -1, -1), (1, 1, 1, 1)], ids=str)
def test_the_mirrored_net_is_odd_half_of_what_it_says_here_and_in_the_mirror(parity, parallel):
    parity, net = t(parity), random_ensemble((4, 9, 5, 2), parallel=parallel)
    x = t(np.random.default_rng(1).standard_normal((20, 4)))
    torch.testing.assert_close(odd_output(net, x, parity), (net(x) - net(x * parity)) / 2, **EXACT)
    torch.testing.assert_close(odd_output(net, x * parity, parity), -odd_output(net, x, parity), **EXACT)
    own = torch.stack([x, x + 1.0, x - 1.0])  # a member each
    torch.testing.assert_close(odd_output(net, own, parity), (net(own) - net(own * parity)) / 2, **EXACT)


def random_law(a, shown, names=DEFAULTS.law, members=3, seed=1):
    """A law of the strips with random coefficients; the range of its variables is that of the motion `shown`."""
    g = torch.Generator().manual_seed(seed)
    z, of_three = strip_states(StripView(Flow(a, shown)), names)
    body = torch.randn(members, body_columns(Flow(a, shown)).shape[2], generator=g, dtype=torch.float64)
    count = law_columns(StripView(Flow(a, shown)), z, of_three).shape[2]
    coefficients = torch.randn(members, count, generator=g, dtype=torch.float64)
    return StripLaw(tuple(names), z.amin(dim=(0, 1, 3)), z.amax(dim=(0, 1, 3)), coefficients, body, directions())


def learned(a, hybrid, bound=2.0, seed=1, names=DEFAULTS.features, law=DEFAULTS.law, hidden=(8,), parallel=False):
    """A model with random weights; the range of its inputs is that of random states."""
    floor = torch.full((a.n_links,), 0.2, dtype=torch.float64)
    shown = states(a.n_links, 200, seed=9)
    x = features(view_of(a, shown, floor), names)
    parity, joined = x.parity(), x.matrix()
    centre = torch.where(parity < 0, 0.0, joined.mean(0))
    spread = (joined - centre).pow(2).mean(0).sqrt() + 1e-6
    reach = ((joined - centre) / spread).abs().amax(0)
    ensemble = random_ensemble((len(parity), *hidden, a.n_links), seed=seed, parallel=parallel)
    base = StripTheory(a, GIVEN, {}, "constant", planted(a)) if hybrid else None
    skip = torch.randn(3, len(parity), a.n_links, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    swiftest, fit = swiftness(Flow(a, shown)).amax(0), {LEFT_OUT: 1 / 3}
    return LearnedTorque(a, GIVEN, fit, names, bound, floor, centre, spread, parity, -reach, reach, swiftest,
                         skip * (parity < 0)[:, None], ensemble, base, random_law(a, shown, law))


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


@pytest.mark.parametrize("name", state_sets())
@pytest.mark.parametrize("links", [1, 2, 3])
def test_the_mirror_is_exact_for_every_law_of_the_strips(name, links):
    a = arm(links)
    for motion in (states(links), run(links)):
        law = random_law(a, motion, (name,))
        one, other = law.torque(Flow(a, motion)), law.torque(Flow(a, mirrored_about_Y(motion)))
        scale = float(one.abs().max())
        torch.testing.assert_close(other / scale, -one / scale, rtol=0.0, atol=1e-11)
    assert not law.torque(Flow(a, at_rest(links))).any()


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
