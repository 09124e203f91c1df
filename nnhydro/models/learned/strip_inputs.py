"""What a strip net looks at, and what its loads do: motion and memory of a few strips of every link, free of dimension.

    f = rho D V^2 y + rho D (|w| w, D dw, ...) theta,      tau = sum over strips of f and f x, to the sensors        [N/m, N m]

V^2 is the mean square of the strip's speed w and of what its water remembers of it: loads in proportion to V^2 fade with the wake. y is
learned (strip_net.py). Even in the mirror are the strip's Reynolds number and where it lies: near the outer end of its link, on the first
link (-1) to the last (1), in the wakes of other links (features/interference.py). Beside the strips stand the dry links and friction, whose
torque is none of the water.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from torch import Tensor

from nnhydro.features.body_columns import body_columns
from nnhydro.features.interference import REACHES, in_wakes
from nnhydro.features.morison import CREEP
from nnhydro.features.morison import SLOW as SLOWER
from nnhydro.features.scaling import gear_ratios
from nnhydro.features.strip_law.law import to_sensors
from nnhydro.features.wake import STRIPS, memories, stations, swinging_memories, travel_memories
from nnhydro.models.baselines import BASELINES
from nnhydro.physics.flow import Flow
from nnhydro.physics.transmission import to_drives

POINTS = (0, 3, 6, 9)  # of the strips of features/wake.py: what they remember is known there
STILL = 0.1  # diameters a second
TINY = 1e-12  # (diameters a second)^2: the clock has a slope at rest too
EVEN = 3 + len(REACHES)  # Reynolds number and surroundings
PLAIN = 4  # coefficients of |w| w, dw, nu w, and dw where it is small beside the speeds
QUICK, SLOW, RE = 3.0, 0.3, 1e3  # scales of acceleration over speed squared, and of the Reynolds number
VISCOUS = 30.0


def _weights() -> Tensor:
    """The share of a link (POINTS,) that each point stands for: sums over the points are integrals of cubics."""
    place = (np.array(POINTS) + 0.5) / STRIPS
    powers = np.arange(len(POINTS))
    return torch.from_numpy(np.linalg.solve(place[None] ** powers[:, None], 1 / (powers + 1)))


def _surroundings(flow: Flow) -> Tensor:
    """Where a strip lies, even numbers (n, s, EVEN - 1): near an outer end, on which link, and how far in the wakes of others."""
    every = stations(flow)
    x = every[:, POINTS]
    outer, n = torch.exp((x - flow.L[:, None]) / flow.D[:, None]), flow.arm.n_links
    link = torch.linspace(-1.0, 1.0, n, dtype=torch.float64) if n > 1 else torch.zeros(1, dtype=torch.float64)
    place = torch.stack([outer, link[:, None].expand_as(x)], dim=-1).flatten(0, 1)
    return torch.cat([place.expand(len(flow.motion), -1, -1), in_wakes(flow, every)[..., POINTS].mT.flatten(1, 2)], dim=-1)


@final
@dataclass(frozen=True, eq=False)
class StripInputs:
    """What the strips (n, s, ...) of a motion do, and with them its water."""

    x: Tensor  # (n, s, odd), the last one of the acceleration
    r: Tensor  # (n, s, EVEN): of the Reynolds number, and where the strip lies
    speeds: Tensor  # (n, s, 2): V and w, diameters a second
    plain: Tensor  # (n, s, PLAIN) (D/s)^2

    @staticmethod
    def of(flow: Flow) -> "StripInputs":
        """Return what the strips at the points of every link see."""
        every, D = stations(flow), flow.D[:, None]
        x = every[:, POINTS]
        filters = [z[..., POINTS] / D for z in memories(flow, every)[1]]
        m, swung = (torch.stack(z).flatten(2) for z in ([filters[-1], *travel_memories(filters)], list(swinging_memories(filters))))
        w, dw, V2 = m[0], ((flow.M[:, :, None] * x + flow.N[:, :, None]) / D).flatten(1), m.square().mean(dim=0)
        nu, known = (flow.nu / D**2).expand_as(x).flatten(), V2 + STILL**2
        V, X = known.sqrt(), dw / (QUICK * known)
        odd = torch.stack([*(m / V), *(swung / V), X / (1 + X**2).sqrt()], dim=-1)
        plain = torch.stack([w.abs() * w, dw, VISCOUS * nu * w, dw * V2 / (known + SLOW * dw.abs())], dim=-1)
        r = torch.cat([torch.log10(1 + V / nu / RE)[..., None], _surroundings(flow)], dim=-1)
        return StripInputs(odd, r, torch.stack([(V2 + TINY).sqrt(), w], dim=-1), plain)


def drift(flow: Flow) -> Tensor:
    """Return the square of the base's speed through the water (n,) m^2/s^2: carriage, moving base and current."""
    rx, ry = flow.through_water[:2]
    return (rx**2 + ry**2).amax(dim=1)


def sensor_torque(flow: Flow, load: Tensor) -> Tensor:
    """Return the sensor torques (n, joints, p) N m of strip loads (n or 1, s, p) (D/s)^2."""
    x = stations(flow)[:, POINTS, None]
    force = (flow.rho * flow.D**3 * flow.L)[:, None, None] * _weights()[:, None] * load.reshape(len(load), *x.shape[:2], -1)
    force = force.expand(len(flow.motion), -1, -1, -1)
    return to_sensors(flow, force.sum(dim=2), (force * x).sum(dim=2))


def arm_columns(flow: Flow) -> Tensor:
    """Return the sensor torques (n, joints, p) N m of coefficients of 1: the body's, and friction of every joint at every drive."""
    body, qd = body_columns(flow), flow.motion.qd
    law = torch.cat([torch.tanh(qd / CREEP), torch.tanh(qd / SLOWER), qd], dim=1)
    every = torch.eye(qd.shape[1], dtype=torch.float64)[None, :, :, None] * law[:, None, None, :]
    return torch.cat([body, every.flatten(2)], dim=2)


def rigid_torque(flow: Flow) -> Tensor:
    """Return the sensor torques (n, joints) N m of the rigid links as arm.yaml states them: what a net stands beside."""
    terms = BASELINES["rigid"].start(flow.arm).by_term(flow)
    return to_drives(torch.stack(list(terms.values())).sum(dim=0), flow.arm) / gear_ratios(flow.arm)
