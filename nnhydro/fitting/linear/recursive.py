"""On-line adaptation: recursive least squares with forgetting on the physical coefficients of a model, bounded, with their covariance.

    K = P Y' (Y P Y' + R)^-1,   theta += K (tau - Y theta - rest),   P = (P - K Y P) / forgetting                      [units of theta]

    Y     columns d tau / d theta of the chosen terms at this instant, with the memory of the motion so far, (joints, p)
    R     variance of the torque sensors, (joints, joints) N^2 m^2
    rest  torque of all terms that are not adapted                                                                      [N m]

What leaves its bounds is put on them, the others moved along as their covariance says. Where nothing excites a coefficient its variance
does not grow beyond where it began: the prior is its cap. `forgetting` is the weight that a sample keeps after one period; it remembers
1/(1 - forgetting) samples. Source: https://github.com/zolirulez/Thesis, Codes/ModelicaPlant/RecursiveLeastSquares.m, where K holds
forgetting for R = 1: the same, as P here is divided by it already; bounds and cap are ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.dynamics.joint_model import fast_stepper
from nnhydro.errors import ConfigError, ModelError, require
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.carried import Memory, StepMemory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LinearTerm
from nnhydro.physics.motion import Motion, tensor

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Coefficient:
    """One adapted number: where it stands, its standard deviation and its bounds, in `unit`."""

    name: str
    value: float
    std: float
    unit: str
    bounds: tuple[float, float]


@final
class RecursiveFit:
    """Adapts the linear coefficients of the terms `adapted` of a physics `model` from joint torques, instant by instant.

    `std` says how far each coefficient may be off at first, in its own unit or (below 0) in shares of its value; `noise_Nm` is the torque
    sensors' standard deviation. Raises ModelError for a learned model, ConfigError for a term that is not there or is not linear.
    """

    def __init__(self, model: Any, adapted: Sequence[str], std: float = 0.5, noise_Nm: float | Sequence[float] = 0.05,
                 forgetting: float = 0.998) -> None:
        joint = Dynamics(model).model
        if not isinstance(joint.model, StripTheory) or joint.model.instruments:
            raise ModelError("only coefficients of a physics model without faults of sensors are adapted: give a physics model")
        require(0.5 < forgetting <= 1.0, f"forgetting = {forgetting!r}: give a weight above 0.5, at most 1")
        self.arm, self.loads, self.forgetting = joint.arm, joint.model.loads, forgetting
        for name in adapted:
            known = self.loads.linear()
            require(name in known, f"adapted: {name!r} is not a linear term of this model: it has {', '.join(known)}", ConfigError)
        self.adapted: dict[str, LinearTerm] = {name: self.loads.linear()[name] for name in adapted}
        self.theta = torch.cat([term.linear_values() for term in self.adapted.values()])
        self.bounds = tensor([pair for term in self.adapted.values() for pair in term.linear_bounds()])
        size = self.theta.abs().clamp(min=1e-6) * -std if std < 0 else torch.full_like(self.theta, std)
        self.cap = size**2
        self.P = torch.diag(self.cap)
        self.R = torch.diag(tensor(np.broadcast_to(np.asarray(noise_Nm, dtype=float), (self.arm.n_links,)))**2)
        self.memory: Memory | None = None
        self.rest = Loads({name: fast_stepper(term) for name, term in self.loads.terms.items() if name not in self.adapted})

    def _at(self, q: Any, qd: Any, qdd: Any, u0: float, du0: float, dt: float) -> tuple[Tensor, Tensor]:
        """Y (joints, p) and the torque (joints,) N m of the terms that are not adapted, the memory carried on."""
        carried = StepMemory(torch.full((1,), dt, dtype=torch.float64), self.memory)
        flow = Flow(self.arm, replace(Motion.at(q, qd, qdd, u0, du0), carried=carried))
        Y = torch.cat([term.columns(flow)[0] for term in self.adapted.values()], dim=1)
        rest = self.rest.torque(flow)[0]
        self.memory = carried.after
        return Y, rest

    def update(self, q: Any, qd: Any, qdd: Any, tau: Any, dt: float, u0: float = 0.0, du0: float = 0.0) -> Array:
        """Take in the joint torques `tau` (joints,) N m of an instant `dt` s after the one before; returns the prediction error, N m."""
        Y, rest = self._at(q, qd, qdd, u0, du0, dt)
        off = tensor(tau) - rest - Y @ self.theta
        PY = self.P @ Y.T
        K = torch.linalg.solve(Y @ PY + self.R, PY.T).T
        self.theta = self.theta + K @ off
        P = (self.P - K @ PY.T) / self.forgetting
        self.P = self._cap((P + P.T) / 2)
        self._clip_to_bounds()
        return np.asarray(off.numpy())

    def _cap(self, P: Tensor) -> Tensor:
        """P with no variance above the one at first: forgetting without excitation would raise it without end."""
        shrink = torch.sqrt((self.cap / P.diagonal()).clamp(max=1.0))
        return P * shrink[:, None] * shrink

    def _clip_to_bounds(self) -> None:
        for k in range(len(self.theta)):
            goal = self.theta[k].clamp(self.bounds[k, 0], self.bounds[k, 1])
            if bool(goal != self.theta[k]):
                self.theta = self.theta + self.P[:, k] / self.P[k, k] * (goal - self.theta[k])
        self.theta = torch.minimum(torch.maximum(self.theta, self.bounds[:, 0]), self.bounds[:, 1])

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the coefficients, in the order of `coefficients`."""
        return np.asarray(self.P.numpy().copy())

    @property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """What is adapted, as it stands now."""
        names = [(f"{name}.{symbol}", unit, bounds) for name, term in self.adapted.items()
                 for symbol, unit, bounds in zip(term.linear_names(), term.linear_units(), term.linear_bounds(), strict=True)]
        deviations = self.P.diagonal().sqrt().tolist()
        return tuple(Coefficient(name, value, std, unit, bounds) for (name, unit, bounds), value, std in
                     zip(names, self.theta.tolist(), deviations, strict=True))

    def adapted_loads(self) -> Loads:
        """Return the model's terms with the coefficients as they stand now."""
        return Loads({**self.loads.terms, **Loads(self.adapted).with_linear(self.theta.numpy()).terms})
