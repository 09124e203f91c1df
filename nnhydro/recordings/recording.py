"""What one file holds: a recording (a run of the arm against time) or a steady table (one row per run)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import RecordingError, require

Array = NDArray[np.float64]

SURROUNDINGS = ("u0", "du0", "base", "dbase", "heading", "current", "dcurrent")  # what moves besides the joints
PAIRS = {"base": ("base_x", "base_yaw"), "dbase": ("dbase_x", "dbase_yaw"), "current": ("current_x", "current_y"),
         "dcurrent": ("dcurrent_x", "dcurrent_y")}  # channels that lie side by side in one array
MOTION = ("q", "qd", "qdd", *SURROUNDINGS)


def _freeze(instance: object) -> None:
    """Replace every array of a frozen dataclass by an own, read-only float64 copy."""
    for each in fields(instance):  # type: ignore[arg-type]
        value = getattr(instance, each.name)
        if isinstance(value, np.ndarray) and value.dtype != bool:
            frozen = np.array(value, dtype=float)
            frozen.setflags(write=False)
            object.__setattr__(instance, each.name, frozen)


def _require_shapes(name: str, shape: tuple[int, int], **channels: Array | None) -> None:
    for channel, array in channels.items():
        if array is not None:
            wanted = shape if array.ndim == 2 else shape[:1]
            require(array.shape == wanted, f"{name}: {channel} has shape {array.shape}, expected {wanted}", RecordingError)


@dataclass(frozen=True)
class Origin:
    """Where the numbers came from: the file, its sha256, how it was read, and which of its columns were not."""

    path: str = ""
    sha256: str = ""
    reader: str = "memory"
    unused: tuple[str, ...] = ()
    stated: Mapping[str, str] = field(default_factory=dict)  # unit of each column that the user stated: taken as given where possible
    mapped: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # by channel, what the column mapping says of it


@final
@dataclass(frozen=True, eq=False)
class Recording:
    """One run of the arm. SI units, time first, joints from the base outwards. Never changed in place.

    Angles are joint-relative whatever the encoders saw; rows may be unevenly spaced, hold NaN and have gaps: `prepare` splits there.
    """

    name: str
    t: Array  # (n,) s
    q: Array  # (n, links) rad
    tau: Array | None = None  # (n, links) N m, what the torque sensors read; None where only the motion is known
    qd: Array | None = None  # (n, links) rad/s
    qdd: Array | None = None  # (n, links) rad/s^2
    u0: Array | None = None  # (n,) m/s; None: the carriage stood still
    du0: Array | None = None  # (n,) m/s^2
    tau_sim: Array | None = None  # (n, links) N m, the user's own simulation
    clock: Array | None = None  # (n,) s, time of day
    base: Array | None = None  # (n, 2) m/s, rad/s: velocity of the base along +X and its yaw rate; along +Y it moves at u0
    dbase: Array | None = None  # (n, 2) m/s^2, rad/s^2
    heading: Array | None = None  # (n,) rad of the base; None: the integral of its yaw rate, 0 at the first row
    current: Array | None = None  # (n, 2) m/s, velocity of the water along +X, +Y; None: at rest
    dcurrent: Array | None = None  # (n, 2) m/s^2
    origin: Origin = Origin()
    steps: tuple[str, ...] = ()  # what has been done to it since it was read, in order
    stamps: Array | None = None  # (n,) s, the times as they stand in the file, where some of them repeat there
    integrated: bool = False  # whether the angles were computed from the rates: they are no measurement of their own

    def __post_init__(self) -> None:
        _freeze(self)
        require(self.q.ndim == 2, f"{self.name}: q has shape {self.q.shape}, expected (n, links)", RecordingError)
        _require_shapes(self.name, (len(self.t), self.q.shape[1]), t=self.t, q=self.q, tau=self.tau, qd=self.qd, qdd=self.qdd,
                        u0=self.u0, du0=self.du0, tau_sim=self.tau_sim, clock=self.clock, heading=self.heading, stamps=self.stamps)
        _require_shapes(self.name, (len(self.t), 2), base=self.base, dbase=self.dbase, current=self.current, dcurrent=self.dcurrent)

    def __len__(self) -> int:
        return len(self.t)

    @property
    def n_links(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    @property
    def duration(self) -> float:
        """Time from the first to the last row, s."""
        return float(self.t[-1] - self.t[0]) if len(self) else 0.0

    def rows(self, keep: NDArray[np.bool_] | slice, step: str) -> "Recording":
        """Return the recording with the rows `keep`, `step` noted in its history."""
        changes = {name: getattr(self, name)[keep] for name in ("t", "tau", "tau_sim", "clock", "stamps", *MOTION)
                   if getattr(self, name) is not None}
        return replace(self, **changes, steps=(*self.steps, step))

    def without_torque(self) -> "Recording":
        """Return the motion alone."""
        return replace(self, tau=None, tau_sim=None, steps=(*self.steps, "torque removed"))


@final
@dataclass(frozen=True, eq=False)
class SteadyTable:
    """A table of steady runs, one row per run: locked tows and constant rotations, torques averaged over the run."""

    name: str
    run: tuple[str, ...]  # (n,) name of each run
    q: Array  # (n, links) rad
    qd: Array  # (n, links) rad/s
    u0: Array  # (n,) m/s
    tau: Array  # (n, links) N m
    tau_std: Array | None = None  # (n, links) N m, scatter of the torque within the run
    tau_sim: Array | None = None  # (n, links) N m
    origin: Origin = Origin()
    base: Array | None = None  # (n, 2) m/s, rad/s: steady velocity of the base along +X and its yaw rate
    heading: Array | None = None  # (n,) rad
    current: Array | None = None  # (n, 2) m/s

    def __post_init__(self) -> None:
        _freeze(self)
        _require_shapes(self.name, (len(self.run), self.q.shape[1]), q=self.q, qd=self.qd, u0=self.u0, tau=self.tau,
                        tau_std=self.tau_std, tau_sim=self.tau_sim, heading=self.heading)
        _require_shapes(self.name, (len(self.run), 2), base=self.base, current=self.current)

    @property
    def state(self) -> Array:  # (n, ...)
        """All that says what the arm did in each run, side by side."""
        return np.column_stack([self.q, self.qd, self.u0, *(x for x in (self.base, self.heading, self.current) if x is not None)])

    def __len__(self) -> int:
        return len(self.run)

    def rows(self, keep: NDArray[np.bool_] | NDArray[np.int64]) -> "SteadyTable":
        """Return the table with the rows `keep`."""
        index = np.flatnonzero(keep) if keep.dtype == bool else keep
        changes = {name: getattr(self, name)[index] for name in ("q", "qd", "u0", "tau", "tau_std", "tau_sim", "base", "heading", "current")
                   if getattr(self, name) is not None}
        return replace(self, run=tuple(self.run[i] for i in index), **changes)
