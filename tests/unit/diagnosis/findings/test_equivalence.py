"""An equivalent effect of fewer values takes the place of a finding, and rivals are those that the data cannot distinguish from it."""

import numpy as np
import pytest
from problems import design, law, search, special_beside_plain

from nnhydro.diagnosis.constants import LEAST_GAIN
from nnhydro.diagnosis.findings import equivalence
from nnhydro.diagnosis.findings.equivalence import Rival, replace_by_simpler, rivals_of


@pytest.mark.parametrize(("gain", "chosen"), [(LEAST_GAIN - 0.1, (1,)), (LEAST_GAIN + 0.1, (0,))])
def test_an_equivalent_of_fewer_values_takes_the_place_only_if_it_gains_enough_to_be_claimed(gain, chosen, monkeypatch):
    one, found = special_beside_plain(lambda values: True)
    monkeypatch.setattr(equivalence, "rivals_of", lambda *_: (1.0, [Rival(0, 2.0, 0.1, 0.9, True)]))
    monkeypatch.setattr(type(one), "gain", lambda search, now, then: gain)
    assert replace_by_simpler(one, found).chosen == chosen


def test_a_standard_term_for_which_the_finding_may_be_taken_is_a_rival_however_many_special_laws_gain_more():
    of = design(0, groups=8, rows=60)
    rng = np.random.default_rng(50)
    truth, special = rng.standard_normal((*of.y.shape, 1)), 10
    X = np.concatenate([truth, truth + 0.6 * rng.standard_normal(truth.shape),
                        truth + 0.2 * rng.standard_normal((*of.y.shape, special))], axis=2)
    of.y = of.y + 0.8 * truth[..., 0]
    named = [law("viscous", joint=1, standard=True), law("dry", joint=1, standard=True), *[law(f"special_{i}") for i in range(special)]]
    for alike in (False, True):
        if alike:
            named[0].effect.signature.mistaken_for = ("dry",)
        one = search(of, tuple(named), X)
        _, others = rivals_of(one, one.score((0,)), 0)
        assert len(others) >= 4
        assert (1 in [a.number for a in others]) == alike
        assert len({one.key(a.number) for a in others}) == len(others), "the best law of each effect alone"
