"""Viscous memory of the boundary layer (Basset's force of a cylinder): the past acceleration weighted with 1/sqrt of the time since.

    f(x, t) = C_H 2 rho D sqrt(pi nu) int_0^t dw/dt'(x, t') exp(-lambda (t - t')) / sqrt(t - t') dt'          [N/m], along n_i

Half of it is wall friction, half the pressure of the displaced flow, of a thin laminar boundary layer on a wall velocity 2 w sin(angle):
C_H = 1 then. It is the half-order part of Stokes' and Wang's force on an oscillating cylinder, 4 (pi beta)^(-1/2) in the inertia
coefficient, beta = D^2/(nu T). It holds while the flow is attached (about a diameter of travel).
Basset's kernel has lambda = 0. At finite Reynolds numbers the flow carries the layer's vorticity away, and the kernel fades faster than
1/sqrt(t) (Mei & Adrian 1992, for a sphere, as in Jaganathan et al. 2023, Front. Phys., section 2.1,
https://frontiersin.org/articles/10.3389/fphy.2023.1167338/full: at last as t^-2). exp(-lambda t) is the simplest law that does: ours.
The integral is exact for a velocity that is linear between the rows: a step of acceleration a gives a [K(t - t_k) - K(t - t_k+1)],
K(t) = sqrt(pi/lambda) erf(sqrt(lambda t)), 2 sqrt(t) for lambda = 0.
Motion before the first row is taken to have been steady; steady rows have no history. The kernel is positive: from rest to any state the
force takes energy. In a uniform acceleration a from rest f = C_H 4 rho D sqrt(pi nu t) a.
Source: derived here from the wall friction of Stokes' first problem, summed over past steps (http://cryer.org.uk/Basset_force). The
coefficient agrees with Stokes' and Wang's, whose formula is from general knowledge, not checked.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import pi
from typing import ClassVar, final

import torch
from torch import Tensor

from nnhydro.physics.carried import StepMemory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm, Values, parameter

CHUNK = 512  # rows of the direct sum held at once
RATES = (-16.0, 12.5, 0.5)  # ln of the slowest and the fastest rate in 1/s, and the step between: from 0.1 ms to an hour
EVEN = 1e-6  # steps that differ by less than this share count as even


def _integral(t: Tensor, decay: float) -> Tensor:
    """Return K(t), int_0^t exp(-decay s) / sqrt(s) ds."""
    return 2 * t.sqrt() if decay == 0 else torch.erf((decay * t).sqrt()) * (pi / decay) ** 0.5


def _convolve(t: Tensor, rate: Tensor, decay: float) -> Tensor:
    """The convolution on an even grid, by fast Fourier transform."""
    n, dt = len(t), float(t[-1] - t[0]) / (len(t) - 1)
    whole = _integral(torch.arange(n, dtype=torch.float64) * dt, decay)
    kernel = torch.cat([torch.zeros(1, dtype=torch.float64), whole.diff()])  # weight of the step that ended k - 1 rows ago, at index k
    size = 2 * n
    spectrum = torch.fft.rfft(kernel, size)[:, None] * torch.fft.rfft(rate, size, dim=0)
    convolved: Tensor = torch.fft.irfft(spectrum, size, dim=0)
    return convolved[:n]


def half_derivative(t: Tensor, v: Tensor, decay: float = 0.0) -> Tensor:
    """Return int dv/dt' exp(-decay (t - t')) / sqrt(t - t') dt' (n, k) for `v` (n, k) linear between the times `t` (n,) s; `decay` 1/s."""
    if len(t) < 2:
        return torch.zeros_like(v)
    dt = torch.diff(t)
    rate = torch.diff(v, dim=0) / dt[:, None]
    if float(dt.max() - dt.min()) <= EVEN * float(dt.mean()):
        return _convolve(t, torch.cat([rate, torch.zeros_like(rate[:1])]), decay)
    parts = [torch.zeros_like(v[:1])]
    for first in range(1, len(t), CHUNK):
        rows = t[first:first + CHUNK, None]
        whole = _integral((rows - t).clamp(min=0), decay)
        parts.append((whole[:, :-1] - whole[:, 1:]) @ rate)
    return torch.cat(parts)


@lru_cache(maxsize=1)
def _exponentials() -> tuple[Tensor, Tensor]:
    """Rates r_k 1/s and weights c_k of 1/sqrt(t) ~ sum_k c_k exp(-r_k t): the trapezoidal rule of an integral over ln r, its tail whole."""
    u = torch.arange(*RATES, dtype=torch.float64)
    weights = RATES[2] * torch.exp(u / 2) / pi**0.5
    tail = torch.exp(u[:1] / 2) * (2 / pi**0.5) - weights[:1] / 2
    return torch.cat([torch.zeros(1, dtype=torch.float64), torch.exp(u)]), torch.cat([tail, weights])


def carried_half_derivative(v: Tensor, carried: StepMemory, decay: float = 0.0) -> Tensor:
    """Return `half_derivative` (n, k) of arms that are stepped through time, the past held as a sum of exponentials, to 1e-6.

    Exact over the last step; holds for steps from 0.1 ms on and for a past of an hour.
    """
    slowest, weights = _exponentials()
    rates, width = slowest + decay, len(slowest)

    def integral(rates: Tensor, fades: Tensor, dt: Tensor) -> Tensor:
        """Return int_0^dt exp(-rates s) ds."""
        return torch.where(rates > 0, (1 - fades) / rates.clamp(min=1e-30), dt[..., None])

    def start() -> Tensor:
        none = torch.zeros_like(v)
        return torch.stack([*([none] * width), v, none], dim=2)

    def next_memory(old: Tensor) -> Tensor:
        """Return the memory (n, strips, width + 2) a step after `old`."""
        dt = carried.steps(2)
        past, slope = old[:, :, :width], (v - old[:, :, width]) / (dt + 1e-12)
        fades = torch.exp(-rates * dt)[:, None, :]
        growth, step = integral(rates, fades, dt), 2 * torch.sqrt(dt)
        if decay:
            step = step + (growth - integral(slowest, torch.exp(-slowest * dt)[:, None, :], dt)) @ weights
        half = (past * fades) @ weights + slope * step
        return torch.cat([past * fades + slope[..., None] * growth, v[..., None], half[..., None]], dim=2)

    return carried.value("boundary layer", start, next_memory)[:, :, width + 1]


@final
@dataclass(frozen=True)
class HistoryForce(LinearTerm):
    """Basset's force across each link."""

    kind: ClassVar[str] = "history_force"
    C_H: Values = parameter("1", 1.0, (0.0, 10.0), "history coefficient (1: thin laminar boundary layer, attached flow)")
    decay: Values = parameter("1/s", 0.0, (0.0, 100.0), "rate lambda at which the memory fades (0: Basset's)", per="arm", linear=False,
                              absent=True)

    def loads(self, flow: Flow) -> tuple[Tensor, Tensor]:
        """Return force (n, links) N along n_i and moment (n, links) N m about the link's own joint, for C_H = 1."""
        if flow.motion.carried is None and flow.motion.steady:
            return torch.zeros_like(flow.A), torch.zeros_like(flow.A)
        v, carried, decay = torch.cat([flow.A, flow.B], dim=1), flow.motion.carried, sum(self.decay)
        found = half_derivative(flow.motion.t, v, decay) if carried is None else carried_half_derivative(v, carried, decay)
        slope, offset = found.chunk(2, dim=1)
        k, L = 2 * flow.rho * flow.D * (pi * flow.nu) ** 0.5, flow.L
        return k * (slope * L**2 / 2 + offset * L), k * (slope * L**3 / 3 + offset * L**2 / 2)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d C_H, (n, joints, links)."""
        return flow.normal_columns(*self.loads(flow))
