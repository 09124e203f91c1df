"""Coefficients that explain the torque where no water could have them: a length in other units, a torque in other units.

    theta_free = argmin |y - Y theta|^2,   theta_possible: the same within the physical bounds

Reported where |y - Y theta_possible| > MOST_LEFT |tau| and |y - Y theta_free| < MOST_LEFT |y - Y theta_possible|: possible coefficients
leave much of the torque, free ones little of that. Beside an omitted effect that hides in a coefficient of the wrong sign, possible ones
leave less.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from nnhydro.diagnosis.problem.design import Design
from nnhydro.models.stated_terms import stated_values
from nnhydro.physics.loads.rigid_body import RigidBody

Array = NDArray[np.float64]
MOST_LEFT = 1 / 3  # share of the torque that the best physically possible coefficients may leave before they are called impossible


def impossible_coefficients(design: Design) -> list[str]:
    """Return a sentence on the coefficients beyond their physical bounds if, with such values, most of the torque is explained."""
    base = design.baseline
    if not base.is_physics or design.undriven or not design.Y.shape[2]:
        return []
    Y, y = design.Y.reshape(-1, design.Y.shape[2]), design.y.ravel()
    free, torque = np.linalg.lstsq(Y, y, rcond=None)[0], float(np.linalg.norm(design.tau))
    possible = lsq_linear(Y, y, (base.prior.lowest, base.prior.highest)).x
    left = float(np.linalg.norm(y - Y @ possible))
    if left <= MOST_LEFT * torque or np.linalg.norm(y - Y @ free) >= MOST_LEFT * left:
        return []
    theta, stated = base.prior.mean + base.prior.F @ free, stated_values(base.physics.arm)
    said: dict[tuple[float, float], list[str]] = {}
    for (name, term, label, _, (lowest, highest)), value in zip(base.physics.loads.linear_parameters(), theta.tolist(), strict=True):
        if not isinstance(term, RigidBody) and name not in stated and not lowest <= value <= highest:
            said.setdefault((lowest, highest), []).append(f"{name}.{label} = {value:.3g}")
    if not said:
        return []
    values = "; ".join(f"{', '.join(some)}, but {'it' if len(some) == 1 else 'they'} can only lie between {low:g} and {high:g}"
                       for (low, high), some in said.items())
    return [f"Most of the torque would be explained with {values}: check the lengths, diameters and density of arm.yaml, and the unit of "
            "the torque"]
