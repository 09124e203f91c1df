"""A campaign that looks wrong says so, with the remedy."""

import pandas as pd
import pytest
from campaigns import columns_of

import nnhydro


def test_a_campaign_that_looks_wrong_says_so_with_the_remedy(healthy):
    wrong = nnhydro.Campaign.of(healthy.arm, [nnhydro.read_frame(pd.DataFrame(columns_of(r)).assign(
        q1_rad=lambda x: x.q1_rad * 57.3, q2_rad=lambda x: x.q2_rad * 57.3).drop(
            columns=["dq1_rad_s", "dq2_rad_s", "ddq1_rad_s2", "ddq2_rad_s2"]), healthy.arm, r.name) for r in healthy.recordings()])
    found = nnhydro.check(wrong)
    assert any("deg" in message for message in found.oddities)
    assert not found.usable or found.verdict().startswith("Usable, but")
    with pytest.raises(nnhydro.NnhydroError, match="cutoff_hz"):
        nnhydro.check(healthy, cutoff_hz=-1)
