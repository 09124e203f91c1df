"""The rows of a diagnosis in the cosine domain: baseline columns, the torque to be explained, and the columns of hypotheses.

    y = Y z + sum_k X_k beta_k + ...         rows (n,) of all blocks, joints (j,), columns last

The last columns of Y hold, a joint, how the torque changes from the fused acceleration (z = 0) to the one that was recorded (z = 1), and
to the slope of the recorded rate. Columns of hypotheses are made in columns.py.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from nnhydro.diagnosis.constants import FORM, RELEVANT, RHO
from nnhydro.diagnosis.problem.baseline import Baseline
from nnhydro.diagnosis.problem.columns import columns_on, disagreement
from nnhydro.diagnosis.problem.free_machines import require_motion, scale_direction, shares_of_largest
from nnhydro.diagnosis.problem.hypothesis import Hypothesis, enumerate_hypotheses
from nnhydro.diagnosis.problem.motion_range import MotionRange
from nnhydro.diagnosis.problem.problem import Problem, Stretch
from nnhydro.fitting.linear.least_squares import ridge
from nnhydro.fitting.linear.statistics import columns_and_offset
from nnhydro.models.stated_terms import STATED_COULOMB, STATED_VISCOUS
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion
from nnhydro.physics.transmission import sensor_torque
from nnhydro.recordings.filtering.trajectory import NOISE_DRAWS

Array = NDArray[np.float64]
EXCITED = 0.99  # share of the inertia's torque between the slowest and the quickest part of a motion
WAVE_PERIODS = 2.0  # fewest periods of a wave in the longest recording; with fewer it is a drift
SMOOTHED = 7  # frequencies over which a variance is averaged


@final
@dataclass(frozen=True, eq=False)
class Design:
    """Rows of all blocks: `Y` (n, joints, p) baseline columns for z ~ N(0, 1), `y` (n, joints) what is to explain, `tau` as measured."""

    problem: Problem
    baseline: Baseline
    Y: Array
    y: Array
    tau: Array
    scale_spread: float = 0.0  # relative standard deviation of the held scale of all torques: where nothing is driven, masses alone tell it

    def rows(self, on_stretch: Callable[[Stretch], Array]) -> Array:
        """Return the transformed rows (n, joints, ...) of what `on_stretch` gives on the rows of each stretch."""
        found, of = np.zeros(0), -1
        made: Array | None = None
        start = 0
        for block in self.problem.blocks:
            if block.stretch != of:
                found, of = on_stretch(self.problem.stretches[block.stretch]), block.stretch
            if made is None:
                made = np.empty((len(self.problem.block_of), *found.shape[1:]))
            made[start:start + block.modes] = self.problem.transform(block, found)
            start += block.modes
        assert made is not None
        return made

    def columns(self, hypotheses: Sequence[Hypothesis], model: StripTheory, predicted: bool = False) -> Array:
        """Return the columns (n, joints, K) of `hypotheses`, instruments at the reading of `model`; of free machines X - a M."""
        made = self.rows(lambda stretch: columns_on(hypotheses, model, stretch, predicted))
        return made - (self.tau - self.y)[..., None] * self.shares_of_model(hypotheses, model) if self.undriven else made

    def shares_of_model(self, hypotheses: Sequence[Hypothesis], model: StripTheory | None = None) -> Array:
        """Return how much of the model's largest part the columns of `hypotheses` hold, (K,); 0 where the machine is driven.

        Of the weight, it counts what they hold at rest: laws of rates or accelerations resemble it, but do not lift it. Of the inertia,
        it counts what depends on accelerations.
        """
        if not self.undriven:
            return np.zeros(sum(hypothesis.width for hypothesis in hypotheses))
        known = model or self.baseline.at(np.zeros(self.Y.shape[2]))

        def on(stretch: Stretch) -> Array:
            """Return what counts of the columns on a stretch, predicted."""
            if self.heavy:
                return columns_on(hypotheses, known, stretch.at_rest(), True)
            return columns_on(hypotheses, known, stretch, True) - columns_on(hypotheses, known, stretch.at_constant_rates(), True)

        return shares_of_largest(self, self.rows(on))

    @cached_property
    def scale(self) -> Array:
        """The torque's rms (joints,) that sets the scale of effects: as measured; where nothing is driven, what the baseline leaves.

        Nothing driven is resisted by the drag that the baseline has, too: an effect may be as large, however much of it drag can take.
        """
        if self.undriven:
            measured = np.maximum(np.sqrt((self.excess**2).sum(axis=0) / self.duration), self.resistance)
        else:
            measured = np.sqrt((self.tau**2).sum(axis=0) / self.duration)
        made: Array = np.maximum(measured, 1e-3 * max(float(measured.max()), 1e-12))
        return made

    @cached_property
    def left(self) -> Array:
        """How many times RHO of a driven torque the recalibrated baseline leaves, (joints,), at least 1: so large an effect may be."""
        if self.undriven:  # what is left is the scale itself
            return np.ones(self.y.shape[1])
        made: Array = np.maximum(np.sqrt((self.excess**2).sum(axis=0) / self.duration) / (RHO * np.maximum(self.scale, 1e-300)), 1.0)
        return made

    @cached_property
    def excess(self) -> Array:
        """What the recalibrated baseline alone leaves, (n, joints)."""
        left: Array = self.y - self.Y @ self._recalibrated
        return left

    @cached_property
    def stated_friction(self) -> Array:
        """The torque (n, joints) of the friction that arm.yaml states: known in size, but in form no better than one that is found."""
        arm, loads = self.problem.arm, self.baseline.at(np.zeros(self.Y.shape[2])).loads
        stated = Loads({name: term for name, term in loads.terms.items() if name in (STATED_COULOMB, STATED_VISCOUS)})
        if not stated.terms:
            return np.zeros_like(self.y)

        def torque(stretch: Stretch) -> Array:
            """Return the friction as the sensors read it, (n, joints) N m."""
            motion = Motion.of(stretch.segment)
            made: Array = sensor_torque(stated.torque(Flow(arm, motion)), motion.qd, arm).numpy()
            return made

        return self.rows(torque)

    @cached_property
    def _recalibrated(self) -> Array:
        """The baseline's values (p,) by a ridge fit in which no joint outweighs the other, over an error as large as the torque at most.

        Where coefficients start far from what they are, the torque to explain is many times what was measured.
        """
        n, joints, p = self.Y.shape
        to_explain, measured = (np.sqrt((x**2).mean(axis=0)) for x in (self.y, self.tau))
        size = np.maximum(np.where(measured > 0, np.minimum(to_explain, measured), to_explain), 1e-300)
        return ridge((self.Y / size[:, None]).reshape(n * joints, p), (self.y / size).ravel())

    @cached_property
    def duration(self) -> float:
        """Duration of all rows, s, steady rows counted as 1: sums of squares over it are mean squares."""
        stretches = self.problem.stretches
        return float(sum((block.stop - block.start) * (1.0 if block.steady else stretches[block.stretch].segment.dt)
                         for block in self.problem.blocks))

    @cached_property
    def resistance(self) -> Array:
        """The rms (joints,) of what the recalibrated baseline's torque depends on rates."""
        loads = self.baseline.at(self.baseline.within(self._recalibrated)).loads

        def by_rates(stretch: Stretch) -> Array:
            """Return the torque less that of the same angles and accelerations without rates, (n, joints) N m."""
            flow = Flow(self.problem.arm, Motion.of(stretch.segment))
            still = replace(flow, motion=replace(flow.motion, qd=0 * flow.motion.qd))
            made: Array = (loads.torque(flow) - loads.torque(still)).numpy()
            return made

        made: Array = np.sqrt((self.rows(by_rates) ** 2).sum(axis=0) / self.duration)
        return made

    @cached_property
    def _weight_and_inertia(self) -> Array:
        """The model's weight and its inertia, (n, joints, 2): what resists the motion is as large as both together where nothing drives."""
        def on(stretch: Stretch) -> Array:
            """Return the weight and the inertia's torque of the model on a stretch, (n, joints, 2) N m."""
            flow = Flow(self.problem.arm, Motion.of(stretch.segment))
            starting = replace(flow, motion=replace(flow.motion, qd=0 * flow.motion.qd))
            still = replace(flow, motion=replace(starting.motion, qdd=0 * flow.motion.qdd))
            loads = self.baseline.physics.loads
            weight = loads.torque(still).numpy()
            return np.stack([weight, loads.torque(starting).numpy() - weight], axis=2)

        return self.rows(on)

    @cached_property
    def part_rms(self) -> Array:
        """The rms of the model's weight and of its inertia's torque, (joints, 2)."""
        made: Array = np.sqrt((self._weight_and_inertia**2).sum(axis=0) / self.duration)
        return made

    @property
    def excited(self) -> tuple[float, float]:
        """The frequencies, Hz, below and above which the share 1 - EXCITED of the inertia's torque lies, all joints weighted equally."""
        power = (self._weight_and_inertia[..., 1] ** 2).sum(axis=0)
        shares = (self._weight_and_inertia[..., 1] ** 2 / np.maximum(power, 1e-300)).sum(axis=1)
        order = np.argsort(self.problem.frequency)
        below = np.cumsum(shares[order])
        low, high = (int(np.searchsorted(below, share * below[-1])) for share in (1 - EXCITED, EXCITED))
        return (float(self.problem.frequency[order[low]]), float(self.problem.frequency[order[high]])) if below[-1] > 0 else (0.0, 0.0)

    @property
    def largest_part(self) -> Array:
        """The largest part of the model, (n, joints): weight or inertia."""
        return self._weight_and_inertia[..., 0 if self.heavy else 1]

    @cached_property
    def input_variance(self) -> Array:
        """The variance (n, joints) of what is left of the motion's noise in the model's torque, averaged over frequencies."""
        loads, arm = self.baseline.physics.loads, self.problem.arm

        def squares(stretch: Stretch) -> Array:
            """Return the changes (n, joints, draws) N m of the torque by the noise of a stretch."""
            s = stretch.segment
            if s.motion_noise is None:
                return np.zeros((*s.q.shape, NOISE_DRAWS))
            noisy = [replace(s, q=s.q + q, qd=s.qd + qd, qdd=s.qdd + qdd) for q, qd, qdd in s.motion_noise]
            torque, *others = loads.torques([Flow(arm, Motion.of(segment)) for segment in (s, *noisy)])
            return np.stack([(other - torque).numpy() for other in others], axis=2)

        power = (self.rows(squares) ** 2).mean(axis=2)
        made: Array = np.empty_like(power)
        for i in range(len(self.problem.blocks)):
            at = self.problem.block_of == i
            made[at] = uniform_filter1d(power[at], min(SMOOTHED, int(at.sum())), axis=0, mode="nearest")
        return made

    @property
    def heavy(self) -> bool:
        """Whether the weight sets the scale: it varies half as much as the inertia's torque or more; one that hardly varies is carried."""
        moving = np.where(self.problem.frequency == 0, 0.0, 1.0)[:, None, None]
        weight, inertia = np.sqrt(((moving * self._weight_and_inertia) ** 2).sum(axis=0)).max(axis=0)
        return bool(weight >= 0.5 * inertia)

    @property
    def part_scale(self) -> Array:
        """The rms (joints,) of the largest part of the model."""
        made: Array = self.part_rms.max(axis=1)
        return made

    @cached_property
    def undriven(self) -> bool:
        """Whether the measured torque is nothing beside the model's parts: a free pendulum, a rolling ship."""
        measured = np.sqrt((self.tau**2).sum(axis=0) / self.duration)
        return bool((measured < 1e-3 * self.part_scale).all())


