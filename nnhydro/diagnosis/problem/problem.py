"""The data of a diagnosis: stretches of recordings on band-limited grids, cut into blocks, and the cosine transform that compares them.

    x_k = sqrt(2 dt / n) sum_m x(t_m) cos(pi k (m + 1/2) / n),   f_k = k / (2 n dt) <= edge        [unit of x times s^(1/2)]

The orthonormal discrete cosine transform nearly diagonalises stationary noise and keeps sums of squares; scaled with sqrt(dt) its rows do
not depend on the sampling rate. Rows above the band's edge are left out on both sides: model and measurement pass the same band.
Source: Ahmed, Natarajan & Rao (1974), IEEE Trans. Computers C-23.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import CampaignError
from nnhydro.physics.memo import Memo
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.band import Band, band_of
from nnhydro.recordings.filtering.computed_slopes import LeftOut, without_computed_slopes
from nnhydro.recordings.filtering.cutoff import require_cutoff
from nnhydro.recordings.filtering.preprocessing import resample, stretches
from nnhydro.recordings.filtering.trajectory import ROW_RATE, ROWS_PER_PERIOD, band_limited, trajectory
from nnhydro.recordings.recording import Recording
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit
from nnhydro.recordings.surroundings import with_heading

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FEWEST_BLOCKS = 16  # fewest blocks in all: noise and held-out scores need so many independent stretches
FEWEST_PERIODS = 6.0  # fewest periods of the band's edge in a block
MARGIN = 0.5  # periods of the band's edge cut from either end of a stretch, where the second derivative of a spline is least certain
MOST_STUDIED = 60  # most recordings of a diagnosis: more rarely sharpen a name, and cost memory and time


@final
@dataclass(frozen=True, eq=False)
class Stretch:
    """A gap-free run of rows of one recording (number `group`), or one steady table; `place` (n,) -1 to 1 over the campaign where known."""

    group: int
    name: str
    segment: Segment
    place: Array | None

    @cached_property
    def memo(self) -> Memo:
        """What the sensors see of the stretch where a model is the truth: computed once for all rounds of the search."""
        return Memo()

    def at_constant_rates(self) -> "Stretch":
        """Return the stretch as if the arm kept each of its rates."""
        return replace(self, segment=replace(self.segment, qdd=0 * self.segment.qdd, other_qdd=None))

    def at_rest(self) -> "Stretch":
        """Return the stretch as if the arm rested at each of its angles, in water at rest."""
        s = self.segment
        return replace(self, segment=replace(s, qd=0 * s.qd, qdd=0 * s.qdd, u0=0 * s.u0, du0=0 * s.du0, base=None, dbase=None,
                                             current=None, dcurrent=None))


@final
@dataclass(frozen=True, eq=False)
class Block:
    """Rows `start` to `stop` of a stretch that are transformed together; `modes` cosines lie within the band."""

    stretch: int
    start: int
    stop: int
    modes: int
    steady: bool


def segments_of(r: Recording, band: Band, sliding: bool = False) -> Iterator[Segment]:
    """Yield the stretches of `r` as band-limited segments, base and water included; `sliding`: of a linear axis."""
    edge = band.torque
    r = with_heading(r)
    for start, stop in stretches(r):
        part = resample(r, start, stop)
        n, dt = len(part), float(part.t[1] - part.t[0])
        rows = min(n, max(int(np.ceil(n * dt * max(edge * ROWS_PER_PERIOD, ROW_RATE))), 16))
        motion = trajectory(part, band.motion, rows)
        keep = np.ones(rows, dtype=bool)
        trim = min(round(MARGIN / edge / (dt * n / rows)), rows // 8)
        keep[:trim] = keep[rows - trim:] = False
        tau, tau_sim = (None if x is None else band_limited(x, rows) for x in (part.tau, part.tau_sim))
        yield Segment(r.name, motion.t, motion.q, motion.qd, motion.qdd, motion.u0, motion.du0, tau, keep, None, tau_sim, tau, False,
                      start, stop, **motion.around, other_qdd=motion.others, motion_noise=motion.noise, sliding=sliding)


def _clock_origin(campaign: Campaign, names: tuple[str, ...]) -> tuple[float, float] | None:
    """Return (first, last) time of day of the campaign, s; None where a recording has none."""
    clocks = [campaign.load(name).clock for name in names]
    if not clocks or any(clock is None or not np.isfinite(clock).any() for clock in clocks):
        return None
    return min(float(np.nanmin(c)) for c in clocks if c is not None), max(float(np.nanmax(c)) for c in clocks if c is not None)


@final
@dataclass(frozen=True, eq=False)
class Problem:
    """Stretches of the recordings `names` in the band up to `edge` Hz, cut into blocks."""

    arm: Arm
    edge: float
    names: tuple[str, ...]
    stretches: tuple[Stretch, ...]
    motion_edge: float | None = None  # Hz, of the band in which the motion is known, where it is another
    left_out: LeftOut = LeftOut()  # recorded rates and accelerations that were computed from the angles

    @property
    def band(self) -> Band:
        """The band of the comparison and of the motion."""
        return Band(self.edge, self.motion_edge or self.edge)

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """Blocks of at least `FEWEST_PERIODS` of the band's edge, at least `FEWEST_BLOCKS` in all where the recordings are long enough."""
        spans = [(np.flatnonzero(stretch.segment.keep), stretch.segment.steady) for stretch in self.stretches]
        shortest = FEWEST_PERIODS / self.edge
        moving = sum(len(rows) * stretch.segment.dt for stretch, (rows, steady) in zip(self.stretches, spans, strict=True) if not steady)
        longest = max(moving / FEWEST_BLOCKS, shortest)
        made = []
        for number, (rows, steady) in enumerate(spans):
            if steady:
                made.append(Block(number, 0, len(rows), len(rows), True))
                continue
            if len(rows) < 8:
                continue
            dt = self.stretches[number].segment.dt
            duration = len(rows) * dt
            count = max(1, min(round(duration / longest), int(duration / shortest)))
            edges = np.linspace(rows[0], rows[-1] + 1, count + 1).astype(int)
            for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
                modes = min(b - a, int(np.floor(2 * (b - a) * dt * self.edge)) + 1)
                made.append(Block(number, a, b, modes, False))
        if not made:
            raise CampaignError("no recording holds enough rows to diagnose: record longer runs (nnhydro check says what is there)")
        return tuple(made)

    def transform(self, block: Block, x: Array) -> Array:
        """Return the rows (modes, ...) of `x` (n, ...), given on the rows of the block's stretch; steady rows as they are."""
        from scipy.fft import dct

        part = x[block.start:block.stop]
        if block.steady:
            return part
        dt = self.stretches[block.stretch].segment.dt
        if x.flags.f_contiguous:  # along what lies side by side
            along: Array = dct(part.T, axis=-1, norm="ortho")[..., :block.modes] * np.sqrt(dt)
            return along.T
        result: Array = dct(part, axis=0, norm="ortho")[: block.modes] * np.sqrt(dt)
        return result

    def inverse(self, block: Block, c: Array) -> Array:
        """Return the band-limited rows (block rows, ...) of the coefficients `c` (modes, ...)."""
        from scipy.fft import idct

        if block.steady:
            return c
        dt, n = self.stretches[block.stretch].segment.dt, block.stop - block.start
        full = np.zeros((n, *c.shape[1:]))
        full[: block.modes] = c
        result: Array = idct(full, axis=0, norm="ortho") / np.sqrt(dt)
        return result

    @cached_property
    def frequency(self) -> Array:
        """Frequency of every row, Hz; -1 in steady rows, (n,)."""
        parts = []
        for block in self.blocks:
            dt = self.stretches[block.stretch].segment.dt
            parts.append(np.full(block.modes, -1.0) if block.steady else np.arange(block.modes) / (2 * (block.stop - block.start) * dt))
        return np.concatenate(parts)

    @cached_property
    def block_of(self) -> Index:
        """Number of the block of every row, (n,)."""
        return np.concatenate([np.full(block.modes, i) for i, block in enumerate(self.blocks)])

    @cached_property
    def group_of(self) -> Index:
        """Number of the recording of every row, (n,)."""
        return np.array([self.stretches[block.stretch].group for block in self.blocks])[self.block_of]

    @property
    def groups(self) -> int:
        """Number of recordings and steady tables."""
        return 1 + max(stretch.group for stretch in self.stretches)

    @property
    def further_columns(self) -> int:
        """Number of columns, the baseline's last, of how the torque changes with what records of the acceleration disagree in."""
        records = [stretch.segment.other_qdd for stretch in self.stretches]
        return max(0 if record is None else self.arm.n_links * len(record) for record in records)

    def units(self) -> tuple[Unit, ...]:
        """Return the stretches as units for fits of the baseline."""
        return tuple(Unit(stretch.name, stretch.name, stretch.segment.steady, partial(tuple, [stretch.segment]))
                     for stretch in self.stretches)


