"""A campaign looked over: what is given and derived, how tips meet the water, and which errors make it unusable."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import angles_only, campaign, planted, recording, steady_table
from rigs import arm, run

from nnhydro.physics.flow import Flow
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.survey import _stroke, errors_of, oddities_of, survey, tip_speed
from nnhydro.runtime.workers import Workers

A = arm(2)
WHOLE = campaign(A, planted(A), 3, seconds=4.0, rate=100.0)


def test_the_speed_of_a_tip_is_the_normal_speed_of_the_physics():
    motion = run(2)
    flow = Flow(A, motion)
    hub = torch.stack([torch.zeros_like(motion.u0), motion.u0], dim=1).numpy()
    want = (flow.A * flow.L + flow.B).numpy()
    for link in range(2):
        assert np.allclose(tip_speed(A, link, motion.q.numpy(), motion.qd.numpy(), hub), want[:, link], rtol=1e-12)


def test_a_stroke_ends_where_the_speed_turns():
    w = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 2.0])
    assert _stroke(np.full(6, 0.5), w) == pytest.approx(1.5)
    assert _stroke(np.zeros(0), np.zeros(0)) == 0.0


def test_what_is_given_and_what_is_derived_is_told_apart():
    found = survey(Campaign.of(A, [WHOLE.load("run1"), angles_only(WHOLE.load("run0"))]))
    towed, bare = found.entries
    assert set(towed.given) == {"q", "dq", "ddq", "tau", "u0", "du0"}
    assert towed.derived == ()
    assert bare.derived == ("dq", "ddq")
    assert (bare.rows, bare.rate_hz) == (400, pytest.approx(100.0))


def test_reynolds_number_and_slenderness_are_those_of_the_tip():
    found = survey(Campaign.of(A, list(WHOLE.recordings()), (steady_table(A, planted(A)),)))
    for link, facts in enumerate(found.links):
        assert facts.slenderness == pytest.approx(A.L[link] / A.D[link])
        assert facts.reynolds == pytest.approx(facts.top_speed_m_s * A.D[link] / 1e-6)
    assert survey(campaign(arm(2, density=0.0), planted(arm(2, density=0.0)), 2, seconds=2.0)).links[0].reynolds is None


def test_an_error_keeps_the_campaign_from_being_prepared():
    broken = recording(A, planted(A), "broken")
    nan = Campaign.of(A, [replace(broken, q=np.full_like(broken.q, np.nan)), WHOLE.load("run0")])
    assert errors_of(WHOLE) == []
    assert any("broken" in line for line in errors_of(nan))
    found = survey(nan)
    assert found.errors
    assert found.how is found.floor is None
    assert any("broken" in line for line in oddities_of(nan.load("broken"), A))


def test_errors_come_first_and_workers_find_the_same():
    found = survey(WHOLE, 5.0)
    severities = [("error", "warning", "note").index(oddity.severity) for oddity in found.oddities]
    assert severities == sorted(severities)
    assert found.how.low_pass is None or found.how.low_pass.cutoff_hz == 5.0
    assert survey(WHOLE, 5.0, Workers(1)).entries == found.entries
