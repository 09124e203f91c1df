"""A trained memory that all strips share: a layer of states that fade and turn over the way, as fast as the strip's own motion says.

    e = tanh(A x),   rate = FASTEST sigmoid(G (e^2, r) + g),   d = D e
    h <- keep turn^2 h + (1 - keep) turn d,   keep = exp(-rate dsigma),   turn = exp(i (theta dsigma + kappa ds)/2)
    y = c (1 + P p) [tanh(v + o) - tanh(v - o)]/2 + S x,   o = B (e, odd h, X),   v = C (even h, r) + b
    f = rho D V^2 y + rho D (|w| w, D dw, ...) theta_0                                                              [N/m]

x are odd in the mirror, r and p even. p is where the strip lies: it makes the load of every neuron larger or smaller, by nothing before
training. dsigma is the way on the clock of the wake, ds the signed way, in diameters; rate and d hold in mid step. Half of the states swing
over the way and are odd. Half keep what was left at a place of the water: their real part is odd, the imaginary one even. So y is exactly
odd. X, the acceleration, is not remembered. Stable by construction: keep < 1 and |turn| = 1, so |h| <= max |d|. Rotations are written with
cosines and sines, as exports know them.
Source: Gu & Dao (2023), arXiv 2312.00752 (rates that follow the input);
Orvieto et al. (2023), arXiv 2303.06349 (diagonal complex states); the places are ours.
"""

from dataclasses import dataclass, fields
from typing import Any, final

import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.features.wake import STILL, each_under_way, under_way
from nnhydro.models.learned.network import tanh
from nnhydro.models.learned.strip_inputs import StripInputs, arm_columns, drift, sensor_torque
from nnhydro.physics.flow import Flow

FASTEST = 6.0  # a diameter
ROWS = 1024  # of a run whose loads are computed at a time
WIDENING = 3.0  # as in learned.py: a third beyond halves what is used


