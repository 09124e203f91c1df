"""Choose the travel scale tau_s of a model for the recordings of a campaign; all else is linear and fitted as in any model.

    E(tau_s) = min_theta  sum_j w_j |tau_j - X_j(tau_s) theta|^2 + |z|^2,     theta = mean + F z       [-]

tabulated over the whole range (no start value), refined around the smallest, then the vertex of a parabola. Recordings pass by one
at a time, so memory does not grow with them; of many, some spread evenly over the campaign decide. Source: McLain & Rock (1998), eq. (33);
priors and weights as in least_squares.py.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import final
from weakref import WeakKeyDictionary

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.errors import CampaignError
from nnhydro.fitting.linear.least_squares import fit, joint_weights, solve
from nnhydro.fitting.linear.prior import Prior, prior
from nnhydro.fitting.linear.statistics import Statistics, block, residual_energy, total
from nnhydro.fitting.linear.variable_projection import parabola_vertex
from nnhydro.fitting.travel.state_rows import rows_of
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LinearTerm
from nnhydro.physics.memo import Memo
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.transmission import gear_factor, to_drives
from nnhydro.physics.travel.state_model import with_tau_s
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]
COARSE = np.linspace(2.0, 15.0, 14)  # diameters
FINE = np.linspace(-1.0, 1.0, 7)  # diameters around the best of them
MANY = 16  # units that decide; more move tau_s by less than its own uncertainty
_KNOWN: WeakKeyDictionary[Segment, Memo] = WeakKeyDictionary()  # fits to other recordings of a campaign need the sums of a segment again


@final
@dataclass(frozen=True, eq=False)
class TravelScale:
    """The chosen tau_s and the profile that led to it."""

    loads: Loads
    tau_s: float
    grid: Array  # (k,) diameters
    energy: Array  # (k,) E


def _statistics(loads: Loads, segment: Segment, arm: Arm, scales: Array) -> list[Statistics]:
    """Gram sums of a segment for each travel scale; what does not depend on it is computed once."""
    flow = Flow(arm, Motion.of(segment))
    assert segment.tau is not None
    measured = tensor(segment.tau_raw if segment.tau_raw is not None else segment.tau)
    factor = gear_factor(measured, flow.motion.qd, arm)
    moving = Loads({name: term for name, term in loads.terms.items() if hasattr(term, "tau_s")})
    still = Loads({name: term for name, term in loads.terms.items() if name not in moving.terms})
    rows = rows_of(moving, [(flow, torch.zeros_like(flow.motion.q))])
    first = {name: term.columns(flow) for name, term in still.linear().items()}
    offset = Loads({name: term for name, term in still.terms.items() if not isinstance(term, LinearTerm)}).torque(flow)
    sizes = [len(term.linear_values()) for term in moving.linear().values()]
    found = []
    for scale in scales:
        X, y = rows((float(scale),))
        parts = [torch.from_numpy(part) for part in np.split(X, np.cumsum(sizes)[:-1], axis=2)]
        columns = dict(zip(moving.linear(), parts, strict=True)) | first
        every = torch.cat([*(columns[name] for name in loads.linear()), (offset - torch.from_numpy(y))[..., None]], dim=2)
        seen = segment.filter((to_drives(every, arm) * factor[..., None]).numpy())[segment.keep]
        found.append(block(seen[..., :-1], segment.tau[segment.keep] - seen[..., -1]))
    return found


def _energy(stats: Statistics, before: Prior, weight: Array) -> float:
    theta = solve(stats, before, weight).theta
    z = before.z(theta)
    return float(weight @ residual_energy(stats, theta) + z @ z)


def with_best_travel_scale(loads: Loads, chosen: Sequence[Unit], arm: Arm) -> TravelScale:
    """Return `loads` with tau_s chosen for the units; linear parameters keep their values, `fit_units` is to follow.

    Raises CampaignError where no unit holds a stretch to fit.
    """
    deciding = [chosen[int(i)] for i in np.unique(np.linspace(0, len(chosen) - 1, min(MANY, len(chosen))).round())] if chosen else []
    before = prior(loads, arm)

    def sums(scales: Array) -> list[Statistics]:
        """Return the sums of the normal equations for every travel scale (diameters); raises CampaignError where nothing can be fitted."""
        parts = [_KNOWN.setdefault(segment, Memo()).of((arm.model_dump_json(), *loads.terms.items(), *scales),
                                                       partial(_statistics, loads, segment, arm, scales))
                 for unit in deciding for segment in unit.segments()]
        if not parts:
            raise CampaignError("no recording holds a stretch of finite rows long enough to fit: see nnhydro check")
        return [total(column) for column in zip(*parts, strict=True)]

    coarse = sums(COARSE)
    first = fit(coarse[len(COARSE) // 2], before, np.ones(arm.n_links))
    weight = joint_weights(coarse[0], before, first.rms, np.ones(arm.n_links))
    energy = np.array([_energy(stats, before, weight) for stats in coarse])
    fine = np.unique(np.clip(COARSE[int(np.argmin(energy))] + FINE, COARSE[0], COARSE[-1]))
    near = np.array([_energy(stats, before, weight) for stats in sums(fine)])
    tau_s = _vertex(fine, near)
    grid, order = np.unique(np.concatenate([COARSE, fine]), return_index=True)
    return TravelScale(with_tau_s(loads, tau_s), tau_s, grid, np.concatenate([energy, near])[order])


def _vertex(x: Array, y: Array) -> float:
    """The minimum of the parabola through the smallest y and its neighbours; the smallest itself at an end."""
    k = int(np.argmin(y))
    if k in (0, len(x) - 1):
        return float(x[k])
    return float(x[k]) + parabola_vertex(x[k - 1:k + 2] - x[k], y[k - 1:k + 2] - y[k])[0]
