"""What is known before the recordings: Gaussian priors on the linear parameters.

Inertial parameters deviate from arm.yaml along the directions of physics/loads/rigid_body.py, one standard deviation each.
Friction and rotor inertia that arm.yaml states deviate by what it says they are known to (models/stated_terms.py).
Coefficients of the water keep a wide prior (standard deviation 1), which only speaks where the motions do not excite them.
Fits work on theta = mean + F z with z ~ N(0, 1): what is exactly known has no direction in F.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.models.stated_terms import stated_values
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LinearTerm
from nnhydro.physics.loads.rigid_body import RigidBody, inertial_directions
from nnhydro.recordings.arm import Arm

Array = NDArray[np.float64]
BEYOND = 4.0  # standard deviations: by chance once in 16,000 parameters
WIDE = 1.0  # standard deviation of a coefficient whose start value is a guess


@final
@dataclass(frozen=True, eq=False)
class Prior:
    """theta = mean + F z, z ~ N(0, 1), within lowest <= z <= highest."""

    mean: Array  # (p,)
    F: Array  # (p, r)
    lowest: Array  # (r,)
    highest: Array  # (r,)

    @property
    def sd(self) -> Array:
        """Prior standard deviation of every parameter (p,); 0 where it is known exactly."""
        made: Array = np.sqrt((self.F**2).sum(axis=1))
        return made

    def z(self, theta: Array) -> Array:
        """Return z (r,) with theta = mean + F z, of least squares where F is not square."""
        if not self.F.size:
            return np.zeros(0)
        made: Array = np.asarray(np.linalg.lstsq(self.F, theta - self.mean, rcond=None)[0], dtype=float)
        return made


def _of_term(term: LinearTerm, arm: Arm, sd: Array | None = None) -> Prior:
    """The prior of one term; `sd` (p,) where its values are known to that."""
    mean = term.linear_values().numpy()
    if sd is not None:
        free = sd > 0
        low, high = np.array(term.linear_bounds())[free].reshape(-1, 2).T
        return Prior(mean, np.diag(sd)[:, free], (low - mean[free]) / sd[free], (high - mean[free]) / sd[free])
    if isinstance(term, RigidBody):
        F = inertial_directions(arm)
        return Prior(mean, F, np.full(F.shape[1], -np.inf), np.full(F.shape[1], np.inf))
    lowest, highest = np.array(term.linear_bounds()).reshape(-1, 2).T
    return Prior(mean, WIDE * np.eye(len(mean)), (lowest - mean) / WIDE, (highest - mean) / WIDE)


def against_stated(loads: Loads, known: Prior, theta: Array, arm: Arm) -> list[str]:
    """Return a sentence for each parameter that arm.yaml states and a fit moves more than BEYOND of its standard deviations from it."""
    said = []
    for (name, term, label, unit, _), value, mean, sd in zip(loads.linear_parameters(), theta.tolist(), known.mean.tolist(),
                                                             known.sd.tolist(), strict=True):
        if (isinstance(term, RigidBody) or name in stated_values(arm)) and abs(value - mean) > BEYOND * sd > 0:
            said.append(arm.text(f"{name}.{label} is fitted as {value:.4g} {unit}, {abs(value - mean) / sd:.0f} times its stated "
                                 f"uncertainty from the {mean:.4g} {unit} of arm.yaml: check that value and its known_to. Else an omitted "
                                 "effect moves it"))
    return said


def prior(loads: Loads, arm: Arm) -> Prior:
    """Return the prior of all linear parameters of `loads`, in the order of their columns."""
    from scipy.linalg import block_diag

    stated = stated_values(arm)
    parts = [_of_term(term, arm, stated[name][1] if name in stated else None) for name, term in loads.linear().items()]
    if not parts:
        return Prior(np.zeros(0), np.zeros((0, 0)), np.zeros(0), np.zeros(0))
    return Prior(np.concatenate([p.mean for p in parts]), block_diag(*[part.F for part in parts]),
                 np.concatenate([part.lowest for part in parts]), np.concatenate([part.highest for part in parts]))