def relevant_share(design: Design, squares: Array) -> float:
    """Return the share of the torque's rms that a claim moves at least where rows of these `squares` (n, joints) (N m)^2 s remain.

        min(RELEVANT, sqrt(FORM) min_j sqrt(sum_n squares_nj / time) / scale_j)
    """
    left = np.sqrt(squares.sum(axis=0) / design.duration) / np.maximum(design.scale, 1e-300)
    return float(min(RELEVANT, FORM**0.5 * left.min()))


def design_of(problem: Problem, baseline: Baseline) -> Design:
    """Return the rows of `problem` against `baseline`; where nothing is driven, the common scale of the inertial parameters is held."""
    further = problem.further_columns

    def build(base: Baseline) -> Design:
        """Return the rows of all blocks against the baseline `base`."""
        def on(stretch: Stretch) -> Array:
            """Return baseline columns, what is to explain and the measured torque N m on a stretch, (n, joints, p + 2)."""
            segment = stretch.segment
            Y, c0 = columns_and_offset(base.physics.loads, segment, problem.arm)
            assert segment.tau is not None
            y, YF = base.target(segment, Y, c0), Y @ base.prior.F
            YF[..., YF.shape[2] - further:] = disagreement(base, segment, c0 + Y @ base.prior.mean, further)
            made: Array = np.nan_to_num(np.concatenate([YF, y[..., None], segment.tau[..., None]], axis=2))
            return made

        empty = Design(problem, base, *(np.zeros(0),) * 3)
        stacked = empty.rows(on)
        return Design(problem, base, stacked[..., :-2], stacked[..., -2], stacked[..., -1])

    first = build(baseline.with_more(further))
    if not first.undriven:
        return first
    require_motion(problem)
    direction = scale_direction(first)
    spread = float(np.linalg.norm(direction)) / max(float((first.largest_part**2).sum()), 1e-300)
    return replace(build(first.baseline.with_fixed(direction)), scale_spread=spread)


