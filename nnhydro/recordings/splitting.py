"""Split by recording, never by sample: the units that are held out whole, and folds of them.

A unit is a recording or a group of steady runs; recordings that repeat the same motion share a fold, so that no model is judged on a
motion that it was shown.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import final

import numpy as np

from nnhydro.errors import CampaignError
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.content_hash import steady_sha256
from nnhydro.recordings.filtering.preprocessing import Preparation, steady_segment
from nnhydro.recordings.recording import SteadyTable
from nnhydro.recordings.segment import Segment

STEADY_UNITS = 20  # a steady table is held out in so many groups of runs
CACHED_UNITS = 200  # prepared units kept in memory; of 10,000 recordings most are prepared again when needed
SAME = 1e-3  # rad, rad/s, m/s: steady runs that agree to this repeat each other


@final
@dataclass(frozen=True, eq=False)
class Unit:
    """What is held out together: `segments()` prepares it when asked; units of one `group` repeat the same motion.

    `arm` is given where recordings of several arms are worked on together; None means the one arm of the campaign.
    """

    name: str
    group: str
    steady: bool
    segments: Callable[[], tuple[Segment, ...]]
    arm: Arm | None = None
    content: Callable[[], frozenset[str]] = frozenset  # contents and marks of what is in it, content_hash.py


def steady_unit(table: SteadyTable, name: str) -> Unit:
    """Return one unit of all runs of `table`."""
    return Unit(name, name, True, partial(tuple, [steady_segment(table)]), content=partial(frozenset, steady_sha256(table)))


def _one(campaign: Campaign, name: str) -> frozenset[str]:
    return campaign.marks(name)


def _steady_units(table: SteadyTable, seed: int) -> list[Unit]:
    """Groups of runs of one table; runs at the same state stay together."""
    state = np.round(table.state / SAME).astype(np.int64)
    _, which = np.unique(state, axis=0, return_inverse=True)
    states = int(which.max()) + 1
    count = min(STEADY_UNITS, states)
    unit_of_state = np.random.default_rng(seed).permutation(states) % count
    found: list[Unit] = []
    for number in range(count):
        found.append(steady_unit(table.rows(unit_of_state[which.ravel()] == number), f"{table.name}#{number + 1}"))
    return found


@final
class PreparedRecordings:
    """Prepares the recordings of a campaign by name and keeps the latest; another process that is sent it starts with none."""

    def __init__(self, campaign: Campaign, how: Preparation) -> None:
        self.campaign, self.how = campaign, how
        self._cached = lru_cache(maxsize=CACHED_UNITS)(self._segments)

    def __reduce__(self) -> tuple[type["PreparedRecordings"], tuple[Campaign, Preparation]]:
        return PreparedRecordings, (self.campaign, self.how)

    def _segments(self, name: str) -> tuple[Segment, ...]:
        return self.campaign.segments(name, self.how)

    def __call__(self, name: str) -> tuple[Segment, ...]:
        """Return the segments of the recording called `name`."""
        return self._cached(name)


def units(campaign: Campaign, how: Preparation, seed: int = 0, groups: dict[str, str] | None = None) -> tuple[Unit, ...]:
    """Return the units of a campaign; `groups` gives recordings that repeat each other a common name (each its own by default)."""
    prepared = PreparedRecordings(campaign, how)
    found = [Unit(name, (groups or {}).get(name, name), False, partial(prepared, name), content=partial(_one, campaign, name))
             for name in campaign.names]
    for table in campaign.steady:
        found += _steady_units(table, seed)
    return tuple(found)


def folds(all_units: Sequence[Unit], count: int, seed: int = 0) -> tuple[tuple[int, ...], ...]:
    """Return `count` disjoint sets of unit indices that together hold every unit once; groups are not torn apart.

    Recordings and steady groups are dealt separately, so that every fold holds some of both. Raises CampaignError below two groups.
    """
    groups = sorted({unit.group for unit in all_units})
    if len(groups) < 2:
        raise CampaignError(f"{len(groups)} recording(s) with a motion of their own: holding some out needs at least two; record more")
    count = max(2, min(count, len(groups)))
    rng = np.random.default_rng(seed)
    fold_of: dict[str, int] = {}
    moving = len({unit.group for unit in all_units if not unit.steady})
    for steady in (False, True):
        kind = sorted({unit.group for unit in all_units if unit.steady == steady})
        for place, index in enumerate(rng.permutation(len(kind))):
            fold_of[kind[int(index)]] = (place + moving * steady) % count
    parts = tuple(tuple(i for i, unit in enumerate(all_units) if fold_of[unit.group] == k) for k in range(count))
    return tuple(fold for fold in parts if fold)


def validation_split(
    chosen: Sequence[int], all_units: Sequence[Unit], share: float, seed: int
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Split the units `chosen` for fitting into (trained on, watched for early stopping), whole groups at a time."""
    groups = sorted({all_units[i].group for i in chosen})
    order = np.random.default_rng(seed).permutation(len(groups))
    watched = {groups[int(k)] for k in order[: max(1, round(share * len(groups)))]} if len(groups) > 1 else set()
    return (tuple(i for i in chosen if all_units[i].group not in watched), tuple(i for i in chosen if all_units[i].group in watched))
