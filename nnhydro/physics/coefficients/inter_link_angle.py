"""How the angle between a link and its inboard neighbour changes its coefficients: a link folded back lies in the other's wake.

    g = 1 - amplitude p(h/D) ((1 - cos q_i) / 2)^2           for the links i > 1, 1 for the first             [-]

    q_i  angle from link i - 1 to link i: 0 stretched (g = 1), pi folded back (full effect)                    [rad]
    p    proximity of the planes, parallel_distance.py

Rivera (1995), section 3.1, lets the planar angle and the parallel distance act on drag and inertia coefficients [R] but no
formula and no number survives: form and amplitude are ours, the amplitude is to be identified. For scale: the rear one of two cylinders in
tandem keeps about a fifth to a third of its drag a few diameters apart, 0.6 to 0.7 beyond 8 (from general knowledge, not checked); its drag
jumps at a critical spacing: Zdravkovich (1977), abstract at https://scribd.com/document/519512388/Cylinder-drag1.
"""

from dataclasses import dataclass
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.coefficients.law import Law, StripState
from nnhydro.physics.coefficients.parallel_distance import proximity


@final
@dataclass(frozen=True)
class InterLinkAngle(Law):
    """Shielding of the outer links when folded back; even in the angle, so that the mirrored arm has the mirrored load."""

    kind: ClassVar[str] = "inter_link_angle"
    amplitude: float = 0.3

    def drag(self, state: StripState) -> Tensor:
        """Return 1 - amplitude p ((1 - cos q)/2)^2, (n, links, 1)."""
        return 1 - self.amplitude * proximity(state.h_over_D) * ((1 - torch.cos(state.bend)) / 2) ** 2

    def added_mass(self, state: StripState) -> Tensor:
        """Return the same."""
        return self.drag(state)
