"""Sum of sines at every joint, faded in and out so that angle, rate and acceleration begin and end at rest.

    q_j = q_0,j + W(t) sum_k a_jk sin(2 pi f_jk t + p_jk)           [rad]

    W   1 in the middle, a minimum-jerk step over `fade_s` at either end                                              [-]

Amplitudes, frequencies and phases are given, or drawn from the motion's own stream (amplitude falling as 1/f, so that each sine brings
about the same rate) and scaled to the reach and rate allowed. Source: Swevers et al. (1997), IEEE Trans. Robotics Autom. 13(5) for
Fourier excitation; the fade is ours.
"""

from typing import Annotated, Literal, Self, final

import numpy as np
from pydantic import Field, model_validator

from nnhydro.errors import require
from nnhydro.simulation.motions.motion_kind import Array, Setting, TimedMotion, Way
from nnhydro.simulation.motions.profiles import ramp_profile, slew_shape
from nnhydro.simulation.recipe.per_joint import PerJoint, PerJointMagnitude, one_each, spread

Frequency = Annotated[float, Field(gt=0, le=1000)]
GRID = 64  # points per period of the highest sine when the largest angle and rate are sought: 0.1 % of a peak between points
MARGIN = 0.998  # what a peak between two points may add


def sines(t: Array, amplitude: Array, frequency: Array, phase: Array) -> tuple[Array, Array, Array]:
    """Return sum_k a sin(w t + p) and two derivatives, (n, joints); `amplitude`, `frequency` Hz, `phase` (joints, k)."""
    w = 2 * np.pi * frequency
    angle = w * t[:, None, None] + phase
    return ((amplitude * np.sin(angle)).sum(-1), (amplitude * w * np.cos(angle)).sum(-1), -(amplitude * w**2 * np.sin(angle)).sum(-1))


@final
class Fourier(TimedMotion):
    """Sines about `q_rad`, stated (`amplitude_rad`, `frequency_hz`, `phase_rad`: lists per joint) or drawn (`count`, `band_hz`, limits)."""

    kind: Literal["fourier"] = "fourier"
    q_rad: PerJoint
    duration_s: float = Field(gt=0, le=3600)
    fade_s: float = Field(default=1.0, gt=0, le=600)
    amplitude_rad: tuple[PerJoint, ...] | None = None
    frequency_hz: tuple[Frequency, ...] | None = Field(default=None, min_length=1, max_length=10)
    phase_rad: tuple[PerJoint, ...] | None = None
    count: int = Field(default=5, ge=1, le=10)
    band_hz: tuple[Frequency, Frequency] = (0.1, 1.0)
    reach_rad: PerJointMagnitude | None = None
    rate_rad_s: PerJointMagnitude | None = None

    @model_validator(mode="after")
    def _given_or_drawn(self) -> Self:
        """Sines are either given one by one, or drawn within a reach and a rate."""
        given = (self.amplitude_rad is not None, self.frequency_hz is not None)
        drawn = (self.reach_rad is not None, self.rate_rad_s is not None)
        if not ((all(given) and not any(drawn)) or (all(drawn) and not any(given) and self.phase_rad is None)):
            raise ValueError("give amplitude_rad and frequency_hz (and phase_rad), or reach_rad and rate_rad_s for drawn sines")
        if self.band_hz[0] >= self.band_hz[1]:
            raise ValueError("band_hz must rise: [lowest, highest]")
        if 2 * self.fade_s > self.duration_s:
            raise ValueError("fade_s must be at most half of duration_s")
        return self

    def _fade(self, t: Array, amplitude: Array, frequency: Array, phase: Array) -> tuple[Array, Array, Array]:
        """The windowed sum and its derivatives, by the product rule."""
        x, dx, ddx = sines(t, amplitude, frequency, phase)
        _, w, dw = (y[:, None] for y in ramp_profile("minimum_jerk", t, self.fade_s, self.duration_s - 2 * self.fade_s))
        bend = [slew_shape("minimum_jerk", (t - begin) / self.fade_s, 0.5)[2] / self.fade_s**2
                for begin in (0.0, self.duration_s - self.fade_s)]
        ddw = (bend[0] - bend[1])[:, None]
        return w * x, w * dx + dw * x, w * ddx + 2 * dw * dx + ddw * x

    def _stated_sines(self, joints: int) -> tuple[Array, Array, Array]:
        """Amplitude, frequency and phase (joints, sines) as the recipe gives them."""
        assert self.amplitude_rad is not None
        assert self.frequency_hz is not None
        shape = (joints, len(self.frequency_hz))
        phase = self.phase_rad if self.phase_rad is not None else ((0.0,) * shape[1],) * joints
        for name, rows in (("amplitude_rad", self.amplitude_rad), ("phase_rad", phase)):
            found = (len(rows), sorted({len(row) for row in rows}))
            require(found == (joints, [shape[1]]), f"{self.key(name)}: needs {joints} list(s), one per joint, of {shape[1]} number(s) "
                    "each, one per frequency")
        return np.array(self.amplitude_rad), np.broadcast_to(np.array(self.frequency_hz), shape), np.array(phase)

    def _draw_sines(self, joints: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
        """Amplitude, frequency and phase (joints, sines), drawn and scaled to reach and rate."""
        assert self.reach_rad is not None
        assert self.rate_rad_s is not None
        shape = (joints, self.count)
        frequency = rng.uniform(*self.band_hz, shape)
        amplitude, phase = rng.uniform(0.3, 1.0, shape) / frequency, rng.uniform(0.0, 2 * np.pi, shape)
        points = int(self.duration_s * max(self.band_hz[1], 1.0 / self.fade_s) * GRID)
        require(points * joints * self.count <= 20_000_000, f"{self.key('duration_s')}: too long for sines up to {self.band_hz[1]} Hz: "
                "shorten it or lower band_hz")
        x, dx, _ = self._fade(np.linspace(0.0, self.duration_s, points + 2), amplitude, frequency, phase)
        reach = spread(self.reach_rad, joints, self.key("reach_rad")) / np.abs(x).max(axis=0)
        rate = spread(self.rate_rad_s, joints, self.key("rate_rad_s")) / np.abs(dx).max(axis=0)
        return MARGIN * np.minimum(reach, rate)[:, None] * amplitude, frequency, phase

    def path(self, setting: Setting) -> Way:
        """Return `duration_s` and the faded sines about `q_rad`."""
        joints = setting.arm.n_links
        centre = one_each(self.q_rad, joints, self.key("q_rad"))
        coefficients = self._stated_sines(joints) if self.amplitude_rad is not None else self._draw_sines(joints, setting.rng)

        def path(t: Array) -> tuple[Array, Array, Array]:
            q, qd, qdd = self._fade(t, *coefficients)
            return centre + q, qd, qdd

        return Way(self.duration_s, path)
