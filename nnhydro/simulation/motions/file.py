"""A motion from a file: t_s, q1_rad, ..., u0_m_s as in a recording, angles in the arm's own channel convention; torques are ignored.

Angles pass through a quintic spline and the carriage's speed through a cubic one; rates and accelerations are theirs, exactly.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, final

import numpy as np
from pydantic import Field

from nnhydro.errors import require
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import resample, stretches
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.recording import Recording
from nnhydro.simulation.motions.motion_kind import Array, CarriagePath, Setting, TimedMotion, Way


@final
class FileMotion(TimedMotion):
    """The motion in the CSV or Parquet `file`, relative to the recipe; `low_pass_hz` smooths a measured one before it is followed."""

    kind: Literal["file"] = "file"
    file: str = Field(min_length=1, max_length=1000)
    low_pass_hz: float | None = Field(default=None, gt=0, le=1e4)
    rest_s: float = Field(default=0.0, ge=0, le=600)

    def files(self, folder: Path) -> Mapping[str, Path]:
        """Return the one file."""
        return {"file": folder / self.file}

    def _motion(self, setting: Setting) -> Recording:
        """The motion on an even grid."""
        read = read_recording(setting.folder / self.file, setting.arm, torque=False)
        whole = stretches(read, with_torque=False)
        require(whole == ((0, len(read)),), f"{self.key('file')} {self.file}: has gaps or empty values: cut out one whole stretch")
        require(read.u0 is None or self.carriage.u0_m_s == 0, f"{self.key('carriage')}: {self.file} has a column u0_m_s of its own: "
                "remove one of the two")
        return resample(read, 0, len(read))

    def path(self, setting: Setting) -> Way:
        """Return the length of the file, s, and the splines through its angles and carriage speed."""
        from scipy.interpolate import make_interp_spline

        read = self._motion(setting)
        t, smooth = np.asarray(read.t - read.t[0]), LowPass(self.low_pass_hz) if self.low_pass_hz else None

        def low_pass(x: Array) -> Array:
            return smooth.apply(x, float(t[1])) if smooth else x

        angles = make_interp_spline(t, low_pass(read.q), k=5)
        rates, accelerations = angles.derivative(1), angles.derivative(2)
        carriage: CarriagePath | None = None
        if read.u0 is not None:
            speed = make_interp_spline(t, low_pass(read.u0), k=3)
            slope = speed.derivative(1)

            def carriage(at: Array) -> tuple[Array, Array]:
                return np.asarray(speed(at)), np.asarray(slope(at))

        return Way(float(t[-1]), lambda at: (np.asarray(angles(at)), np.asarray(rates(at)), np.asarray(accelerations(at))), carriage)
