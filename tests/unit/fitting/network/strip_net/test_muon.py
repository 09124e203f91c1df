"""Orthogonal steps of matrices."""

import pytest
import torch

from nnhydro.fitting.network.strip_net.muon import Muon, orthogonal


@pytest.mark.parametrize("shape", [(5, 5), (4, 9), (9, 4)])
def test_a_gradient_keeps_its_singular_vectors_and_gets_singular_values_of_about_one(shape):
    g = torch.randn(shape, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    U, _, Vh = torch.linalg.svd(g, full_matrices=False)
    along = U.T @ orthogonal(g) @ Vh.T
    assert float((along - torch.diag(along.diagonal())).abs().max()) < 1e-10
    assert 0.6 < float(along.diagonal().min()) <= float(along.diagonal().max()) < 1.3


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e9])
def test_a_step_does_not_depend_on_the_size_of_the_gradient(scale):
    g = torch.randn(3, 7, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    torch.testing.assert_close(orthogonal(scale * g), orthogonal(g))


def test_without_a_gradient_a_matrix_only_decays():
    w = torch.ones(3, 2)
    Muon([w]).step([w], [torch.zeros(3, 2)], rate=0.1, decay=0.5)
    torch.testing.assert_close(w, torch.full((3, 2), 0.95))


def test_all_directions_are_learned_however_unlike_their_curvatures():
    torch.manual_seed(0)
    sizes = torch.tensor([100.0, 1.0, 0.01])
    goal, w = torch.randn(3, 3), torch.zeros(3, 3)
    muon = Muon([w])
    for k in range(300):
        muon.step([w], [2 * sizes[:, None] * (w - goal)], rate=0.1 * (1 - k / 300), decay=0.0)
    assert float((w - goal).abs().max()) < 0.02
