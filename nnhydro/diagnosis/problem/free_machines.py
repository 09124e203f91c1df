"""Machines that nothing drives: a free pendulum, a rolling ship. Their equation of motion M + sum_k X_k beta_k = 0 holds up to a factor.

Only the masses set the scale of all torques. The model's largest part w that varies, weight or inertia, is held fixed: its parameters
vary only in directions that do not change it, added mass with the masses if w is the inertia. Laws have columns X' = X - a M, where a is
the share of w in the torque of X: at rest if w is the weight, by the accelerations alone if it is the inertia. Otherwise a load that
lifts the weight, or an added mass that cancels the masses, would leave no torque to explain.

    M + sum_k X'_k b_k = kappa (M + sum_k X_k b_k / kappa),     kappa = 1 - sum_k a_k b_k
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.problem.problem import Problem, Stretch
from nnhydro.errors import CampaignError, require
from nnhydro.fitting.linear.statistics import columns_and_offset

if TYPE_CHECKING:
    from nnhydro.diagnosis.problem.design import Design

Array = NDArray[np.float64]
RESTS = 1e-6  # rad, rad/s: range of angles, and largest rate, within which nothing moves: rounding alone
LEAST = 0.1  # least share of the weight that the model keeps beside a law: no law may carry the machine


def shares_of_largest(design: "Design", columns: Array) -> Array:
    """Return how much of the model's largest part w each of the `columns` (n, joints, K) holds, (K,): X.w / w.w."""
    w = design.largest_part
    made: Array = np.einsum("nj,njk->k", w, columns) / max(float((w**2).sum()), 1e-300)
    return made


def scale_factor(shares: Array, values: Array) -> float:
    """Return kappa of columns X' whose shares of w are a (K,) at the values b (K,): values over it are the machine's."""
    return max(float(1.0 - shares @ values), LEAST)


def scale_direction(design: "Design") -> Array:
    """Return how z (r,) changes the energy of the model's largest part, weight or inertia: if nothing is driven, no torque determines it.

        a = sum_n Y_n' tau_n,   Y, tau the part's columns and torque
    """
    base, arm = design.baseline, design.problem.arm

    def part(stretch: Stretch) -> Array:
        """Return the columns and the torque N m of the model's largest part on a stretch, (n, joints, r + 1)."""
        still = stretch.at_rest().segment
        still = still if design.heavy else replace(still, qdd=stretch.segment.qdd)
        Y, c0 = columns_and_offset(base.physics.loads, still, arm)
        return np.concatenate([Y @ base.prior.F, (c0 + Y @ base.prior.mean)[..., None]], axis=2)

    rows = design.rows(part)
    r = rows.shape[2] - 1
    a: Array = rows[..., :r].reshape(-1, r).T @ rows[..., r].ravel()
    rigid = np.array([bool(np.any(column[: 3 * arm.n_links])) for column in base.prior.F.T], dtype=bool)
    return np.where(rigid, a, 0.0) if design.heavy else a


def require_motion(problem: Problem) -> None:
    """Raise CampaignError where nothing moves in any recording of a machine that nothing drives."""
    segments = [stretch.segment for stretch in problem.stretches]
    moves = any(max(np.ptp(segment.q, axis=0).max(), np.abs(segment.qd).max()) > RESTS for segment in segments)
    require(moves, "no joint moves and all torques are 0: these recordings tell nothing; are the channels dead (nnhydro check)?",
            CampaignError)
