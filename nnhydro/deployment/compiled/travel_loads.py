"""The part of a model that depends on the travel of each strip, worked off by physics/travel/kernel.py."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any, Final, final

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.errors import ModelError, require
from nnhydro.physics.travel.term import TravelTerm
from nnhydro.physics.travel.travel import RUNNING_START, STILL
from nnhydro.recordings.arm import Arm

Array = NDArray[np.float64]
Kinematics = Callable[[int, int], Array]  # first row, last row + 1 -> (links, 5, rows + 1), column 0 free
POINTS: Final = 5  # of the curve in each piece, from which its polynomials are told


def _coefficients(curve: Callable[[torch.Tensor], torch.Tensor], end: float, pieces: int) -> tuple[float, ...]:
    """The coefficients in physics/travel/kernel.py of the cubic spline that is `curve` up to the travel `end`."""
    u, knots = (np.arange(pieces)[:, None] + np.linspace(0.0, 1.0, POINTS)).ravel() / pieces, np.arange(1, pieces)
    side = np.where(2 * knots <= pieces, -1.0, 1.0)
    ramps = np.clip(side * (u[:, None] - knots / pieces), 0.0, None) ** 3
    basis = np.concatenate([(u[:, None] - 0.5) ** np.arange(4), ramps], axis=1)
    solution = np.linalg.lstsq(basis, curve(torch.from_numpy(end * u)).numpy(), rcond=None)[0]
    return tuple(float(c) for c in solution)


@final
@dataclass(frozen=True, eq=False)
class TravelLoads:
    """The sum of `terms` for `arm`; raises ModelError where they cannot be put into one pass over the strips."""

    arm: Arm
    terms: Sequence[TravelTerm]

    def __post_init__(self) -> None:
        kinds = ", ".join(term.kind for term in self.terms)
        require(not any(term.laws for term in self.terms), f"{kinds}: coefficient laws are not compiled", ModelError)
        alike = {(term.pieces(), term.per_link, term.at_reversal, term.memory, term.dwell_s) for term in self.terms}
        require(len(alike) == 1, f"{kinds}: their travel scales, strips or rules differ, which is not compiled", ModelError)

    @cached_property
    def x(self) -> Array:  # (links, s) m
        """Distance of each strip's middle from the link's own joint."""
        count = self.terms[0].per_link
        return np.asarray(self.arm.L[:, None] * (np.arange(count) + 0.5) / count)

    @cached_property
    def curves(self) -> tuple[Any, Any]:
        """Coefficients of C_D and of C_M, one tuple a link."""
        end, pieces = self.terms[0].pieces()

        def curve(added_mass: bool, link: int) -> tuple[float, ...]:
            parts = [term for term in self.terms if term.added_mass == added_mass]
            return _coefficients(lambda s: sum((term.curve(s, link) for term in parts), start=torch.zeros_like(s)), end, pieces)

        links = range(self.arm.n_links)
        return tuple(curve(False, link) for link in links), tuple(curve(True, link) for link in links)

    @cached_property
    def constants(self) -> Array:  # (links, 3) 1/m, kg/m^2, kg/m
        """1 / (D tau_s), and the load of a strip for C_D = 1, w = 1 and for C_M = 1, dw = 1."""
        arm, (end, _) = self.arm, self.terms[0].pieces()
        ds, rho = arm.L / self.terms[0].per_link, arm.fluid.density_kg_m3
        return np.stack([1 / (arm.D * end), 0.5 * rho * arm.D * ds, rho * pi / 4 * arm.D**2 * ds], axis=1)

    @property
    def rule(self) -> tuple[bool, float | None, float | None]:
        """Whether a reversal keeps s, the memory in diameters where it fades, and the pause after which the water is at rest."""
        term = self.terms[0]
        return term.at_reversal == "keep", term.memory if term.at_reversal == "decay" else None, term.dwell_s or None

    def memory(self, t: Array, first: Array, peak: Callable[[], Array]) -> Array:
        """Return what the strips remember at first (links, s, 7); `first` (links, s) m/s are their speeds then, `peak` their greatest."""
        from nnhydro.physics.travel.kernel import MEMORY

        memory = np.zeros((*self.x.shape, MEMORY))
        memory[..., 6] = t[0]
        if (np.abs(first) > STILL).any():
            memory[..., 4] = np.abs(first) > np.maximum(RUNNING_START * peak(), STILL)
        return memory
