"""Coefficients in oscillating motion against the Keulegan-Carpenter number KC = 2 pi a / D, a the amplitude.

    g_D = C_D(KC) / C_D(steady),    g_M = C_M(KC) / C_M(0),    linear between the entries

C_D / C_D,steady of a smooth cylinder: 0.4 at KC 5 to 1.25 at 20 and 1.0 at 60; rough: 0.8 at 5, 1.4 at 15, then as smooth:
API RP 2A-WSD 22nd, B.5.3.1.2.8 [READ]. Below KC = 5 the first entry is kept (ours).
C_M: API gives Morison's coefficient 1 + C_M = 2.0 for K <= 3, then falling to 1.6 smooth, 1.2 rough at K / C_D,s >= 17 [READ];
here the added mass alone, C_M = 1 and 0.6 (smooth), 0.2 (rough), with C_D,s = 1.17 smooth and 1.08 rough taken for the end of the fall
(ours). API's K = 2 U T2 / D with the half-cycle T2 equals KC for a sine.
Morison with constant coefficients fits any one half-cycle; the best values change from half-cycle to half-cycle (API B.5.3.1.2.8.1
[READ]). A steady current with V/Um > 0.4 restores the steady C_D [READ]: do not use this law in tows.
"""

from dataclasses import dataclass
from typing import ClassVar, final

from torch import Tensor

from nnhydro.physics.coefficients.law import Law, StripState
from nnhydro.physics.coefficients.table import interpolate

DRAG_SMOOTH = ((5.0, 0.4), (10.0, 0.78), (15.0, 1.07), (20.0, 1.25), (30.0, 1.18), (40.0, 1.10), (50.0, 1.03), (60.0, 1.0))
DRAG_ROUGH = ((5.0, 0.8), (10.0, 1.3), (15.0, 1.4), (20.0, 1.25), (30.0, 1.18), (40.0, 1.10), (50.0, 1.03), (60.0, 1.0))
ADDED_MASS_SMOOTH = ((3.0, 1.0), (17.0 * 1.17, 0.6))
ADDED_MASS_ROUGH = ((3.0, 1.0), (17.0 * 1.08, 0.2))


def drag_ratio(KC: Tensor, rough: bool = False) -> Tensor:
    """Return C_D(KC) / C_D(steady); an infinite KC gives 1."""
    at, values = zip(*(DRAG_ROUGH if rough else DRAG_SMOOTH), strict=True)
    return interpolate(KC, at, values)


def added_mass_coefficient(KC: Tensor, rough: bool = False) -> Tensor:
    """Return C_M(KC), 1 for small KC."""
    at, values = zip(*(ADDED_MASS_ROUGH if rough else ADDED_MASS_SMOOTH), strict=True)
    return interpolate(KC, at, values)


@final
@dataclass(frozen=True)
class KeuleganCarpenter(Law):
    """C_D(KC) and C_M(KC); `rough` 1 takes the values of rough cylinders. Use it on constants, not on travel curves: both count travel."""

    kind: ClassVar[str] = "keulegan_carpenter"
    rough: float = 0.0

    def drag(self, state: StripState) -> Tensor:
        """Return C_D(KC) / C_D(steady), (n, links, s)."""
        return drag_ratio(state.KC, bool(self.rough))

    def added_mass(self, state: StripState) -> Tensor:
        """Return C_M(KC), (n, links, s)."""
        return added_mass_coefficient(state.KC, bool(self.rough))
