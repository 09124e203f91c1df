"""What is known before the recordings: Gaussian priors on the linear parameters.

Inertial parameters of a link, known to a relative standard uncertainty k of mass m, mass centre c and inertia I, linearised:

    d(m, h, J) = G d(m, c, I),   h = m c,  J = I + m c^2,   cov = k^2 G diag(m^2, c^2, I^2) G'

Coefficients of the water keep a wide prior (standard deviation 1), which only speaks where the motions do not excite them.
Fits work on theta = mean + F z with z ~ N(0, 1): what is exactly known has no direction in F.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LinearTerm
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.recordings.arm import Arm

Array = NDArray[np.float64]
WIDE = 1.0  # standard deviation of a coefficient whose start value is a guess


@final
@dataclass(frozen=True, eq=False)
class Prior:
    """theta = mean + F z, z ~ N(0, 1), within lowest <= z <= highest."""

    mean: Array  # (p,)
    F: Array  # (p, r)
    lowest: Array  # (r,)
    highest: Array  # (r,)


def inertial_directions(arm: Arm) -> Array:
    """Return F (3 links, r) of (m, h, J), ordered as `RigidBody`'s columns; a column for each of m, c, I that is not exactly known."""
    links, columns = arm.n_links, []
    for i, link in enumerate(arm.links):
        m, c, inertia, k = link.mass_kg, link.com_m, link.inertia_kg_m2, link.known_to
        for deviation, gradient in ((k * m, (1.0, c, c**2)), (k * abs(c), (0.0, m, 2 * m * c)), (k * inertia, (0.0, 0.0, 1.0))):
            column = np.zeros(3 * links)
            column[[i, links + i, 2 * links + i]] = deviation * np.array(gradient)
            if column.any():
                columns.append(column)
    return np.array(columns).T.reshape(3 * links, len(columns))


def _of_term(term: LinearTerm, arm: Arm) -> Prior:
    mean = term.linear_values().numpy()
    if isinstance(term, RigidBody):
        F = inertial_directions(arm)
        return Prior(mean, F, np.full(F.shape[1], -np.inf), np.full(F.shape[1], np.inf))
    lowest, highest = np.array(term.linear_bounds()).reshape(-1, 2).T
    return Prior(mean, WIDE * np.eye(len(mean)), (lowest - mean) / WIDE, (highest - mean) / WIDE)


def prior(loads: Loads, arm: Arm) -> Prior:
    """Return the prior of all linear parameters of `loads`, in the order of their columns."""
    from scipy.linalg import block_diag

    parts = [_of_term(term, arm) for term in loads.linear().values()]
    if not parts:
        return Prior(np.zeros(0), np.zeros((0, 0)), np.zeros(0), np.zeros(0))
    return Prior(np.concatenate([p.mean for p in parts]), block_diag(*[p.F for p in parts]),
                 np.concatenate([p.lowest for p in parts]), np.concatenate([p.highest for p in parts]))