def draw_names(names: Sequence[str], most: int, seed: int) -> tuple[str, ...]:
    """Return at most `most` of `names`, one drawn from each of as many consecutive stretches."""
    rng = np.random.default_rng(seed)
    stretches = np.array_split(np.arange(len(names)), min(most, max(len(names), 1)))
    return tuple(names[int(rng.choice(stretch))] for stretch in stretches if len(stretch))


def problem_of(campaign: Campaign, names: tuple[str, ...] | None = None, edge: Band | float | None = None,
               left_out: LeftOut | None = None) -> Problem:
    """Return the recordings `names` of `campaign` (all by default) ready for diagnosis; the band's edge in Hz from the data by default.

    `left_out` is what of them was found to be computed; by default it is found here. Raises CampaignError or RecordingError where the data
    cannot be used.
    """
    names = campaign.names if names is None else names
    loaded = [campaign.load(name) for name in names]
    recordings, left_out = without_computed_slopes(loaded) if left_out is None else (left_out.taken_from(loaded), left_out)
    if edge is None:
        edge = band_of(recordings)
    elif not isinstance(edge, Band):
        require_cutoff(edge, [(float(np.median(np.diff(recording.t))), recording.duration) for recording in recordings])
    band = edge if isinstance(edge, Band) else Band(edge, edge)
    clock = _clock_origin(campaign, names)
    made: list[Stretch] = []
    for group, (name, recording) in enumerate(zip(names, recordings, strict=True)):
        for segment in segments_of(recording, band, campaign.arm.sliding):
            place = None
            if clock is not None and recording.clock is not None:
                time = recording.clock[segment.start_row] + segment.t - recording.t[segment.start_row]
                place = 2 * (time - clock[0]) / max(clock[1] - clock[0], 1e-9) - 1
            made.append(Stretch(group, name, segment, place))
    for number, (table, segment) in enumerate(zip(campaign.steady, campaign.steady_segments(), strict=True)):
        made.append(Stretch(len(names) + number, table.name, segment, None))
    if not made:
        raise CampaignError("no recording holds a stretch of finite rows long enough to diagnose: see nnhydro check")
    return Problem(campaign.arm, band.torque, names, tuple(made), band.motion, left_out)