def hypotheses_for(design: Design, without: Sequence[str] = ()) -> tuple[Hypothesis, ...]:
    """Return every hypothesis that makes sense for the arm and the torques of `design`.

    What has a frequency has it within the band; what swings with the motion between the slowest and the quickest parts of the motion. With
    a phase per recording, fewer than WAVE_PERIODS in the longest are a drift of any cause.
    """
    measured = [np.abs(stretch.segment.tau).max(axis=0) for stretch in design.problem.stretches if stretch.segment.tau is not None]
    segments = [stretch.segment for stretch in design.problem.stretches]
    made = enumerate_hypotheses(design.problem.arm, tuple(np.max(measured, axis=0).tolist()), without, not design.undriven,
                                MotionRange.of(design.problem))
    longest = max((float(np.ptp(segment.t)) for segment in segments if not segment.steady), default=0.0)
    band, excited = (WAVE_PERIODS / longest if longest > 0 else 0.0, design.problem.edge), design.excited

    def within(h: Hypothesis) -> bool:
        """Return whether the frequency of a hypothesis, if it has one, can show."""
        low, high = band if h.per_recording else excited
        return "frequency" not in h.spans or low <= getattr(h.effect, "frequency")[0] < high  # noqa: B009

    return tuple(filter(within, made))
