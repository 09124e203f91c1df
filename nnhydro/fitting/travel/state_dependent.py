"""Identify the coefficient curves C_D(s/D), C_M(s/D) of McLain & Rock by separable least squares over the travel scale tau_s.

    minimise  sum (tau_meas - tau_model(d_1..d_5, d_s, m_1..m_5, m_s; tau_s))^2            [(N m)^2], eq. (33)

C_D(0) = 0 and C_M(0) = 1 are built into the curves. The paper's cost has several minima in tau_s that fit within 0.5 % of the torque, so
E(tau_s) is tabulated over its whole range. Ordinates trade against tau_s: the curve is judged, and its interval comes from refitting to
slews drawn with replacement. Source: McLain & Rock (1998), section 3; the method is ours.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.errors import CampaignError, require
from nnhydro.fitting.linear.variable_projection import Reduced, SeparableFit, bootstrap, reduce, separable
from nnhydro.fitting.travel.state_rows import Pair, rows_of
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import tensor
from nnhydro.physics.travel.state_model import added_mass_curve, drag_curve, with_tau_s

Array = NDArray[np.float64]
GRID = np.linspace(2.0, 15.0, 21)  # diameters: 0.65 apart; the known minima lie 2.4 apart
DRAWS = 200  # bootstrap draws: a 95 % bound is then known to about 1.5 %
NEAR = np.linspace(-2.0, 2.0, 17)  # diameters around the optimum searched in each draw


@final
@dataclass(frozen=True, eq=False)
class StateFit:
    """The fitted sum, the profile of its travel scales and what is needed to judge both."""

    loads: Loads
    tau_s: tuple[float, ...]  # one scale for both curves, or one for drag and one for added mass
    rms: float  # N m, residual over all joints and rows
    search: SeparableFit
    free: Loads  # the fitted terms alone
    blocks: Reduced  # one block a motion, for the bootstrap


def _joint_scale(pairs: Sequence[Pair]) -> Array:
    """rms torque (joints,) where there are several joints, so that they count alike; else 1."""
    tau = torch.cat([torque for _, torque in pairs]).numpy()
    rms: Array = np.sqrt((tau**2).mean(axis=0))
    return np.where(rms > 0, rms, 1.0) if len(rms) > 1 else np.ones(1)


def fit_state(loads: Loads, pairs: Sequence[Pair], fixed: Sequence[str] = ("rigid_body",), grid: Sequence[Array] = (GRID,),
              prior: Array | None = None) -> StateFit:
    """Return `loads` fitted to `pairs` of motion (Flow) and joint torque (n, joints) N m, tau_s searched over `grid` in diameters.

    Two grids give drag and added mass a scale each. Terms named in `fixed` keep their values. `prior` holds rows [Z | z] (r, p + 1) on the
    other linear parameters: a ridge, a penalty on bends. Raises CampaignError without pairs.
    """
    require(len(pairs) > 0, "no motion with torque to identify from: give at least one slew", CampaignError)
    free = Loads({name: term for name, term in loads.terms.items() if name not in fixed})
    fixed_loads = Loads({name: term for name, term in loads.terms.items() if name in fixed})
    rest = [(flow, tau - fixed_loads.torque(flow)) for flow, tau in pairs]
    scale, rows = _joint_scale(rest), rows_of(free, rest)
    ends = np.cumsum([len(tau) for _, tau in rest])[:-1]

    def at_scale(nu: tuple[float, ...]) -> tuple[Array, Array]:
        X, y = rows(nu)
        return X / scale[:, None], y / scale

    def blocks(nu: tuple[float, ...]) -> Array:
        X, y = at_scale(nu)
        return np.stack([reduce(a.reshape(-1, a.shape[2]), b.ravel()) for a, b in zip(np.split(X, ends), np.split(y, ends), strict=True)])

    def whole(nu: tuple[float, ...]) -> Array:
        X, y = at_scale(nu)
        return reduce(X.reshape(-1, X.shape[2]), y.ravel())[None]

    found = separable(whole, grid, prior)

    fitted = with_tau_s(free, *found.nu).with_linear(found.theta)
    X, y = rows(found.nu)
    rms = float(np.sqrt(np.mean((y - X @ found.theta) ** 2)))
    return StateFit(Loads({name: fitted.terms.get(name, term) for name, term in loads.terms.items()}), found.nu, rms, found, fitted, blocks)


def curve_bands(fit: StateFit, s_over_D: Array, draws: int = DRAWS, seed: int = 0, share: float = 0.95) -> dict[str, tuple[Array, Array]]:
    """Return (low, high) of C_D and C_M at the travels `s_over_D` (k,): refitted, tau_s included, to motions drawn with replacement.

    Percentiles, widened about the fit for few motions as Student's t is wider than the normal distribution. Raises ConfigError for a
    fit with two travel scales.
    """
    from scipy.stats import norm, t

    require(len(fit.tau_s) == 1, "intervals of the curves are for one travel scale: fit with one grid")
    near = np.unique(np.clip(fit.tau_s[0] + NEAR, fit.search.grid[0][0], fit.search.grid[0][-1]))
    nus, thetas = bootstrap(fit.blocks, near, draws, seed)
    drawn = [with_tau_s(fit.free, nu).with_linear(theta) for nu, theta in zip(nus.tolist(), thetas, strict=True)]
    ends = [(1 - share) / 2, (1 + share) / 2]
    s = tensor(s_over_D)

    count = fit.blocks(fit.tau_s).shape[0]
    wider = float(t.ppf(ends[1], count - 1) / norm.ppf(ends[1])) * (count / (count - 1)) ** 0.5 if count > 1 else np.inf

    def band(curve: Callable[[Loads, Tensor], Tensor]) -> tuple[Array, Array]:
        """Return the lower and upper end of the interval of a curve over s/D, widened about the fit."""
        low, high = np.quantile([curve(loads, s).numpy() for loads in drawn], ends, axis=0)
        middle = curve(fit.loads, s).numpy()
        return middle + wider * np.minimum(low - middle, 0), middle + wider * np.maximum(high - middle, 0)

    return {"C_D": band(drag_curve), "C_M": band(added_mass_curve)}
