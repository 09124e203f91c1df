"""Outer angles that count from the same direction as the first one, where they should count from the link before.

    q_j = phi_j - phi_(j-1)        if the columns hold phi_j = q_1 + ... + q_j

Judged against the physics as signs and order of the channels are (channel_order.py). Source: ours.
"""

from dataclasses import replace

import numpy as np

from nnhydro.fitting.channel_order import BETTER, CHANGE, EXPLAINS, SURE, Assignment, WayFit, columns_of, judge, material
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.segment import Segment


def _relative(segment: Segment) -> Segment:
    """The segment with each outer angle less the one before it."""
    def less(x: np.ndarray) -> np.ndarray:
        return np.diff(x, axis=1, prepend=0.0)
    return replace(segment, q=less(segment.q), qd=less(segment.qd), qdd=less(segment.qdd))


@one_thread()
def absolute_angles(campaign: Campaign, how: Preparation, ways: list[WayFit]) -> Oddity | None:
    """Return that the outer angles seem to be absolute; None where another of the judged `ways` explains the torques as well."""
    n = campaign.arm.n_links
    if n < 2 or campaign.arm.drive.kind == "remote":
        return None
    seen = material(campaign, how)
    if seen is None:
        return None
    here = next(judged for judged in ways if judged.way.changes == 0)
    same = Assignment(tuple(range(n)), (1,) * n, tuple(range(n)), (1,) * n)
    read = replace(seen, segments=[_relative(segment) for segment in seen.segments])
    best = judge(same, columns_of(read, same), seen.torques, seen.loads, seen.arm, seen.correlation)
    if best.likelihood - CHANGE - ways[0].likelihood < SURE or best.error > EXPLAINS or best.error > BETTER * here.error:
        return None
    names = [campaign.arm.column("q", joint + 1) for joint in range(n)]
    return Oddity(None, "warning", ", ".join(names[1:]), f"seem to count from +X, not from the link before: so read, the physics leaves "
                  f"{best.error:.0%} of the torque, as recorded {here.error:.0%}",
                  f"write {names[1]} minus {names[0]} into the files; for a belt from the base write "
                  "'drive: {kind: remote, angle2: absolute}' into arm.yaml", "absolute_angles")
