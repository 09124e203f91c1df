"""Compare coefficient models on a few motions: each motion held out in turn, errors by phase of the motion.

    error = sum |tau - model| / sum |tau|      over the compared rows of all held-out motions, and of one phase

A row is compared where the carriage moves faster than a share of the motion's peak: near rest nothing is left to divide by.
Phases: speeding up, steady, slowing down, and all that comes after the first reversal. Source: McLain & Rock (1998), footnote 1 (error);
the protocol is ours.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.fitting.linear.penalised_fit import bend_rows, penalised_over_scales
from nnhydro.fitting.linear.variable_projection import reduce, separable, solve
from nnhydro.fitting.travel.state_rows import rows_of
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, tensor
from nnhydro.physics.travel.state_model import with_tau_s
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
PHASES: Final = ("speeding up", "steady", "slowing down", "after a reversal")
STEADY = 0.02  # of the motion's largest acceleration


@final
@dataclass(frozen=True, eq=False)
class TowedMotion:
    """A motion of the carriage with its torques; `keep` (n,) are the compared rows."""

    name: str
    flow: Flow
    tau: Array  # (n, joints) N m
    keep: NDArray[np.bool_]

    @staticmethod
    def of(segment: Segment, arm: Arm, slowest: float, until_s: float = np.inf) -> "TowedMotion":
        """Return the motion of a segment; compared are rows faster than `slowest` times the peak carriage speed, before `until_s`."""
        assert segment.tau is not None
        speed = np.abs(segment.u0)
        keep = segment.keep & (speed > slowest * speed.max()) & (segment.t <= until_s)
        return TowedMotion(segment.recording, Flow(arm, Motion.of(segment)), segment.tau, keep)

    def fresh(self) -> Flow:
        """Return the flow anew."""
        return Flow(self.flow.arm, self.flow.motion)

    def phase(self) -> NDArray[np.str_]:
        """Return the phase of each row (n,)."""
        u, du = (x.numpy() for x in (self.flow.motion.u0, self.flow.motion.du0))
        change = np.where(np.abs(du) > STEADY * np.abs(du).max(), np.sign(u * du), 0.0)
        names = np.array([PHASES[1], PHASES[0], PHASES[2]])[change.astype(int)]
        moving = np.where(np.abs(u) > STEADY * np.abs(u).max(), np.sign(u), 0.0)
        first = moving[np.flatnonzero(moving)[0]] if moving.any() else 1.0
        return np.where(np.cumsum(moving == -first) > 0, PHASES[3], names)


@final
@dataclass(frozen=True)
class Candidate:
    """A model to be fitted: its terms, the grids of its travel scales (none: nothing to search), and whether bends are penalised."""

    name: str
    loads: Loads
    grid: tuple[Array, ...] = ()
    weights: Array | None = None  # of the penalty, the best chosen on held-out motions of the fit
    fitted: bool = True


@final
@dataclass
class _Rows:
    """Rows of a candidate for each motion and travel scale, computed once."""

    candidate: Candidate
    known: dict[tuple[str, tuple[float, ...]], Array] = field(default_factory=dict)

    def block(self, motion: TowedMotion, nu: tuple[float, ...]) -> Array:
        """The reduced rows of one motion at the shape parameter `nu`, computed once."""
        key = (motion.name, nu)
        if key not in self.known:
            X, y = rows_of(self.candidate.loads, [(motion.flow, tensor(motion.tau))])(nu or (1.0,))
            self.known[key] = reduce(X[motion.keep].reshape(-1, X.shape[2]), y[motion.keep].ravel())
        return self.known[key]


def _fit(rows: _Rows, motions: Sequence[TowedMotion]) -> Loads:
    """Fit a candidate to `motions`, at the best value of its shape parameter."""
    candidate = rows.candidate
    if not candidate.fitted:
        return candidate.loads

    def at(nu: tuple[float, ...]) -> Array:
        return np.stack([rows.block(motion, nu) for motion in motions])

    if candidate.weights is not None:
        nu, chosen = penalised_over_scales(at, candidate.grid, bend_rows(candidate.loads), candidate.weights)
        return with_tau_s(candidate.loads, *nu).with_linear(chosen.theta)
    if not candidate.grid:
        return candidate.loads.with_linear(solve(at(())).theta)
    found = separable(at, candidate.grid)
    return with_tau_s(candidate.loads, *found.nu).with_linear(found.theta)


@final
@dataclass(frozen=True, eq=False)
class Outcome:
    """Errors of one candidate: pooled over held-out motions, by motion and by phase."""

    error: float
    by_motion: dict[str, float]
    by_phase: dict[str, float]


def _outcome(motions: Sequence[TowedMotion], models: Mapping[str, Loads]) -> Outcome:
    """Errors of models on motions, as a whole and by phase."""
    residual = {motion.name: np.abs(motion.tau - models[motion.name].torque(motion.fresh()).numpy()) for motion in motions}

    def ratio(rows: Mapping[str, NDArray[np.bool_]]) -> float:
        size = sum(float(np.abs(motion.tau[rows[motion.name]]).sum()) for motion in motions)
        return sum(float(residual[motion.name][rows[motion.name]].sum()) for motion in motions) / size if size else float("nan")

    nothing = {motion.name: np.zeros_like(motion.keep) for motion in motions}
    by_phase = {phase: ratio({motion.name: motion.keep & (motion.phase() == phase) for motion in motions}) for phase in PHASES}
    return Outcome(ratio({motion.name: motion.keep for motion in motions}),
                   {motion.name: ratio({**nothing, motion.name: motion.keep}) for motion in motions},
                   {phase: error for phase, error in by_phase.items() if np.isfinite(error)})


def leave_one_out(candidate: Candidate, motions: Sequence[TowedMotion]) -> Outcome:
    """Return the errors of `candidate` on each motion, fitted to the others."""
    rows = _Rows(candidate)
    return _outcome(motions, {motion.name: _fit(rows, [other for other in motions if other is not motion]) for motion in motions})


def fit_and_predict(candidate: Candidate, motions: Sequence[TowedMotion], unseen: Sequence[TowedMotion]) -> tuple[Loads, Outcome]:
    """Return `candidate` fitted to all `motions` and its errors on motions of another kind."""
    fitted = _fit(_Rows(candidate), motions)
    return fitted, _outcome(unseen, {motion.name: fitted for motion in unseen})

