"""The perceptron is the document's, its torques obey the mirror exactly, vanish at rest and stay within their bound."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from torch.func import grad, jacrev
from untrained import random_ensemble

from nnhydro.models.learned.network import Ensemble, odd_output, soft_bound

GOLDEN = json.loads((Path(__file__).parents[3] / "golden" / "network.json").read_text())
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
