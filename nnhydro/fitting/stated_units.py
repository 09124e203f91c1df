"""Units that columns.yaml states and physics denies: torques, angles or times in another one, far from it.

Each other unit of the channel is judged as the signs of the channels are (channel_order.py), on the numbers as recorded; u enters the
likelihood of torques by their width, sum_j n_j / k_j log u. A stated unit is taken as given unless it leaves most of the torque, and a unit
`FAR` or more from it nearly none. Times are read, filtered and differentiated anew. Source: ours.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nnhydro.fitting.channel_order import SURE, Assignment, ChannelData, WayFit, columns_of, judge, material
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.units import TARGETS, UNITS, factor
from nnhydro.recordings.recording import Recording
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
KNOWN_TO = 0.1  # of the masses here: loose ones would follow the unit
FAR = 30.0  # between the stated unit and another that is asked: a gear, a scale or a pound is nearer
DENIED, EXPLAINS = 0.6, 0.3  # of the torque that the stated unit leaves at the least, and the other at the most
LOGGED = (1e-4, 0.5)  # s between rows of an arm's recordings
FEW = 8  # recordings whose times are read anew


def _alternatives(campaign: Campaign, name: str) -> dict[str, float]:
    """What the values of the column `name` become in each other unit, times as recorded; none where no unit is stated."""
    stated = campaign.load(campaign.names[0]).origin.stated
    if name not in stated:
        return {}
    given = factor(stated[name], name)
    ratios = {unit: value / given for unit, value in UNITS[TARGETS[name]].items()}
    return {unit: ratio for unit, ratio in ratios.items() if not 1 / FAR < ratio < FAR}


def _judge(seen: ChannelData) -> WayFit:
    """The likelihood of the recordings as they are read."""
    n = seen.arm.n_links
    way = Assignment(tuple(range(n)), (1,) * n, tuple(range(n)), (1,) * n)
    return judge(way, columns_of(seen, way), seen.torques, seen.loads, seen.arm, seen.correlation)


def _torques(seen: ChannelData, ratio: float) -> tuple[float, float]:
    """Likelihood, and what is left, with all torques times `ratio`."""
    found = _judge(replace(seen, torques=[ratio * tau for tau in seen.torques]))
    width = sum(len(tau) for tau in seen.torques) * float((1 / seen.correlation).sum()) * float(np.log(ratio))
    return found.likelihood + width, found.error


def _with_angles(segment: Segment, ratio: float) -> Segment:
    """A segment with all angles times `ratio`."""
    return replace(segment, q=ratio * segment.q, qd=ratio * segment.qd, qdd=ratio * segment.qdd)


def _angles(seen: ChannelData, ratio: float) -> tuple[float, float]:
    """Likelihood, and what is left, with all angles times `ratio`."""
    found = _judge(replace(seen, segments=[_with_angles(segment, ratio) for segment in seen.segments]))
    return found.likelihood, found.error


def _in_time(r: Recording, ratio: float) -> Recording:
    """A recording whose times, and nothing else, are times `ratio`; rates are derived anew."""
    return replace(r, t=ratio * r.t, stamps=None, qd=None, qdd=None, du0=None, dbase=None, dcurrent=None)


def _times(campaign: Campaign, ratio: float) -> tuple[float, float] | None:
    """Likelihood, and what is left, with all times `ratio` as long; None where no arm is recorded so slowly or so fast."""
    step = float(np.median(np.diff(campaign.load(campaign.names[0]).t)))
    if LOGGED[0] <= step <= LOGGED[1] or not LOGGED[0] <= ratio * step <= LOGGED[1]:
        return None
    names = campaign.names[::-(-len(campaign.names) // FEW)]
    read = Campaign.of(campaign.arm, [_in_time(campaign.load(name), ratio) for name in names])
    seen = material(read, read.plan(), KNOWN_TO)
    if seen is None:
        return None
    found = _judge(seen)
    return found.likelihood, found.error


def _alternative_fits(campaign: Campaign, seen: ChannelData) -> Iterator[tuple[tuple[str, ...], str, float, float]]:
    """(columns, unit, likelihood, what is left) of every other unit of torques, angles and times."""
    arm = campaign.arm
    for channel, refit in (("tau", _torques), ("q", _angles)):
        names = tuple(arm.column(channel, joint + 1) for joint in range(arm.n_links))
        every = [_alternatives(campaign, name) for name in names]
        for unit, ratio in every[0].items():
            if all(other == every[0] for other in every):
                yield (names, unit, *refit(seen, ratio))
    for unit, ratio in _alternatives(campaign, "t_s").items():
        found = _times(campaign, ratio)
        if found is not None:
            yield (("t_s",), unit, *found)


@one_thread()
def stated_units(campaign: Campaign, how: Preparation) -> Oddity | None:
    """Return which unit that the user stated physics denies, and the likely one; None where all may be right."""
    seen = material(campaign, how, KNOWN_TO)
    if seen is None or not campaign.load(campaign.names[0]).origin.stated:
        return None
    here = _judge(seen)
    if here.error < DENIED:
        return None
    ways = [way for way in _alternative_fits(campaign, seen)
            if way[3] < EXPLAINS and (way[0] == ("t_s",) or way[2] > here.likelihood + SURE)]
    if not ways:
        return None
    names, unit, _, left = min(ways, key=lambda way: way[3])
    stated = campaign.load(campaign.names[0]).origin.stated[names[0]]
    what = (f"{'is' if len(names) == 1 else 'are'} hardly in the stated unit {stated}: so read, the physics of this arm leaves "
            f"{here.error:.0%} of the torque, in {unit} {left:.0%}")
    remedy = f"write 'unit: {unit}' in the {'line' if len(names) == 1 else 'lines'} of {' and '.join(names)} in columns.yaml or --map FILE"
    return Oddity(None, "warning", ", ".join(names), campaign.arm.text(what), remedy, "stated_units")
