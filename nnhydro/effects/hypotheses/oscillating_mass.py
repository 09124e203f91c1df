"""Hypothesis: a part of the mass swings on the link."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import final

import numpy as np
import torch
from torch import Tensor

from nnhydro.effects.effect import ANY_SIZE, LoadEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow, sum_over_links
from nnhydro.physics.motion import tensor

TINY = 1e-300
Pair = tuple[Tensor, Tensor]  # real and imaginary part


@effect
@final
@dataclass(frozen=True)
class OscillatingMass(LoadEffect):
    """A damped spring between a place on a link and a part of the mass that arm.yaml states."""

    id = "oscillating_mass"
    family = "transmission"  # a spring with a load on it: beside a soft drive at the same place it cannot be told
    name = "mass that swings on a link"
    mechanism = "Liquid in a tank, a hanging load or a soft tool swings: below its frequency it moves with the link, above it stays behind."
    equation = ("tau = J_n^T m (s' - a),  s' = -(2 pi f)^2 y - 4 pi f zeta y',  y' = s - w;  w, a: normal velocity and acceleration of "
                "the link at x = c L from its joint")
    source = ("La Cava & Lackner, Theory Manual for the Tuned Mass Damper Module in OpenFAST, equation of TMD_X, without the frame's "
              "rotation: https://github.com/OpenFAST/openfast, docs/source/user/servodyn-stc/StC_Theory.rst")
    signature = Signature(
        depends_on=("qdd", "t"), parity="odd", region="about one frequency; ringing after a stop",
        excited_by="oscillations below, at and above its frequency; stops with holds after them",
        mistaken_for=("joint_elasticity", "backlash", "payload_mass", "added_mass"),
    )
    acts = "link"

    mass: Values = parameter("kg", 0.5, ANY_SIZE, "mass that swings, counted at the end of the link: m c^2", per="arm")
    frequency: Values = parameter("Hz", 1.0, (0.05, 50.0), "its natural frequency f", per="arm", linear=False,
                                  grid=(0.3, 0.45, 0.7, 1.0, 1.5, 2.3, 3.5, 5.0))
    # less damped, its resonance is as narrow as the line of a motion of eight periods, 1/(2 pi 8): not told from this line
    # and more damped, it is not larger at its frequency than at rest, 1/(2 zeta) < 1: it follows, and does not swing
    damping: Values = parameter("1", 0.05, (0.02, 0.5), "damping ratio zeta", per="arm", linear=False, grid=(0.03, 0.15))
    place: Values = parameter("1", 1.0, (0.1, 1.2), "its place c: share of the link's length from the joint", per="arm", linear=False,
                           grid=(0.5, 1.0))

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d mass, (n, joints, 1)."""
        at, c = self.joint - 1, self.place[0]
        w, a = (x[:, at] for x in flow.arm_memo.of(("normal motion", c), lambda: normal_motion(flow, c)))
        force = torch.zeros_like(flow.phi)
        force[:, at] = (self._acceleration(flow, w) - a) / c**2
        return sum_over_links(flow.normal_columns(force, force * c * flow.L))[..., None]

    @property
    def _root(self) -> complex:
        """lambda = 2 pi f (-zeta + i sqrt(1 - zeta^2)), 1/s."""
        zeta = self.damping[0]
        return 2 * pi * self.frequency[0] * complex(-zeta, sqrt(1 - zeta**2))

    def _acceleration(self, flow: Flow, w: Tensor) -> Tensor:
        """s' (n,) m/s^2 of the mass where the link has the normal velocity w (n,) m/s.

            Z' = lambda (Z - w),   y = Im Z / Im lambda,   s' = Im(lambda^2 (Z - w)) / Im lambda;    w straight between the rows
        """
        root, motion = self._root, flow.motion
        if motion.carried is not None:
            name = f"oscillating mass/{self.joint}/{self.frequency[0]}/{self.damping[0]}/{self.place[0]}"

            def following(old: Tensor) -> Tensor:
                """Return Z and w (n, 3) after a step from `old`."""
                re, im = _step((old[:, 0], old[:, 1]), old[:, 2], w, root, motion.carried.dt)  # type: ignore[union-attr]
                return torch.stack([re, im, w], dim=1)

            Z = motion.carried.value(name, lambda: torch.stack([w, torch.zeros_like(w), w], dim=1), following)
            re, im = Z[:, 0] - w, Z[:, 1]
        elif motion.steady or len(w) < 2:
            return torch.zeros_like(w)
        else:
            re, im = _run(motion.t, w, root)
        square = root**2
        return (square.real * im + square.imag * re) / root.imag

    def quantities(self) -> dict[str, Quantity]:
        """Return the mass that it would be at the end of the link, m c^2, frequency, damping, its place, and the mass itself.

        Where the link's joint is fixed, only the product is determined.
        """
        return {"mass_at_end": Quantity(self.mass[0], "kg"), "frequency": Quantity(self.frequency[0], "Hz"),
                "damping": Quantity(self.damping[0], "1"), "place": Quantity(self.place[0], "1"),
                "mass": Quantity(self.mass[0] / self.place[0] ** 2, "kg")}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"A mass swings on link {self.joint} at {text['frequency']}, as {text['mass_at_end']} at the link's end would, with a "
                f"damping ratio of {text['damping']}: liquid in a tank, a hanging load or a soft tool. The fit places it at "
                f"{text['place']} of the link's length, where it is {text['mass']}.")


def normal_motion(flow: Flow, c: float) -> Pair:
    """Return the velocity and the acceleration of each link across it at `c` of its length, (n, links) m/s and m/s^2."""
    dry = replace(flow, water=None, motion=replace(flow.motion, current=None))
    return dry.B + dry.A * c * dry.L, dry.N + dry.M * c * dry.L


def _step(Z: Pair, before: Tensor, now: Tensor, root: complex, dt: Tensor) -> Pair:
    """Z after a step: E Z + (1 - E) w_before + (1 + p - E) (w_now - w_before) / p,   p = lambda dt, E = exp(p)."""
    fade, turn = torch.exp(root.real * dt), root.imag * dt
    re, im = fade * torch.cos(turn), fade * torch.sin(turn)
    p_re, p_im, size = root.real * dt, root.imag * dt, (abs(root) ** 2 * dt**2).clamp(min=TINY)
    up, across = 1 + p_re - re, p_im - im
    change = now - before
    return (re * Z[0] - im * Z[1] + (1 - re) * before + (up * p_re + across * p_im) / size * change,
            re * Z[1] + im * Z[0] - im * before + (across * p_re - up * p_im) / size * change)


def _run(t: Tensor, w: Tensor, root: complex) -> Pair:
    """D = Z - w (n,) at even times `t` (n,), from a mass that moves with the link."""
    from scipy.signal import lfilter

    p = root * float(t[-1] - t[0]) / (len(t) - 1)
    E, rate = np.exp(p), w.numpy()
    change = np.diff(rate, prepend=rate[:1])
    short = lfilter([1.0], [1.0, -E], -(E - 1) / p * change)
    return tensor(short.real), tensor(short.imag)  # E D_(k-1) - (E - 1)/p change_k
