"""The fastest third of the recordings is held out, then the slowest: how far a model may be trusted beyond the speeds that it was shown.

    v = max over links, rows and both ends of |A x + B|        top normal speed through the water            [m/s]

A repeat group counts with its fastest recording; steady rows go by their own speed, with the recordings' limits.
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import CampaignError, require
from nnhydro.evaluation.protocols.pool import edges_of, pooled_units, recording_values, steady_by, unit_bins
from nnhydro.evaluation.protocols.protocol import Material, Split, protocol, rounds
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.surroundings import absolute_angles, absolute_rates, through_water
from nnhydro.recordings.survey import tip_speed

Array = NDArray[np.float64]
THIRDS = 3


def normal_speed(segment: Segment, arm: Arm) -> Array:
    """Return the largest normal speed (n,) m/s of any link's ends, row by row."""
    if arm.sliding:
        return np.abs(tip_speed(arm, 0, segment.q, segment.qd, through_water(segment)))
    phi = np.cumsum(absolute_angles(segment), axis=1)
    rate = np.cumsum(absolute_rates(segment, segment.qd), axis=1)
    vx, vy = through_water(segment).T
    top = np.zeros(len(segment))
    for i, length in enumerate(arm.L):
        across = vy * np.cos(phi[:, i]) - vx * np.sin(phi[:, i])
        top = np.maximum(top, np.maximum(np.abs(across), np.abs(across + rate[:, i] * length)))
        vx = vx - rate[:, i] * length * np.sin(phi[:, i])
        vy = vy + rate[:, i] * length * np.cos(phi[:, i])
    return top


@protocol("leave-speed-range-out", "the fastest third of the recordings held out, then the slowest")
def leave_speed_range_out(material: Material) -> Split:
    """Return two folds; raises CampaignError where the speeds do not differ enough for three ranges."""
    arm = material.campaigns[0].arm
    recorded = pooled_units(material, lambda campaign: [])
    values = recording_values(recorded, arm, normal_speed, lambda v: float(v.max()))
    edges = edges_of(values, material.campaigns, normal_speed, THIRDS)
    units = pooled_units(material, lambda campaign: steady_by(campaign, normal_speed, edges))
    bins = unit_bins(units, values, edges, arm, normal_speed)
    fastest, slowest = np.flatnonzero(bins == THIRDS - 1), np.flatnonzero(bins == 0)
    require(len(fastest) > 0 and len(slowest) > 0 and len(np.unique(bins[bins >= 0])) > 1,
            "all recordings have about the same speed: a speed range cannot be held out; record slower and faster motions", CampaignError)
    return Split(units, rounds(units, [(f"above {edges[-1]:.2f} m/s", tuple(fastest.tolist())),
                                       (f"below {edges[0]:.2f} m/s", tuple(slowest.tolist()))]))
