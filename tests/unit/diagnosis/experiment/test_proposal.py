"""The motion to record next, in words."""

from types import SimpleNamespace

import numpy as np
import pytest

from nnhydro.diagnosis.experiment.discrimination import DiscriminationProblem
from nnhydro.diagnosis.experiment.proposal import Proposal


@pytest.mark.parametrize(("chance_of_it", "words"), [
    (0.93, "record the proposed slew motion (4.0 s) 3 times: it decides with a probability of 93 % (a motion drawn at random: 60 %)."),
    (0.04, "no motion is likely to distinguish coulomb_friction at joint 2 from stribeck_friction"),
    (0.494, "recorded 3 times, decides with a probability of 49 %.")])
def test_a_proposal_that_would_hardly_settle_anything_says_so(chance_of_it, words):
    task = DiscriminationProblem((3, 7), (), (0.0, 1.0), (("coulomb_friction", 2), ("stribeck_friction", 2)))
    motion = SimpleNamespace(document={"kind": "slew"}, t=np.linspace(0, 4, 9))
    proposal = Proposal(task, motion, 3, 1.0, chance_of_it, 0.6, None)
    assert words in proposal.statement()
    assert proposal.document("next.csv")["separates"][1] == {"effect": "stribeck_friction", "joint": 2}
