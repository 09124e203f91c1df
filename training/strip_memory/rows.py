"""What a net is shown of a recording: the strips' motion and wake, how their loads reach the torques, what was measured."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from scipy import signal
from torch import Tensor

from nnhydro.features.body_columns import body_columns
from nnhydro.features.strip_law.law import to_sensors
from nnhydro.features.wake import memories, swinging_memories, travel_memories
from nnhydro.models.baselines import BASELINES
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment

STILL = 0.1  # diameters a second
LINEAR = 4  # coefficients of |w| w, dw, nu w, and dw where it is small beside the speeds


@dataclass(frozen=True, eq=False)
class Run:
    """One recording, every STRIDE-th row: what the strips (t first) do, how their loads reach the torques, and what was measured."""

    x: Tensor  # (strips, t, odd)
    r: Tensor  # (strips, t, even)
    dsigma: Tensor
    ds: Tensor  # (strips, t, 1) diameters
    V2: Tensor  # (t, strips) (D/s)^2
    plain: Tensor  # (t, strips, LINEAR) (D/s)^2
    levers: Tensor  # (t, joints, strips) N m of a load of rho D^3 (D/s)^2 / m
    body: Tensor  # (t, joints, columns) N m
    low_pass: Tensor  # (t, t)
    y: Tensor  # (t, joints) N m: what the rigid body leaves
    tau: Tensor
    keep: Tensor
    force: Tensor  # (t, strips) (D/s)^2: the truth's, nan where unknown

    def torque(self, load: Tensor, theta: Tensor) -> Tensor:
        """Torques (t, joints) N m as the sensor sees them."""
        return self.low_pass @ torch.einsum("tjs,ts->tj", self.levers, load) + self.body @ theta[LINEAR:]

    def load(self, y: Tensor, theta: Tensor) -> Tensor:
        return self.V2 * y.T + self.plain @ theta[:LINEAR]


def true_force(path: Path, stride: int, like: Tensor) -> Tensor:
    """The water's load N/m on each strip as the recorder's filter would have passed it."""
    if not path.is_file():
        return torch.full_like(like, torch.nan)
    low_pass = signal.butter(4, 25.0, fs=250.0, output="sos")
    return torch.from_numpy(signal.sosfilt(low_pass, -np.load(path).astype(float), axis=0)[::2 * stride].copy())


def run_of(segment: Segment, arm: Arm, truth: Path, stride: int) -> Run:
    """What a net sees of a recording; strips lie where those of the tanks do."""
    flow = Flow(arm, Motion.of(segment))
    place, weight = (torch.from_numpy(z) for z in np.polynomial.legendre.leggauss(4))
    D, nu, rows, dt = float(flow.D[0]), flow.nu / float(flow.D[0]) ** 2, slice(None, None, stride), segment.dt * stride
    x, width = flow.L[:, None] * (1 + place) / 2, flow.L[:, None] * weight / 2
    bank = memories(flow, x)[1]
    m, swung = (torch.stack(z).flatten(2)[:, rows] / D for z in ([bank[-1], *travel_memories(bank)], swinging_memories(bank)))
    w, dw, V2 = m[0], (flow.M[:, :, None] * x + flow.N[:, :, None]).flatten(1)[rows] / D, m.square().mean(dim=0)
    V, X = (V2 + STILL**2).sqrt(), dw / (3 * (V2 + STILL**2))
    odd = torch.stack([*(m / V), *(swung / V), X / (1 + X**2).sqrt()], dim=-1).transpose(0, 1)
    even = torch.log10(1 + V / nu / 1e3)[..., None].transpose(0, 1)
    plain = torch.stack([w.abs() * w, dw, 30 * nu * w, dw * V2 / (V2 + 0.3 * dw.abs() + STILL**2)], dim=-1)
    unit = torch.eye(x.numel()).double().reshape(1, *x.shape, -1).expand(len(segment.t), *x.shape, -1) * width[..., None] * flow.rho * D**3
    levers = to_sensors(flow, unit.sum(dim=2), (unit * x[..., None]).sum(dim=2))[rows]
    rigid = torch.stack(list(BASELINES["rigid"].start(arm).by_term(flow).values())).sum(dim=0)

    def passed(z: Tensor) -> Tensor:
        return z if segment.low_pass is None else torch.from_numpy(segment.low_pass.apply(z.flatten(1).numpy(), dt)).reshape(z.shape)

    dsigma, ds = ((torch.cat([0 * z[:1], (z[1:] + z[:-1]) / 2]) * dt).T[..., None] for z in (V2.sqrt(), w))
    tau = torch.from_numpy(np.array(segment.tau))[rows]
    found = (odd, even, dsigma, ds, V2, plain, levers, passed(body_columns(flow)[rows]), passed(torch.eye(len(w)).double()),
             tau - passed(rigid[rows]), tau, torch.from_numpy(segment.keep[rows].copy()),
             true_force(truth, stride, w) / (flow.rho * D**3))
    return Run(*(z.float().contiguous() if z.is_floating_point() else z for z in found))
