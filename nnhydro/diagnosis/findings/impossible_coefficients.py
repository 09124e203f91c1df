"""Coefficients that explain the torque where no water could have them: a length in other units, a torque in other units.

    theta_free = argmin |y - Y theta|^2,    told where |y - Y theta_free| < LEFT |y - Y theta_possible|, the latter within its bounds
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from nnhydro.diagnosis.problem.design import Design
from nnhydro.models.stated_terms import stated_values
from nnhydro.physics.loads.rigid_body import RigidBody

Array = NDArray[np.float64]
LEFT = 1 / 3  # of what possible coefficients leave


def impossible_coefficients(design: Design) -> list[str]:
    """Return a sentence for each coefficient beyond its physical bounds if, with such values, most of the torque is explained."""
    base = design.baseline
    if not base.is_physics or design.undriven or not design.Y.shape[2]:
        return []
    Y, y = design.Y.reshape(-1, design.Y.shape[2]), design.y.ravel()
    free = np.linalg.lstsq(Y, y, rcond=None)[0]
    low, high = base.prior.lowest, base.prior.highest
    possible = lsq_linear(Y, y, (low, high)).x if np.all(low < high) else np.clip(free, low, high)
    if np.linalg.norm(y - Y @ free) >= LEFT * np.linalg.norm(y - Y @ possible):
        return []
    theta, said, stated = base.prior.mean + base.prior.F @ free, list[str](), stated_values(base.physics.arm)
    parameters = [(name, term, label, bounds) for name, term in base.physics.loads.linear().items()
                  for label, bounds in zip(term.linear_names(), term.linear_bounds(), strict=True)]
    for (name, term, label, (lowest, highest)), value in zip(parameters, theta.tolist(), strict=True):
        if not isinstance(term, RigidBody) and name not in stated and not lowest <= value <= highest:
            said.append(f"With {name}.{label} = {value:.3g}, most of the torque would be explained, but it can only lie between {lowest:g} "
                        f"and {highest:g}: check the lengths, diameters and density of arm.yaml, and the unit of the torque")
    return said
