"""Whether the torque of a model grows with the acceleration at the states that it was trained on, as that of a mass does.

    least effective inertia    least eigenvalue of (M + M')/2, M the mass matrix over the accelerations of training      [kg m^2]
    local                      the same of d tau / d qdd at the recorded acceleration, and on both sides of rest

A negative local value makes forward dynamics ambiguous there; a controller that uses M needs the effective one to be positive.
"""

from dataclasses import asdict, dataclass
from typing import Any, final

import torch

from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.dynamics.inertia import least_inertia, least_slope
from nnhydro.errors import ModelError, count_text
from nnhydro.models.domain import DOMAIN, Domain
from nnhydro.models.torque_model import TorqueModel


@final
@dataclass(frozen=True)
class InertiaCheck:
    """How many of the recorded states have a mass matrix that is not positive definite, and the least inertia of all."""

    states: int
    indefinite: int  # of the mass matrix
    ambiguous: int  # of the local slopes
    least_kg_m2: float

    def document(self) -> dict[str, Any]:
        """Return the counts as JSON holds them."""
        return asdict(self)

    def sentence(self) -> str:
        """Return what was found and what to do, in one line."""
        least = f"the least effective inertia is {self.least_kg_m2:.3g} kg m²"
        if self.indefinite:
            text = f"The mass matrix is not positive definite at {self.indefinite} of {count_text(self.states, 'recorded state')}: {least}."
        else:
            text = f"The mass matrix is positive definite at all {self.states} recorded states; {least}."
        if not self.ambiguous:
            return text
        return (f"{text} At {self.ambiguous} the torque falls as a small acceleration grows: forward dynamics may have several answers "
                "there, use a physics model for it.")


def inertia_check(model: TorqueModel) -> InertiaCheck | None:
    """Return the check of `model` at the states of its record; None where it has none, or cannot be stepped."""
    domain = Domain.parse(model.fit.get(DOMAIN))
    if domain is None:
        return None
    try:
        dynamics = Dynamics(model)
    except ModelError:
        return None
    at = domain.states(model.arm)
    with torch.no_grad():
        least = least_inertia(dynamics.mass_matrix(at.q, at.qd, u0=at.u0))
        local = least if dynamics.affine else least_slope(dynamics.torque_over(at), at.qdd, torch.inf)
    return InertiaCheck(len(at), int((least <= 0).sum()), int((local <= 0).sum()), float(least.min()))
