"""Recordings of one campaign in two units: a channel that is 57 or 1000 times as large in some files, and physics that denies it.

    suspect:  median of the large group / median of the small one within `LIKE` of k, and nothing between them
    judged:   as recorded; the small group times k; the large group divided by k        (channel_order.py says how)

One line of columns.yaml holds for all files, so a unit that only one file has makes the others wrong. Source: ours.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.fitting.channel_order import SURE, Assignment, ChannelData, WayFit, columns_of, judge, material
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
TURNS = 180 / np.pi
UNITS = {"q": ((TURNS, "deg"),), "tau": ((1e3, "mN m"), (1e2, "N cm")), "u0": ((1e3, "mm/s"), (1e2, "cm/s"))}
LIKE = 4.0  # times k or less: motions of one campaign differ by so much
GAP = 6.0  # the smallest of the large group is more than k / 6 times the largest of the small one
MOST = 4  # recordings of a group that are judged
KNOWN_TO = 0.1  # of the masses here: loose ones would follow the unit
EXPLAINS, BETTER = 0.5, 0.5  # one unit leaves less than so much of the torque, and less than so much of what two leave


@final
@dataclass(frozen=True)
class Suspect:
    """A channel of some joints, of which two groups of recordings are about `ratio` apart."""

    channel: str  # q, tau or u0
    joints: tuple[int, ...]  # from 0
    ratio: float
    unit: str
    small: tuple[str, ...]
    large: tuple[str, ...]


def _sizes(campaign: Campaign) -> dict[tuple[str, int], dict[str, float]]:
    """How far each channel swings in each recording, by channel and joint; 0 where it does not."""
    found: dict[tuple[str, int], dict[str, float]] = {}
    for recording in campaign.recordings():
        reading = Reading.of(recording, campaign.arm).recording
        for channel in UNITS:
            values = getattr(reading, channel)
            for joint, x in enumerate(() if values is None else values.reshape(len(values), -1).T):
                seen = np.abs(x[np.isfinite(x)]) if channel == "u0" else x[np.isfinite(x)]
                size = 0.0 if not len(seen) else float(np.percentile(seen, 99.5) - (0.0 if channel == "u0" else np.percentile(seen, 0.5)))
                found.setdefault((channel, joint), {})[recording.name] = size
    return found


def suspects(campaign: Campaign) -> Iterator[Suspect]:
    """Yield every channel whose recordings fall into two groups about a ratio of units apart; joints with the same groups together."""
    alike: dict[tuple[str, float, str, tuple[str, ...], tuple[str, ...]], list[int]] = {}
    for (channel, joint), sizes in _sizes(campaign).items():
        ordered = sorted((size, name) for name, size in sizes.items() if size > 0)
        if len(ordered) < 2:
            continue
        values = np.log([size for size, _ in ordered])
        at = int(np.argmax(np.diff(values))) + 1
        apart, gap = float(np.median(values[at:]) - np.median(values[:at])), float(values[at] - values[at - 1])
        for ratio, unit in UNITS[channel]:
            if abs(apart - np.log(ratio)) < np.log(LIKE) and gap > np.log(ratio / GAP):
                groups = tuple(sorted(name for _, name in ordered[:at])), tuple(sorted(name for _, name in ordered[at:]))
                alike.setdefault((channel, ratio, unit, *groups), []).append(joint)
    for (channel, ratio, unit, small, large), joints in alike.items():
        yield Suspect(channel, tuple(joints), ratio, unit, small, large)


def _times(segment: Segment, suspect: Suspect, factor: float) -> Segment:
    """The segment with the motion channel of a suspect times `factor`."""
    if suspect.channel == "u0":
        return replace(segment, u0=factor * segment.u0, du0=factor * segment.du0)
    scale = np.ones(segment.q.shape[1])
    scale[list(suspect.joints)] = factor
    return replace(segment, q=scale * segment.q, qd=scale * segment.qd, qdd=scale * segment.qdd)


def _judge_with(seen: ChannelData, suspect: Suspect, factor: Callable[[str], float]) -> WayFit:
    """The likelihood of the recordings where each has the channel of the suspect times its `factor`."""
    n = seen.arm.n_links
    way = Assignment(tuple(range(n)), (1,) * n, tuple(range(n)), (1,) * n)
    factors = [factor(segment.recording) for segment in seen.segments]
    if suspect.channel != "tau":
        moved = replace(seen, segments=[_times(segment, suspect, f) for segment, f in zip(seen.segments, factors, strict=True)])
        return judge(way, columns_of(moved, way), seen.torques, seen.loads, seen.arm, seen.correlation)
    scale = np.isin(np.arange(n), suspect.joints).astype(float)
    torques = [tau * (1 + (f - 1) * scale) for tau, f in zip(seen.torques, factors, strict=True)]
    found = judge(way, columns_of(seen, way), torques, seen.loads, seen.arm, seen.correlation)
    rows = (scale / seen.correlation).sum()
    width = sum(float(rows * len(tau) * np.log(f)) for tau, f in zip(torques, factors, strict=True))
    return replace(found, likelihood=found.likelihood + width)


@one_thread()
def mixed_units(campaign: Campaign, how: Preparation) -> Oddity | None:
    """Return which recordings seem to be in another unit than the others; None where physics does not say so."""
    for suspect in suspects(campaign):
        some = replace(campaign, names=(*suspect.small[:MOST], *suspect.large[:MOST]), steady=())
        seen = material(some, how, KNOWN_TO)
        if seen is None:
            continue
        def up(name: str, suspect: Suspect = suspect) -> float:
            return suspect.ratio if name in suspect.small else 1.0

        def down(name: str, suspect: Suspect = suspect) -> float:
            return 1 / suspect.ratio if name in suspect.large else 1.0

        here, raised, lowered = (_judge_with(seen, suspect, factor) for factor in (lambda _: 1.0, up, down))
        best = raised if raised.likelihood > lowered.likelihood else lowered
        if best.likelihood - here.likelihood > SURE and best.error < EXPLAINS and best.error < BETTER * here.error:
            return _finding(campaign, suspect, best is raised, here.error, best.error)
    return None


def _finding(campaign: Campaign, suspect: Suspect, too_small: bool, here: float, best: float) -> Oddity:
    """The finding about the group that is wrong."""
    wrong = [name for name in campaign.names if name in (suspect.small if too_small else suspect.large)]
    name = " and ".join(campaign.arm.column(suspect.channel, None if suspect.channel == "u0" else joint + 1) for joint in suspect.joints)
    listed = ", ".join(wrong[:4]) + (f" and {len(wrong) - 4} more" if len(wrong) > 4 else "")
    verb = "is" if len(suspect.joints) == 1 else "are"
    how = f"small there, converted from {suspect.unit}" if too_small else f"large there, as in {suspect.unit}"
    what = (f"{verb} {suspect.ratio:.3g} times too {how}: with one unit in all files, the physics leaves {best:.0%} of the torque, "
            f"as recorded {here:.0%}")
    remedy = (f"were only some of the files in {suspect.unit}? Take the unit out of columns.yaml, which holds for all; convert those files"
              if too_small else "convert these files; a line in columns.yaml would change the others, too")
    return Oddity(None, "warning", f"{name}, {listed}", campaign.arm.text(what), remedy, "mixed_units")
