"""Every choice of the discrete-vortex simulation, in one place.

No number is fitted to a measured force. `core` and `offset` were taken where the curves depend least on the step; between the two flux
rules measured trends decided (see separation.py). Those that move the curves most are `sample_ahead`, `survival`, `offset` and
`reversed_flow`; training/vortex_wake/results.json lists by how much.
"""

from dataclasses import dataclass, fields
from typing import final

from nnhydro.errors import require

# Travel, in diameters, at which the wall shear first vanishes at the rear of a cylinder under constant acceleration: first-order
# boundary-layer series tau_w ~ 1 + 0.4261 t^2 dV/dx with V = 2 a sin(x/c), so s/D = 1/(8 * 0.4261); Blasius 1908, Z. Math. Phys. 56.
SEPARATION_ONSET = 0.29334


@final
@dataclass(frozen=True)
class WakeChoices:
    """Choices of the simulation; lengths in diameters, angles in degrees. Raises ConfigError for a value out of range."""

    step: float = 0.02  # travel a step; vortices shed 0.03 D apart overlap with the core below
    core: float = 0.08  # smoothing radius delta of vortex on vortex, 1/(r^2 + delta^2) after Krasny 1986; images stay sharp
    offset: float = 0.05  # height of a nascent vortex above the surface: stands for the boundary layer's thickness
    separation_onset: float = SEPARATION_ONSET  # s/D; separation at cos(theta) = - onset / (s/D), from the rear towards the shoulder
    sample_ahead: float = 6.0  # the flux is taken this far upstream of separation, clear of the nascent vortices' own field
    reversed_flow: bool = False  # True: subtract the opposite circulation U_r^2/2 that the reversed flow behind carries to separation
    survival: float = 1.0  # share of the shed circulation that survives three-dimensional breakdown; 1: all of it
    merge_distance: float = 0.03  # successive vortices closer than this are merged ...
    merge_beyond: float = 2.0  # ... once they are this far from the centre; keeps circulation and its centre
    remove_within: float = 0.001  # a vortex closer than this to the surface is absorbed: its image cancels it there
    kinematic_viscosity_m2_s: float = 0.0  # core^2 grows by 4 nu age (Lamb-Oseen); 0: curves depend on s/D only

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            require(value >= 0, f"{item.name} is {value}: it must be 0 or more")
        require(0 < self.step <= 0.1, f"step is {self.step} diameters: take one in (0, 0.1], 0.02 is usual")
        require(self.core > 0, "core is 0: point vortices without a core move chaotically; take 0.05 to 0.1")
        require(self.offset > self.remove_within, f"offset {self.offset} must exceed remove_within {self.remove_within}")
        require(self.separation_onset > 0, f"separation_onset is {self.separation_onset}: it must be positive, 0.293 is the theory")
        require(self.survival <= 1, f"survival is {self.survival}: a share, at most 1")
