"""A gap-free, evenly sampled stretch of a recording with every derivative in place: what fits and comparisons work on."""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.filtering.low_pass import LowPass

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Segment:
    """Motion and torque on an even grid (or rows of a steady table); the torque is low-passed as the model's will be."""

    recording: str
    t: Array  # (n,) s; for steady rows the row number
    q: Array  # (n, links) rad
    qd: Array  # (n, links) rad/s
    qdd: Array  # (n, links) rad/s^2
    u0: Array  # (n,) m/s
    du0: Array  # (n,) m/s^2
    tau: Array | None  # (n, links) N m, passed through `low_pass` where there is one
    keep: NDArray[np.bool_]  # (n,) rows that are compared: ends that the filter touches are False
    low_pass: LowPass | None = None  # the filter that torque and model pass through when they are compared
    tau_sim: Array | None = None  # (n, links) N m, filtered as tau
    tau_raw: Array | None = None  # (n, links) N m, on the same grid, not filtered
    steady: bool = False
    start_row: int = 0  # first row of the recording that belongs to this stretch
    stop_row: int = 0  # one past the last row
    base: Array | None = None  # (n, 2) m/s, rad/s: velocity of the base along +X and its yaw rate
    dbase: Array | None = None  # (n, 2) m/s^2, rad/s^2
    heading: Array | None = None  # (n,) rad of the base
    current: Array | None = None  # (n, 2) m/s of the water along +X, +Y
    dcurrent: Array | None = None  # (n, 2) m/s^2
    other_qdd: Array | None = None  # (2, n, links) rad/s^2: where `qdd` is fused of all channels, as recorded and of the others alone
    motion_noise: Array | None = None  # (draws, 3, n, links): what is left of noise in q, qd, qdd, drawn anew
    sliding: bool = False  # of a linear axis: m and N where others have rad and N m

    def __post_init__(self) -> None:
        """Complete what belongs together: accelerations that are not given are 0."""
        for rate, slope in (("base", "dbase"), ("current", "dcurrent")):
            if getattr(self, rate) is not None and getattr(self, slope) is None:
                object.__setattr__(self, slope, np.zeros_like(getattr(self, rate)))
        if self.base is not None and self.heading is None:
            object.__setattr__(self, "heading", np.zeros(len(self.t)))

    def __len__(self) -> int:
        return len(self.t)

    @property
    def dt(self) -> float:
        """Grid spacing, s (1 for steady rows)."""
        return float(self.t[1] - self.t[0]) if len(self.t) > 1 else 1.0

    @property
    def n_links(self) -> int:
        """Number of joints."""
        return int(self.q.shape[1])

    def joint_states(self) -> dict[str, Array]:
        """Return angle, rate and acceleration (n,) of every joint by their column names."""
        return {name: x[:, j] for j in range(self.n_links) for name, x in
                ((f"q{j + 1}_rad", self.q), (f"dq{j + 1}_rad_s", self.qd), (f"ddq{j + 1}_rad_s2", self.qdd))}

    def filter(self, model: Array) -> Array:
        """Return `model` (n, ...), a torque or columns of one on this grid, as it is compared: through the same filter as the torque."""
        return model if self.low_pass is None else self.low_pass.apply(model, self.dt)
