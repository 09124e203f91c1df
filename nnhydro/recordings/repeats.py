"""Repeats: recordings and steady rows with the same motion, and the noise floor that they give.

    e_i = tau_i - mean over the k repeats,     noise |e| = sqrt(k / (k - 1)) |e_i|

The measured torque of a perfect model's motion differs from the model by the noise alone, so that
sum |noise e| / sum |tau| is what a perfect model would score in McLain & Rock's measure. Differences in the motion itself count as
noise here: the floor is an upper bound. Source: ours; for k = 2 it is |difference| / sqrt(2).
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import MIN_ROWS, Preparation, stretches
from nnhydro.recordings.recording import Recording, SteadyTable
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
GRID = 200  # points on which two motions are compared
SAME = 0.01  # of the range of motion: repeats track one command to better than this
LEAST = 2e-3  # rad, m/s: below it encoders and carriages wander anyway
SAME_STEADY = 1e-3  # rad, rad/s, m/s: steady runs that agree to this repeat each other


@final
@dataclass(frozen=True)
class NoiseFloor:
    """What the repeats say about the noise: standard deviation a joint, and the score of a perfect model."""

    std: tuple[float, ...]  # N m, of the filtered torque
    error: float  # sum |noise| / sum |tau|
    groups: tuple[tuple[str, ...], ...]  # recordings that repeat each other


@final
@dataclass(frozen=True, eq=False)
class Spread:
    """How the repeats of one motion differ: a joint each, and the sums of the error measure."""

    std: Array  # (links,) N m
    rms: Array  # (links,) N m, of the torque
    noise_sum: float  # N m, sum of |noise| over rows and joints
    torque_sum: float  # N m, sum of |tau|
    rows: int


def _motion(r: Recording) -> Array | None:
    """Angles, speeds of carriage, base and water (channels, GRID) over the whole recording; None where it is unusable."""
    usable = stretches(r)
    if not usable:
        return None
    good = np.concatenate([np.arange(a, b) for a, b in usable])
    t = np.asarray(r.t[good])
    grid = np.linspace(t[0], t[-1], GRID)
    channels = [*r.q.T, np.zeros(len(r)) if r.u0 is None else r.u0]
    channels += [x for pair in (r.base, r.current) for x in (np.zeros((2, len(r))) if pair is None else pair.T)]
    return np.array([np.interp(grid, t, x[good]) for x in channels])


def _same(a: Array, b: Array) -> bool:
    """Whether two motions agree in every channel to the tolerance."""
    width = np.maximum(np.ptp(a, axis=1), np.ptp(b, axis=1)).max()
    return bool(np.sqrt(((a - b) ** 2).mean(axis=1)).max() < max(SAME * width, LEAST))


def repeated_recordings(campaign: Campaign) -> tuple[tuple[str, ...], ...]:
    """Return groups of two or more recordings with the same motion, durations equal to 2 %; one recording is held at a time."""
    leaders: list[tuple[float, Array, list[str]]] = []
    for recording in campaign.recordings():
        motion = _motion(recording)
        if motion is None or max(np.ptp(motion, axis=1).max(), np.abs(motion[-1]).max()) <= LEAST:
            continue
        group = next((names for duration, leader, names in leaders
                      if abs(duration - recording.duration) < 0.02 * duration and _same(leader, motion)), None)
        if group is None:
            leaders.append((recording.duration, motion, [recording.name]))
        else:
            group.append(recording.name)
    return tuple(tuple(names) for *_, names in leaders if len(names) > 1)


def copied_recordings(campaign: Campaign) -> tuple[tuple[str, ...], ...]:
    """Return groups of two or more recordings that hold the same numbers, to all digits or fewer: copies of one run, not repeats."""
    leaders: dict[str, str] = {}
    groups: dict[str, list[str]] = {}
    for name in campaign.names:
        known = sorted(campaign.marks(name))
        leader = next((leaders[mark] for mark in known if mark in leaders), name)
        leaders |= dict.fromkeys(known, leader)
        groups.setdefault(leader, []).append(name)
    return tuple(tuple(names) for names in groups.values() if len(names) > 1)


def independent(campaign: Campaign, groups: tuple[tuple[str, ...], ...]) -> tuple[tuple[str, ...], ...]:
    """Return the groups of repeats with one recording of each set of copies; groups of one are left out."""
    copies = {name for copied in copied_recordings(campaign) for name in copied[1:]}
    without_copies = (tuple(name for name in group if name not in copies) for group in groups)
    return tuple(group for group in without_copies if len(group) > 1)


def group_names(campaign: Campaign) -> dict[str, str]:
    """Return {recording: name of its group} for `splitting.units`: recordings that repeat a motion share a fold."""
    return {name: group[0] for group in repeated_recordings(campaign) for name in group}


def repeated_rows(table: SteadyTable) -> tuple[tuple[int, ...], ...]:
    """Return groups of two or more rows of a steady table at the same state."""
    state = np.round(table.state / SAME_STEADY).astype(np.int64)
    _, which = np.unique(state, axis=0, return_inverse=True)
    groups: dict[int, list[int]] = {}
    for row, key in enumerate(which.ravel()):
        groups.setdefault(int(key), []).append(row)
    return tuple(tuple(rows) for rows in groups.values() if len(rows) > 1)


def _spread(tau: Array) -> Spread:
    """Spread of torques (repeats, n, links)."""
    k = len(tau)
    noise = np.sqrt(k / (k - 1)) * (tau - tau.mean(axis=0))
    return Spread(np.sqrt((noise**2).mean(axis=(0, 1))), np.sqrt((tau**2).mean(axis=(0, 1))), float(np.abs(noise).sum()),
                  float(np.abs(tau).sum()), k * tau.shape[1])


def _compared_rows(segments: tuple[Segment, ...]) -> tuple[Array, Array]:
    """Times since the start and filtered torques of the compared rows of one recording."""
    start = segments[0].t[0] if segments else 0.0
    t = [segment.t[segment.keep] - start for segment in segments if segment.tau is not None]
    tau = [segment.tau[segment.keep] for segment in segments if segment.tau is not None]
    return (np.concatenate(t), np.concatenate(tau)) if t else (np.zeros(0), np.zeros((0, 1)))


def _between_rows(grid: Array, t: Array) -> NDArray[np.bool_]:
    """Return which times of `grid` lie between two rows of `t` that follow each other: in gaps nothing is compared."""
    right = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    inside = (grid >= t[0]) & (grid <= t[-1])
    return np.asarray(inside & (t[right] - t[right - 1] < 1.5 * np.median(np.diff(t))))


def scatter(campaign: Campaign, group: tuple[str, ...], how: Preparation) -> Spread | None:
    """Return how the filtered torques of the recordings in `group` differ on the grid of the first; None where they do not overlap."""
    found = [_compared_rows(campaign.segments(name, how)) for name in group]
    if any(len(t) < MIN_ROWS for t, _ in found):
        return None
    grid = found[0][0][np.all([_between_rows(found[0][0], t) for t, _ in found], axis=0)]
    if len(grid) < MIN_ROWS:
        return None
    return _spread(np.array([np.column_stack([np.interp(grid, t, x) for x in tau.T]) for t, tau in found]))


def expected_noise(r: Recording, how: Preparation) -> Array:
    """Return the standard deviation (links,) N m that white noise from row to row leaves after the filter."""
    if r.tau is None or not (usable := stretches(r)):
        return np.zeros(r.n_links)
    a, b = max(usable, key=lambda span: span[1] - span[0])
    white = np.std(np.diff(r.tau[a:b], n=2, axis=0), axis=0) / np.sqrt(6.0)
    if how.low_pass is None:
        return np.asarray(white)
    dt = float(np.median(np.diff(r.t[a:b])))
    f = np.linspace(0.0, 0.5 / dt, 2000)
    return np.asarray(white * np.sqrt((how.low_pass.gain(f) ** 2).mean()))


def noise_floor(campaign: Campaign, how: Preparation) -> NoiseFloor | None:
    """Return what the repeats of a campaign say about its noise; None where nothing was repeated.

    `error` is the score of a perfect model: sum |noise| / sum |tau| over rows and joints, as benchmarks pool them. Copies of one file are
    no repeats: they would say that there is no noise.
    """
    groups = independent(campaign, repeated_recordings(campaign))
    spreads = [found for group in groups if (found := scatter(campaign, group, how)) is not None]
    for table in campaign.steady:
        spreads += [_spread(table.tau[list(rows)][:, None, :]) for rows in repeated_rows(table)]
    total = sum(spread.torque_sum for spread in spreads)
    if not spreads or not total > 0:
        return None
    weights = np.array([spread.rows for spread in spreads], dtype=float)
    std = np.sqrt(np.average(np.array([s.std**2 for s in spreads]), axis=0, weights=weights))
    return NoiseFloor(tuple(float(x) for x in std), sum(spread.noise_sum for spread in spreads) / total, groups)
