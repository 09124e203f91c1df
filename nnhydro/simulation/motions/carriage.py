"""The carriage of the tank: at rest, ramped up to a speed, held there, ramped down; or at constant speed all the time."""

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from nnhydro.errors import require
from nnhydro.recordings.readers.validation import Settings
from nnhydro.simulation.motions.profiles import RampProfile, ramp_profile

Array = NDArray[np.float64]


class Carriage(Settings):
    """Speed u0 in m/s, reached `start_s + ramp_s` after the recording begins and left as long before it ends.

    `ramp_s: 0` means that the carriage had its speed long before the recording began and keeps it.
    """

    u0_m_s: float = Field(default=0.0, ge=-100, le=100)
    start_s: float = Field(default=0.25, ge=0, le=600)
    ramp_s: float = Field(default=1.0, ge=0, le=600)
    profile: RampProfile = "minimum_jerk"

    def require_room(self, duration: float, motion: str) -> None:
        """Raise ConfigError naming `motion` unless both ramps fit into `duration` s."""
        needed = 2 * (self.start_s + self.ramp_s)
        require(self.u0_m_s == 0 or self.ramp_s == 0 or needed <= duration + 1e-9, f"motion {motion!r}: lasts {duration:.6g} s, but the "
                f"carriage needs 2 x (start_s + ramp_s) = {needed:.6g} s to start and stop: raise rest_s or shorten carriage.ramp_s")

    def at(self, t: Array, duration: float) -> tuple[Array, Array]:
        """Return u0 m/s and du0 m/s^2, both (n,), at the times `t` (n,) s of a recording of `duration` s."""
        if self.u0_m_s == 0 or self.ramp_s == 0:
            return np.full(len(t), self.u0_m_s), np.zeros(len(t))
        _, speed, acceleration = ramp_profile(self.profile, t - self.start_s, self.ramp_s, duration - 2 * (self.start_s + self.ramp_s))
        return self.u0_m_s * speed, self.u0_m_s * acceleration