def recurrence(keep_re: Tensor, keep_im: Tensor, re: Tensor, im: Tensor) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return keep and h, complex (n, s, k), of h_t = keep_t h_{t-1} + re_t + i im_t; h_0 = re_0 + i im_0."""
    a, h = torch.complex(keep_re, keep_im).numpy(), torch.complex(re, im).numpy()
    for now, keep, before in zip(h[1:], a[1:], h, strict=False):
        now += keep * before
    return a, h


def real_and_imaginary(h: NDArray[Any]) -> tuple[Tensor, Tensor]:
    """Return both parts of a complex array (n, s, k)."""
    return torch.from_numpy(h.real.copy()), torch.from_numpy(h.imag.copy())


@final
@dataclass(frozen=True, eq=False)
class StripNet:
    """The net as it was learned, its inputs' scales, and coefficients of plain loads and of the body's (features/body_columns.py)."""

    spread: Tensor  # (odd,)
    middle: Tensor  # (even,)
    wide: Tensor  # (even,)
    lowest: Tensor  # (even,) of r in training
    highest: Tensor  # (even,)
    drift: Tensor  # (1,) m^2/s^2: largest square of the base's speed in training
    inner: Tensor  # A (odd - 1, size)
    drive: Tensor  # D (size, 3 k): real and imaginary part of states that swing, real part of places; k = size/2
    gate: Tensor  # G (size + 1, 2 k)
    gate_bias: Tensor  # g (2 k,)
    theta: Tensor  # (k,) a diameter
    kappa: Tensor  # (k,) a diameter
    odd: Tensor  # B (size + 3 k + 1, size)
    even: Tensor  # C (k + 1, size)
    even_bias: Tensor  # b (size,)
    out: Tensor  # c (size, 1)
    place: Tensor  # P (even - 1, size)
    skip: Tensor  # S (odd, 1)
    plain: Tensor  # (PLAIN,)
    body: Tensor  # (columns,) of `arm_columns`

    @property
    def size(self) -> int:
        """Numbers of a strip's state: real and imaginary parts of 2 k states."""
        return 4 * len(self.theta)

    def encode(self, z: StripInputs) -> tuple[Tensor, Tensor, Tensor]:
        """Return e (n, s, size), rate and d (n, s, 5 k) side by side, and r with p (n, s, even), scaled, within what was trained."""
        r = (torch.minimum(torch.maximum(z.r, self.lowest), self.highest) - self.middle) / self.wide
        e = tanh((z.x[..., :-1] / self.spread[:-1]) @ self.inner)
        rate = FASTEST * torch.sigmoid(torch.cat([e**2, r[..., :1]], dim=-1) @ self.gate + self.gate_bias)
        return e, torch.cat([rate, e @ self.drive], dim=-1), r

    def half_turns(self, middle: Tensor, way: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        """Return what a step keeps, cosine and sine of half its turn, and what states fade to, real and imaginary, (n, s, 2 k).

        middle (n, s, 5 k) are rate and d in mid step, way (n, s, 2) its dsigma and ds in diameters.
        """
        k = len(self.theta)
        rate, re, im, place = torch.split(middle, [2 * k, k, k, k], dim=-1)
        dsigma, ds = way[..., :1], way[..., 1:]
        half = torch.cat([self.theta / 2 * dsigma, self.kappa / 2 * ds], dim=-1)
        real, imaginary = torch.cat([re, place], dim=-1), torch.cat([im, torch.zeros_like(place)], dim=-1)
        return torch.exp(-rate * dsigma), torch.cos(half), torch.sin(half), real, imaginary

    def increments(self, middle: Tensor, way: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return what a step keeps and what it adds, each real and imaginary, (n, s, 2 k), of the same as `half_turns`."""
        keep, cos, sin, real, imaginary = self.half_turns(middle, way)
        c, s = (1 - keep) * cos, (1 - keep) * sin
        return keep * (1 - 2 * sin**2), 2 * keep * sin * cos, c * real - s * imaginary, s * real + c * imaginary

    def load(self, z: StripInputs, e: Tensor, r: Tensor, re: Tensor, im: Tensor) -> Tensor:
        """Return the load (n, s) (D/s)^2 of states re + i im (n, s, 2 k)."""
        x = z.x / self.spread
        swung, unturned = im.chunk(2, dim=-1)
        o = torch.cat([e, re, swung, x[..., -1:]], dim=-1) @ self.odd
        v = torch.cat([unturned, r[..., :1]], dim=-1) @ self.even + self.even_bias
        y = ((tanh(v + o) - tanh(v - o)) / 2 * (1 + r[..., 1:] @ self.place)) @ self.out + x @ self.skip
        return z.speeds[..., 0] ** 2 * y[..., 0] + z.plain @ self.plain

    def lasting(self, both: Tensor, speeds: Tensor) -> tuple[Tensor, Tensor]:
        """Return the states (n, s, 2 k) of a flow that has lasted: (rate - i turning) h = rate d."""
        k = len(self.theta)
        rate, re, im, place = torch.split(both, [2 * k, k, k, k], dim=-1)
        sense = speeds[..., 1:] / speeds[..., :1]
        turning = torch.cat([self.theta + 0 * sense, self.kappa * sense], dim=-1)
        real, imaginary = torch.cat([re, place], dim=-1), torch.cat([im, 0 * place], dim=-1)
        share = rate / (rate**2 + turning**2)
        return share * (rate * real - turning * imaginary), share * (rate * imaginary + turning * real)

    def states(self, flow: Flow, z: StripInputs, both: Tensor) -> tuple[Tensor, Tensor]:
        """Return the states (n, s, 2 k), real and imaginary part, of a run, of a step, or of a flow that has lasted."""
        if flow.motion.carried is not None:
            return self._step(flow, torch.cat([both, z.speeds], dim=-1), torch.cat(self.lasting(both, z.speeds), dim=-1))
        if flow.motion.steady or len(flow.motion) < 2:
            return self.lasting(both, z.speeds)
        return self._over_time(z, both, flow.motion.t, self.lasting(both[:1], z.speeds[:1]) if under_way(flow) else None)

    def _over_time(self, z: StripInputs, both: Tensor, t: Tensor, begun: tuple[Tensor, Tensor] | None) -> tuple[Tensor, Tensor]:
        """The states of rows of a run that begin with those `begun` (1, s, 2 k), real and imaginary part; None: in water at rest."""
        dt = torch.diff(t, prepend=t[:1])[:, None, None]
        middle, speeds = ((x + x.roll(1, 0)) / 2 for x in (both, z.speeds))  # no step leads to the first row: dt is 0
        keep, turned, re, im = self.increments(middle, speeds * dt)
        if begun is not None:
            re[:1], im[:1] = begun
        return real_and_imaginary(recurrence(keep, turned, re, im)[1])

    def _step(self, flow: Flow, now: Tensor, lasting: Tensor) -> tuple[Tensor, Tensor]:
        carried, size = flow.motion.carried, self.size
        assert carried is not None

        def start() -> Tensor:
            moves = each_under_way(flow)[:, None, None]
            return torch.cat([torch.where(moves, lasting, torch.zeros_like(lasting)), now], dim=-1).mT

        def following(old: Tensor) -> Tensor:
            """Return states, rates and speeds a step after `old`, (n, size + 5 k + 2, s): strips side by side, for fast exports."""
            (re, im), before = old.mT[..., :size].chunk(2, dim=-1), old.mT[..., size:]
            middle = (now + before) / 2
            keep, cos, sin, real, imaginary = self.half_turns(middle[..., :-2], middle[..., -2:] * carried.steps(3))
            lag, turned = cos * re - sin * im - real, sin * re + cos * im - imaginary  # half a turn, less what it fades to
            there, aside = real + keep * lag, imaginary + keep * turned
            return torch.cat([cos * there - sin * aside, sin * there + cos * aside, now], dim=-1).mT

        re, im = carried.value("strip_net", start, following).mT[..., :size].chunk(2, dim=-1)
        return re, im

    def _loads(self, flow: Flow, z: StripInputs) -> Tensor:
        """The loads (n, s) (D/s)^2, of a long run ROWS at a time: what lies between stays near the processor."""
        motion = flow.motion
        if motion.carried is not None or motion.steady or len(motion) <= ROWS:
            e, both, r = self.encode(z)
            return self.load(z, e, r, *self.states(flow, z, both))
        found: list[Tensor] = []
        begun: tuple[Tensor, Tensor] | None = None
        for start in range(0, len(motion), ROWS):
            rows = slice(max(start - 1, 0), start + ROWS)  # a part begins with the last row of the one before
            part = StripInputs(*(getattr(z, field.name)[rows] for field in fields(z)))
            e, both, r = self.encode(part)
            if not start and under_way(flow):
                begun = self.lasting(both[:1], part.speeds[:1])
            re, im = self._over_time(part, both, motion.t[rows], begun)
            found.append(self.load(part, e, r, re, im)[min(start, 1):])
            begun = re[-1:], im[-1:]
        return torch.cat(found)

    def validity(self, flow: Flow) -> Tensor:
        """Return how far a net may be used of whose training the base moved slower (n, 1): 1, and towards 0 where it moves faster.

        To a strip a tow is a motion among others. What it does to the wake of an arm is not known from arms that slew.
        """
        beyond = (drift(flow) / (self.drift + STILL**2) - 1).clamp(min=0.0)
        return 1 / (1 + (WIDENING * beyond[:, None]) ** 2)

    def torque(self, flow: Flow) -> Tensor:
        """Return the sensor torques (n, joints) N m beside those of the rigid body."""
        load = self._loads(flow, StripInputs.of(flow))
        return sensor_torque(flow, load[..., None])[..., 0] + arm_columns(flow) @ self.body

    def arrays(self) -> dict[str, Tensor]:
        """Return the tensors that a model file holds."""
        return {field.name: getattr(self, field.name) for field in fields(self)}
