"""The hum of vortices: the drag of a link times a wave that runs with the way through the water, twice a shed pair."""

import numpy as np
import pytest
import torch
from hypotheses import made
from rigs import LINKS, arm

from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor

L, D = LINKS[0]["length_m"], LINKS[0]["diameter_m"]


@pytest.mark.parametrize("cell", [0.0, 5.0])
@pytest.mark.parametrize("faster", [0.0, 0.4])
def test_a_link_towed_broadside_hums_at_twice_the_strouhal_frequency_of_its_speed(faster, cell):
    """tau = rho D u^2 L^2 / 4 (a cos psi + b sin psi), psi = 4 pi St / D int u dt: all of the link moves at u."""
    t = np.arange(400) / 200
    u, way, still = 0.3 + faster * t, 0.3 * t + faster * t**2 / 2, torch.zeros(400, 1, dtype=torch.float64)
    hum = made("vortex_shedding", arm(1), cosine=(0.5,), sine=(-0.2,), strouhal=(0.21,), cell=(cell,))
    tau = hum.torque(Flow(arm(1), Motion(tensor(t), still, still, still, tensor(u), tensor(np.full(400, faster)))))
    psi, drag = 4 * np.pi * 0.21 * way / D, arm(1).fluid.density_kg_m3 * D * u**2 * L**2 / 4
    np.testing.assert_allclose(tau[:, 0], drag * (0.5 * np.cos(psi) - 0.2 * np.sin(psi)), atol=1e-3 * drag.max())
