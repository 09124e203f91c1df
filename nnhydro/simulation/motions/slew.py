"""Slews from rest to rest through a list of stops, all joints together, with pauses in between.

Source: McLain & Rock (1998), section 4 (constant acceleration and deceleration; fifth-order splines).
"""

from typing import Annotated, Literal, Self, final

import numpy as np
from pydantic import Field, model_validator

from nnhydro.errors import require
from nnhydro.simulation.motions.motion_kind import Array, Setting, TimedMotion, Way
from nnhydro.simulation.motions.profiles import SlewProfile, peak_acceleration, slew_shape
from nnhydro.simulation.recipe.per_joint import PerJoint, one_each

Seconds = Annotated[float, Field(gt=0, le=3600)]


@final
class Slew(TimedMotion):
    """Slews through the stops `q_rad`; `duration_s` (one, or one a leg) or `acceleration_rad_s2`, the peak
    of the joint with the longest way.

    `ramp_share` is the share of a leg in which a trapezoid speeds up; `pause_s` the rest at each stop between two legs.
    """

    kind: Literal["slew"] = "slew"
    q_rad: tuple[PerJoint, ...] = Field(min_length=2, max_length=1000)
    duration_s: Seconds | tuple[Seconds, ...] | None = None
    acceleration_rad_s2: float | None = Field(default=None, gt=0, le=1e5)
    profile: SlewProfile = "minimum_jerk"
    ramp_share: float = Field(default=1 / 3, gt=0, le=0.5)
    pause_s: float = Field(default=0.0, ge=0, le=600)

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.duration_s is None) == (self.acceleration_rad_s2 is None):
            raise ValueError("give either duration_s or acceleration_rad_s2")
        return self

    def _legs(self, way: Array) -> Array:
        """Duration (legs,) s of each leg; `way` (legs, joints) rad."""
        if self.acceleration_rad_s2 is not None:
            furthest = np.abs(way).max(axis=1)
            require(bool((furthest > 0).all()), f"{self.key('q_rad')}: two stops in a row are the same: remove one or use pause_s")
            return np.asarray(np.sqrt(peak_acceleration(self.profile, self.ramp_share) * furthest / self.acceleration_rad_s2))
        given = np.atleast_1d(np.array(self.duration_s, dtype=float))
        require(len(given) in (1, len(way)), f"{self.key('duration_s')}: {len(given)} numbers for {len(way)} leg(s): give one, or one a "
                "leg")
        return np.broadcast_to(given, (len(way),))

    def path(self, setting: Setting) -> Way:
        """Return the time from the first to the last stop, s, and the path through them."""
        stops = np.array([one_each(stop, setting.arm.n_links, f"{self.key('q_rad')}[{i}]") for i, stop in enumerate(self.q_rad)])
        way = np.diff(stops, axis=0)
        legs = self._legs(way)
        start = np.concatenate([[0.0], np.cumsum(legs + self.pause_s)[:-1]])

        def joints(t: Array) -> tuple[Array, Array, Array]:
            """Return angles rad, rates rad/s and accelerations rad/s^2 of the joints (n, joints) at the times `t` (n,) s."""
            leg = np.clip(np.searchsorted(start, t, side="right") - 1, 0, len(legs) - 1)
            T = legs[leg][:, None]
            share, rate, bend = slew_shape(self.profile, (t[:, None] - start[leg][:, None]) / T, self.ramp_share)
            return stops[leg] + way[leg] * share, way[leg] * rate / T, way[leg] * bend / T**2

        return Way(float(start[-1] + legs[-1]), joints)
