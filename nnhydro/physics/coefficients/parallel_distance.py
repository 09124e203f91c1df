"""How the distance between the links' parallel planes changes both coefficients.

    g = 1 + amplitude p(h/D)

    p   proximity: 1 where the links touch (h/D <= 1), 0.5 at 2, 0 from 3.5 on, linear between                [-]
    h   distance of the planes in which the links move [m]

Side by side, cylinders whose centres are more than 3.5 diameters apart do not interact, from 2 to 3.5 they shed in antiphase, below 2 they
interact strongly (Zdravkovich as quoted by Rivera 1995 [R], physics of the interference regimes). The sizes between these bounds and the
amplitude are ours: h is constant on one rig, so the amplitude can only be identified from rigs of different spacing. Default 0.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from torch import Tensor

from nnhydro.physics.coefficients.law import Law, StripState
from nnhydro.physics.coefficients.table import interpolate

PROXIMITY = ((1.0, 1.0), (2.0, 0.5), (3.5, 0.0))


def proximity(h_over_D: Tensor) -> Tensor:
    """Return p(h/D) between 1 (touching) and 0 (apart)."""
    at, values = zip(*PROXIMITY, strict=True)
    return interpolate(h_over_D, at, values)


@final
@dataclass(frozen=True)
class ParallelDistance(Law):
    """The same change of C_D and C_M on every link, fading with the distance of the planes."""

    kind: ClassVar[str] = "parallel_distance"
    amplitude: float = 0.0

    def drag(self, state: StripState) -> Tensor:
        """Return 1 + amplitude p(h/D), (links, 1)."""
        return 1 + self.amplitude * proximity(state.h_over_D)

    def added_mass(self, state: StripState) -> Tensor:
        """Return the same."""
        return self.drag(state)
