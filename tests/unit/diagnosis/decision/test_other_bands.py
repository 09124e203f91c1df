"""Claims are judged again at other upper edges of the band: what shows in all of them stands, what only the highest rows hold is told."""

import pytest
from diagnosed import ARM, FRICTION, campaign, diagnosed, dry, made

from nnhydro.diagnosis import diagnose as whole
from nnhydro.diagnosis.decision.other_bands import FACTORS, claims_at
from nnhydro.diagnosis.problem.hypothesis import enumerate_hypotheses
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.errors import ConfigError
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.band import Band


def coulomb():
    return [h for h in enumerate_hypotheses(ARM, (5.0,)) if h.key == ("coulomb_friction", 1)][:1]


@pytest.mark.slow
def test_friction_shows_at_every_edge_and_nothing_is_said_of_the_band():
    told = diagnosed("rubbing")
    assert [band.lost for band in told.other_bands] == [()] * len(FACTORS)
    assert "If only frequencies below" not in told.verdict()
    assert [band["lost"] for band in told.document()["other_bands"]] == [[]] * len(FACTORS)


def test_a_law_that_is_not_there_is_lost_at_any_edge_and_the_sentence_says_where():
    of = campaign("healthy")
    band = claims_at(of, problem_of(of), Band(2.0, 2.0), None, coulomb())
    assert band.lost == (("coulomb_friction", 1),)
    assert band.sentence() == "If only frequencies below 2 Hz were compared, this would not be claimed: coulomb_friction at joint 1."


def test_what_shows_only_above_an_edge_is_lost_below_it():
    hum = Campaign.of(ARM, made(more=lambda r, k: dry(r, level=0.005 * FRICTION)))
    low = claims_at(hum, problem_of(hum), Band(0.4, 0.4), None, coulomb())
    assert low.lost == (("coulomb_friction", 1),)


def test_a_band_that_cannot_be_judged_costs_nothing_but_itself_and_is_told(monkeypatch):
    def broken(*given):
        raise ValueError("cannot reshape")

    monkeypatch.setattr(whole, "claims_at", broken)
    of = campaign("steady, offset")
    told = whole.diagnose(of)
    assert [f.effect for f in told.findings] == ["torque_bias"]
    assert told.other_bands == ()
    assert told.document()["proof"]["other_bands"].count("cannot reshape") == len(FACTORS), "what was not judged is told"


def test_an_edge_that_is_none_is_refused():
    of = campaign("rubbing")
    with pytest.raises(ConfigError, match="holds nothing"):
        claims_at(of, problem_of(of), Band(-1.0, -1.0), None, coulomb())
