"""McLain & Rock's arm, their motions and the models they compare, from the numbers that their text states.

    theta'' = +alpha to T/2, -alpha after,   alpha = 4 theta_f / T^2            rest to rest          [rad/s^2]

The motions of the twelve slews for identification are not stated: three angles at four accelerations here. All torques are LOAD, minus
the paper's T_hyd. Source: McLain & Rock (1998), sections 2 to 4.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.evaluation.metrics import Misfit
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.state_model import state_loads
from nnhydro.physics.travel.term import unit_drag, unit_inertia
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.low_pass import LowPass

Array = NDArray[np.float64]
LENGTH, DIAMETER = 0.65, 0.071  # m
SEGMENTS = 10
RATE = 500.0  # Hz
CUTOFF = 25.0  # Hz, of the paper's low-pass
VALIDATION: Final = ((30.0, 0.4), (60.0, 0.6), (120.0, 1.2))  # degrees, seconds: figures 9 to 11
IDENTIFICATION: Final = ((30.0, 0.724), (60.0, 1.024), (120.0, 1.448), (30.0, 0.59), (60.0, 0.836), (120.0, 1.182),
                         (30.0, 0.482), (60.0, 0.682), (120.0, 0.964), (30.0, 0.402), (60.0, 0.568), (120.0, 0.802))
CONSTANTS: Final = {"Levesque & Richard": (1.1, 0.0), "textbook": (1.2, 1.0)}  # C_D, C_M


def arm(slenderness: float = LENGTH / DIAMETER) -> Arm:
    """Return the arm without its own mass (the paper's torques are the water's), of a given L/D."""
    return Arm.model_validate({"name": "McLain & Rock's arm", "fluid": {"density_kg_m3": 1000.0}, "links": [
        {"length_m": slenderness * DIAMETER, "diameter_m": DIAMETER, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 0.0}]})


def slew(degrees: float, duration: float, rate: float = RATE) -> Flow:
    """Return the flow of a slew of `degrees` in `duration` s; the sample at half time belongs to the deceleration."""
    alpha, T = 4 * np.radians(degrees) / duration**2, duration
    t = np.arange(round(T * rate) + 1) / rate
    speeding = t < T / 2 - 1e-9
    theta = np.where(speeding, alpha * t**2 / 2, alpha * T**2 / 4 - alpha * (T - t) ** 2 / 2)
    omega, acc = np.where(speeding, alpha * t, alpha * (T - t)), np.where(speeding, alpha, -alpha)
    still = torch.zeros(len(t), dtype=torch.float64)
    q, qd, qdd = tensor(theta)[:, None], tensor(omega)[:, None], tensor(acc)[:, None]
    return Flow(arm(), Motion(tensor(t), q, qd, qdd, still, still))


def truth() -> Loads:
    """Return the curves through the numbers that the text quotes of figure 7, on ten segments."""
    return state_loads(arm(), per_link=SEGMENTS)


def constant_columns(flow: Flow, segments: int = SEGMENTS) -> Tensor:
    """Return d tau / d (C_D, C_M), (n, 2), on equal segments."""
    strips = Strips.of(flow, segments)
    return torch.stack([strips.to_joints(f(strips))[:, 0, 0] for f in (unit_drag, unit_inertia)], dim=-1)


@final
@dataclass(frozen=True)
class Constants:
    """A model with constant coefficients."""

    C_D: float
    C_M: float

    def torque(self, flow: Flow) -> Tensor:
        """Return the torque (n,) N m."""
        return constant_columns(flow) @ torch.tensor([self.C_D, self.C_M], dtype=torch.float64)


def fitted_constants(pairs: Sequence[tuple[Flow, Tensor]]) -> Constants:
    """Return the constants that fit the torques (n,) of `pairs` best: the honest baseline, which the paper does not show."""
    X, tau = torch.cat([constant_columns(flow) for flow, _ in pairs]), torch.cat([tau for _, tau in pairs])
    C_D, C_M = torch.linalg.lstsq(X, tau[:, None]).solution[:, 0].tolist()
    return Constants(C_D, C_M)


def pooled_error(measured: Sequence[Tensor], modelled: Sequence[Tensor]) -> float:
    """Return sum |tau - model| / sum |tau| over the samples of all motions."""
    return Misfit.total(Misfit.of(a.reshape(-1, 1).numpy(), b.reshape(-1, 1).numpy())
                        for a, b in zip(measured, modelled, strict=True)).error


def deviation(torques: Sequence[Tensor], share: float, rng: np.random.Generator) -> list[Tensor]:
    """Return random deviations as smooth as the paper's filter lets pass, `share` of the torque in the pooled measure."""
    drawn = [LowPass(CUTOFF).apply(rng.standard_normal(len(tau)), 1 / RATE) for tau in torques]
    scale = share * sum(float(tau.abs().sum()) for tau in torques) / sum(float(np.abs(x).sum()) for x in drawn)
    return [tensor(scale * x) for x in drawn]


def comparison_models() -> Mapping[str, Constants]:
    """Return the two models of the paper's figures 9 to 11."""
    return {name: Constants(*values) for name, values in CONSTANTS.items()}
