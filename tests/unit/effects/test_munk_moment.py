"""The Munk moment in closed form."""

from math import pi

import numpy as np
from hypotheses import made
from rigs import LINKS, arm

from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion


def test_oblique_flow_turns_a_towed_link_by_the_product_of_the_speeds_along_it_and_across():
    """Munk: m' L u^2 sin q cos q; nothing along or across the flow, nor for a hub at rest."""
    a, q, u0 = arm(1), np.array([0.0, 0.4, -0.9, pi / 2]), 0.7
    none = np.zeros((4, 1))
    law = made("munk_moment", a, 0, share=(0.5,))
    got = law.torque(Flow(a, Motion.at(q[:, None], none, none, u0=np.full(4, u0))))[:, 0].numpy()
    mass = a.fluid.density_kg_m3 * pi * LINKS[0]["diameter_m"] ** 2 / 4 * LINKS[0]["length_m"]
    np.testing.assert_allclose(got, 0.5 * mass * u0**2 * np.sin(q) * np.cos(q), atol=1e-12)
    turning = Motion.at(q[:, None], none + 1.5, none + 2.0)
    assert float(law.torque(Flow(a, turning)).abs().max()) < 1e-12
