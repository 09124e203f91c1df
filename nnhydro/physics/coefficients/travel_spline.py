"""McLain & Rock's coefficient curve over the travel s/D: a cubic spline with one fixed, five shaping and one scaling point.

    C(s/D) = C_0 phi_0(u) + sum_{k=1..6} c_k phi_k(u),    u = min(s / (D tau_s), 1)             [-]

    c_k     ordinates at the knots u = k/6: the curve's own values; c_6 is the steady value
    C_0     value at s = 0, fixed by theory: 0 for drag, 1 for added mass
    tau_s   travel in diameters beyond which the curve is constant

Curvature 0 at s = 0, slope 0 at s/D = tau_s. phi_k are the cardinal splines, here in truncated powers

    phi(u) = (u, u^3, (u - 1/6)_+^3, ..., (u - 5/6)_+^3) T

which need no search for the interval and no exception for u beyond 1. They do not depend on tau_s, so the curve is linear in c for a given
tau_s. Source: McLain & Rock (1998), section 3, figure 7; the end conditions and what the ordinates mean are ours.
"""

from functools import lru_cache

import torch
from torch import Tensor

KNOTS = 6  # intervals: 5 shaping points between the ends


def powers(u: Tensor) -> Tensor:
    """Return u, u^3 and the truncated cubes, (..., 7), for u in 0..1."""
    knots = torch.arange(KNOTS, dtype=torch.float64) / KNOTS
    ramp = (u[..., None] - knots).clamp(min=0)
    return torch.cat([u[..., None], ramp * ramp * ramp], dim=-1)


@lru_cache(maxsize=1)
def cardinal_matrix() -> Tensor:
    """Return T (7, 7): truncated-power coefficients of phi_0 - 1 (first column) and phi_1 ... phi_6."""
    knots = torch.arange(1, KNOTS + 1, dtype=torch.float64) / KNOTS
    slope_at_end = torch.cat([torch.ones(1, dtype=torch.float64), 3 * (1 - torch.arange(KNOTS, dtype=torch.float64) / KNOTS) ** 2])
    conditions = torch.cat([powers(knots), slope_at_end[None]])  # values at the six knots, slope at the last
    wanted = torch.zeros(KNOTS + 1, KNOTS + 1, dtype=torch.float64)
    wanted[:KNOTS, 0] = -1.0  # phi_0 vanishes at every knot but the first, where it is 1
    wanted[:KNOTS, 1:] = torch.eye(KNOTS, dtype=torch.float64)
    solution: Tensor = torch.linalg.solve(conditions, wanted)
    return solution


def spline_argument(s_over_D: Tensor, tau_s: float) -> Tensor:
    """Return u = min(s/(D tau_s), 1); infinite travel gives 1."""
    return (s_over_D / tau_s).clamp(max=1.0)


def basis(s_over_D: Tensor, tau_s: float) -> Tensor:
    """Return phi_1 ... phi_6 at the travel `s_over_D` (...), as (..., 6)."""
    return powers(spline_argument(s_over_D, tau_s)) @ cardinal_matrix()[:, 1:]


def curve(s_over_D: Tensor, tau_s: float, start: float, ordinates: Tensor) -> Tensor:
    """Return C(s/D) for the value `start` at rest and six `ordinates`.

        C = C_0 + sum_k r (a_k + r (b_k + r d_k)),    r = min((u - k/6)_+, 1/6)

    Each piece adds its own rise: powers that all begin at rest would cancel, too much for single precision.
    """
    c = start * cardinal_matrix()[:, 0] + cardinal_matrix()[:, 1:] @ ordinates
    knots = torch.arange(KNOTS, dtype=torch.float64) / KNOTS
    past = (knots[:, None] - knots).clamp(min=0)
    a, b, d = c[0] + 3 * past**2 @ c[1:], 3 * past @ c[1:], c[1:].cumsum(0)
    r = (s_over_D[..., None] / tau_s - knots).clamp(0, 1 / KNOTS)
    return start + (r * (a + r * (b + r * d))).sum(-1)
