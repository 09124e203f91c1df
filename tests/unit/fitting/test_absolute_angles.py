"""Outer angles that count from the first direction are told."""

from dataclasses import replace

import numpy as np
from campaigns import campaign, planted
from rigs import arm

from nnhydro.fitting.absolute_angles import absolute_angles
from nnhydro.fitting.channel_order import judged_ways
from nnhydro.fitting.physical_survey import survey_with_physics
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.recordings.campaign import Campaign


def whole(links=2, count=6, **keys):
    a = arm(links)
    return campaign(a, planted(a).plus("c", CoulombTerm((0.2, 0.1)[:links])), count, noise=0.05, seconds=4.0, rate=50.0, **keys)


def changed(c, change, *names):
    """The campaign with the recordings `names` changed."""
    return Campaign.of(c.arm, [replace(r, **change(r)) if r.name in names else r for r in c.recordings()])


def test_an_outer_angle_that_counts_from_the_first_direction_is_told():
    def absolute(r):
        return {"q": np.cumsum(r.q, axis=1), "qd": np.cumsum(r.qd, axis=1), "qdd": np.cumsum(r.qdd, axis=1)}

    c = whole()
    odd = changed(c, absolute, *c.names)
    assert "q2_rad minus q1_rad" in absolute_angles(odd, odd.plan(), judged_ways(odd, odd.plan())).remedy
    assert [o.check for o in survey_with_physics(odd).oddities if o.severity == "warning"] == ["absolute_angles"]
    assert absolute_angles(c, c.plan(), judged_ways(c, c.plan())) is None
