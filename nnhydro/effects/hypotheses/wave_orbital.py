"""Hypothesis: a wave moves the water to and fro."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, pi
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.effect import InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.effects.sensor_view import SensorView, unit_vector
from nnhydro.physics.flow import Flow, sum_over_links
from nnhydro.physics.loads.water_pressure import pressure_columns

GRAVITY = 9.81  # m/s^2
SLOPE_STEP = 1e-6  # m/s: a one-sided difference errs by a millionth of the slope, rounding by less
SHORT = 1e-3  # rad of the wave between the middle and an end of a link: its phase is the same along it
TRAVELS = tuple(k * pi / 4 for k in range(-3, 5))  # a wave that runs the other way meets the outer link at another phase


@effect
@final
@dataclass(frozen=True)
class WaveOrbital(InstrumentEffect):
    """Water that oscillates along one direction with one frequency; with a phase per recording."""

    id = "wave_orbital"
    family = "water"
    cause = "waves"
    name = "regular wave"
    mechanism = "A wave passes: the water around the arm oscillates and loads the arm, whether the arm moves or not."
    equation = ("v = (a cos psi + b sin psi) d,  psi = omega t - k d.r,  k = omega^2 / g,  on each link its mean weighted by the lever "
                "about its joint;  reading = tau(relative motion) - displaced mass times dv/dt at a fixed place")
    source = ("k = omega^2 / g: Mainwaring (2019), wave_gazebo_plugins, "
              "https://docs.ros.org/en/melodic/api/wave_gazebo_plugins/html/Physics_8cc_source.html; displaced mass: Rivera (1995), "
              "eq. 2-3, and QBlade, Morison Equation, https://github.com/QBladeOcean/QBladeOceanDocs, "
              "docs/source/src/theory/hydrodynamics/me/me.rst; the water's own acceleration, not the one that the moving link meets: "
              "Xu & Nadim (2015), Electron. J. Differ. Equ. 104, eq. 1.1 (a sphere), https://studylib.net/doc/10766668")
    signature = Signature(
        depends_on=("t", "q", "w"), parity="mixed",
        region="one line in the spectrum at the same frequency whatever the motion, at rest too",
        excited_by="any recording longer than ten periods, rests among them",
        mistaken_for=("vortex_shedding", "torque_ripple", "ambient_current"),
        zero_at_rest=False,
    )
    acts = "arm"
    stage = 0
    needs_water = True
    per_recording = True

    cosine: Values = parameter("m/s", 0.0, (-5.0, 5.0), "velocity of the water at the hub at t = 0", per="arm")
    sine: Values = parameter("m/s", 0.0, (-5.0, 5.0), "velocity a quarter period later", per="arm")
    frequency: Values = parameter("Hz", 0.5, (0.02, 5.0), "frequency seen by an observer at rest", per="arm", linear=False,
                                  grid=tuple(round(0.2 + 0.05 * k, 2) for k in range(23)))
    direction: Values = parameter("rad", 0.0, (-2 * pi, 2 * pi), "direction in which the wave runs, from +X", per="arm", linear=False,
                                  grid=TRAVELS[::2])

    @property
    def _d(self) -> Tensor:  # (2,)
        """The direction as a unit vector."""
        return unit_vector(self.direction[0])

    def _waves(self, seen: SensorView) -> tuple[Tensor, Tensor]:
        """Velocity and acceleration (n, links, 2) along the direction that each link meets of the water, for cosine 1 and sine 1."""
        t, omega = seen.motion.t, 2 * pi * self.frequency[0]
        k = omega**2 / GRAVITY
        psi = omega * t[:, None] - k * seen.memo.of((type(self), "places", self.direction), lambda: self._places(seen))
        j0, j1 = self._means(k * seen.flow.L * (seen.flow.unit_along @ self._d) / 2)
        c, s = j0 * torch.cos(psi) + j1 * torch.sin(psi), j0 * torch.sin(psi) - j1 * torch.cos(psi)
        return torch.stack([c, s], dim=-1), omega * torch.stack([-s, c], dim=-1)

    @staticmethod
    def _means(z: Tensor) -> tuple[Tensor, Tensor]:
        """Return the spherical Bessel functions j0 and j1 of `z`: int_-1^1 (1 + x) e^(-i z x) dx / 2 = j0 - i j1."""
        j0 = torch.sinc(z / pi)
        safe = torch.where(z.abs() < SHORT, SHORT, z)
        return j0, torch.where(z.abs() < SHORT, z / 3, (j0 - torch.cos(z)) / safe)

    def _places(self, seen: SensorView) -> Tensor:
        """How far along the direction the middle of each link is, (n, links) m."""
        motion = seen.motion
        ahead = self._d[1] * motion.u0 + (0.0 if motion.base is None else self._d[0] * motion.base.vx)
        gone = torch.cat([motion.t[:1] * 0, torch.cumulative_trapezoid(ahead, motion.t)])
        return seen.flow.middle @ self._d + gone[:, None]

    def _answers(self, seen: SensorView) -> tuple[Tensor, Tensor]:
        """What velocity and acceleration of the water at each link change in the reading, (n, joints, links) N m s/m, N m s^2/m."""
        by_velocity, by_acceleration = seen.by_water
        pressure = seen.as_read(pressure_columns(seen.flow, *self._d.unbind()))
        return by_velocity @ self._d, by_acceleration @ self._d + pressure

    def columns(self, seen: SensorView) -> Tensor:
        """Return d tau / d (cosine, sine), (n, joints, 2); 0 in steady rows."""
        if seen.motion.steady or len(seen.motion) < 2:
            return torch.zeros(*seen.motion.q.shape, 2, dtype=torch.float64)
        (across, slope), (wave, rate) = seen.memo.of((type(self), self.direction), lambda: self._answers(seen)), self._waves(seen)
        return torch.einsum("nji,nik->njk", across, wave) + torch.einsum("nji,nik->njk", slope, rate)

    def moved_flow(self, seen: SensorView) -> tuple[Flow, Tensor | float]:
        """Return the flow in the wave, and the pressure of its water."""
        if seen.motion.steady or len(seen.motion) < 2:
            return seen.flow, 0.0
        return self._in_wave(seen, self.linear_values(), self._waves(seen))

    def _in_wave(self, seen: SensorView, values: Tensor, waves: tuple[Tensor, Tensor]) -> tuple[Flow, Tensor]:
        """The flow in the wave of these values (2,), and the pressure of its water, (n, joints) N m."""
        velocity, acceleration = ((x @ values)[..., None] * self._d for x in waves)
        pressed = sum_over_links(seen.as_read(pressure_columns(seen.flow, *acceleration.unbind(-1))))
        return seen.flow.in_water(velocity, acceleration), pressed

    def tangent(self, seen: SensorView) -> Tensor:
        """Return d reading / d (cosine, sine) in the wave as it is, (n, joints, 2): its drag grows with the square of its size."""
        return self._tangent_from(seen, self.apply(seen))

    def _tangent_from(self, seen: SensorView, reading: Tensor) -> Tensor:
        if seen.motion.steady or len(seen.motion) < 2:
            return torch.zeros(*reading.shape, 2, dtype=torch.float64)
        steps, waves = SLOPE_STEP * torch.eye(2, dtype=torch.float64), self._waves(seen)
        flows, pressed = zip(*(self._in_wave(seen, self.linear_values() + step, waves) for step in steps), strict=True)
        there = [torque + more for torque, more in zip(seen.torques_of(flows), pressed, strict=True)]
        return torch.stack([(more - reading) / SLOPE_STEP for more in there], dim=-1)

    def quantities(self) -> dict[str, Quantity]:
        """Return amplitude, frequency and direction."""
        return {"amplitude": Quantity(hypot(self.cosine[0], self.sine[0]), "m/s", length=True),
                "frequency": Quantity(self.frequency[0], "Hz"), "direction": Quantity(self.direction[0], "rad")}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"A wave of {text['frequency']} moves the water with an amplitude of {text['amplitude']} along the direction "
                f"{text['direction']} from +X.")
