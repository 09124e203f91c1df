"""What a rig allows: what its recordings have shown, or what its user states in a file of limits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PrivateAttr

from nnhydro.errors import ConfigError, count_text, require
from nnhydro.recordings.readers.validation import Settings, validate
from nnhydro.recordings.readers.yaml_file import read_yaml
from nnhydro.recordings.segment import Segment
from nnhydro.simulation.motions.motion_kind import State
from nnhydro.simulation.recipe.per_joint import Magnitude

Array = NDArray[np.float64]
LONGEST = 60.0  # s: longest proposed motion
TORQUE_MARGIN = 1.1  # torque of a proposed motion over the largest measured one, if no limit of the drive is stated
Span = tuple[float, float]
Each = Magnitude | Annotated[tuple[Magnitude, ...], Field(min_length=1, max_length=10)]  # one number for all joints, or one per joint


@final
class Limits(Settings):
    """What the user of a rig says it can do; what is left out is taken from the recordings."""

    q_rad: Annotated[tuple[Span, ...], Field(min_length=1, max_length=10)] | None = None  # lowest and highest angle of each joint
    dq_rad_s: Each | None = None
    ddq_rad_s2: Each | None = None
    u0_m_s: float | None = Field(default=None, ge=0, le=100)
    tau_Nm: Each | None = None
    seconds: float | None = Field(default=None, gt=0, le=3600)
    _file: str = PrivateAttr(default="")  # that states them

    def check(self, joints: int) -> None:
        """Raise ConfigError if the numbers do not fit an arm of so many joints."""
        where = f"{self._file}: " if self._file else "limits: "
        if self.q_rad is not None:
            require(len(self.q_rad) == joints, f"{where}q_rad has {count_text(len(self.q_rad), 'range')} for an arm of "
                    f"{count_text(joints, 'joint')}: give one [lowest, highest] a joint")
            require(all(low < high for low, high in self.q_rad), f"{where}q_rad: a range is [lowest, highest], the lower angle first")
        for key in ("dq_rad_s", "ddq_rad_s2", "tau_Nm"):
            given = getattr(self, key)
            if isinstance(given, tuple):
                require(len(given) == joints, f"{where}{key} lists {count_text(len(given), 'number')} for an arm of "
                        f"{count_text(joints, 'joint')}: list one per joint, or give one number without brackets for all")


def read_limits(path: Path) -> Limits:
    """Return the limits in a YAML file; raise ConfigError with one line where it is not one."""
    limits = validate(Limits, read_yaml(path, ConfigError), str(path), ConfigError)
    limits._file = str(path)
    return limits


@final
@dataclass(frozen=True, eq=False)
class Rig:
    """What the rig allows: angles (joints, 2) rad, rates and accelerations (joints,), carriage speed m/s, torque (joints,) N m, time s."""

    q: Array
    rate: Array
    acceleration: Array
    u0: float
    tau: Array
    seconds: float
    stated: bool = False  # whether the user states any of it

    @staticmethod
    def of(segments: Sequence[Segment]) -> "Rig":
        """Return the limits that the moving recordings stayed in: nobody knows from them that the rig can do more."""
        rows = [(segment, segment.keep) for segment in segments if not segment.steady and segment.keep.any()]
        q = np.concatenate([segment.q[keep] for segment, keep in rows])
        tau = [segment.tau[keep] for segment, keep in rows if segment.tau is not None]
        return Rig(np.stack([q.min(axis=0), q.max(axis=0)], axis=1),
                   np.max([np.abs(segment.qd[keep]).max(axis=0) for segment, keep in rows], axis=0),
                   np.max([np.abs(segment.qdd[keep]).max(axis=0) for segment, keep in rows], axis=0),
                   float(max(np.abs(segment.u0).max() for segment, _ in rows)),
                   TORQUE_MARGIN * np.max([np.abs(x).max(axis=0) for x in tau], axis=0),
                   float(min(np.median([segment.t[-1] - segment.t[0] for segment, _ in rows]), LONGEST)))

    def with_limits(self, limits: Limits | None) -> "Rig":
        """Return the rig with what `limits` states in place of what was shown.

        Raises ConfigError where numbers and joints do not go together.
        """
        if limits is None:
            return self
        joints = len(self.q)
        limits.check(joints)

        def each(given: float | tuple[float, ...] | None, shown: Array) -> Array:
            return shown if given is None else np.broadcast_to(np.array(given, dtype=float), (joints,))

        q = self.q if limits.q_rad is None else np.array(limits.q_rad, dtype=float)
        return replace(self, q=q, rate=each(limits.dq_rad_s, self.rate),
                       acceleration=each(limits.ddq_rad_s2, self.acceleration),
                       u0=self.u0 if limits.u0_m_s is None else limits.u0_m_s, tau=each(limits.tau_Nm, self.tau),
                       seconds=min(self.seconds if limits.seconds is None else limits.seconds, LONGEST), stated=True)

    def allows(self, state: State) -> bool:
        """Return whether the motion stays within the limits; the torque is for the caller to judge."""
        def within(x: Array, most: Array | float) -> bool:
            return bool((np.abs(x) <= np.asarray(most) * (1 + 1e-6) + 1e-9).all())

        inside = bool(((state.q >= self.q[:, 0] - 1e-6) & (state.q <= self.q[:, 1] + 1e-6)).all())
        return inside and within(state.qd, self.rate) and within(state.qdd, self.acceleration) and within(state.u0, self.u0)
