"""A sector of the arm's posture is held out, each sector in turn: how far a model may be trusted in postures that it was not shown.

The angle is the last joint's, between the links, which decides who lies in whose wake; for an arm of one link the absolute angle, wrapped
to (-pi, pi]. A recording belongs to the sector of its median angle, where it spends its time; sectors hold equally many recordings;
steady rows go by their own angle.
"""

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import CampaignError, require
from nnhydro.evaluation.protocols.pool import edges_of, pooled_units, recording_values, steady_by, unit_bins
from nnhydro.evaluation.protocols.protocol import Material, Split, protocol, rounds
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.segment import Segment

Array = NDArray[np.float64]
SECTORS = 4


def posture(segment: Segment, arm: Arm) -> Array:
    """Return the last joint's angle (n,) rad in (-pi, pi]."""
    wrapped: Array = -((-segment.q[:, -1] + np.pi) % (2 * np.pi) - np.pi)
    return wrapped


@protocol("leave-angle-sector-out", "recordings in one sector of the posture held out, each sector in turn")
def leave_angle_sector_out(material: Material) -> Split:
    """Return one fold a sector that holds recordings; raises CampaignError where all recordings keep to one posture."""
    recorded = pooled_units(material, lambda campaign: [])
    values = recording_values(recorded, material.campaigns[0].arm, posture, lambda angles: float(np.median(angles)))
    edges = edges_of(values, material.campaigns, posture, SECTORS)
    units = pooled_units(material, lambda campaign: steady_by(campaign, posture, edges))
    bins = unit_bins(units, values, edges, material.campaigns[0].arm, posture)
    limits = np.degrees([-np.pi, *edges, np.pi])
    sectors = [(f"{limits[k]:.0f} to {limits[k + 1]:.0f} deg", tuple(np.flatnonzero(bins == k).tolist())) for k in range(SECTORS)]
    sectors = [(name, chosen) for name, chosen in sectors if chosen]
    require(len(sectors) > 1, "all recordings have the same posture: a sector cannot be held out; record other postures", CampaignError)
    return Split(units, rounds(units, sectors))
