"""A wave on a held arm is known no better than the added mass that nothing else tells; what is a load does not hang on the baseline."""

import numpy as np
import pytest
from diagnosed import campaign

from nnhydro.diagnosis.diagnose import search_design
from nnhydro.diagnosis.findings.baseline_spread import spread_by_baseline
from nnhydro.diagnosis.problem.design import design_on
from nnhydro.diagnosis.problem.problem import problem_of


@pytest.mark.slow
def test_a_wave_on_a_held_arm_hangs_on_the_added_mass():
    found = search_design(design_on(problem_of(campaign("held in a wave")), None), 0)
    search, claimed = found.search, found.decided.claimed
    (k,) = (k for k in claimed.chosen if search.key(k)[0] == "wave_orbital")
    h = search.view.library.hypotheses[k]
    spread = np.sqrt(np.diag(spread_by_baseline(search, claimed, k)))
    beta = claimed.fit.mean[claimed.places(search.view)[k]].reshape(-1, h.width) * search.view.library.scale[search.view.library.at(k)]
    rms = np.sqrt((beta**2).mean(axis=0))
    base = found.design.baseline
    mass, free = base.prior.mean[-1], float(np.abs(base.prior.F[-1]).max())  # C_M and its prior standard deviation
    assert spread / rms == pytest.approx(1 - (1 + mass) / (1 + mass + free), rel=0.1), "its load is (1 + C_M) times its size"


@pytest.mark.slow
def test_a_load_does_not_hang_on_the_baseline():
    found = search_design(design_on(problem_of(campaign("rubbing")), None), 0)
    (k,) = found.decided.claimed.chosen
    assert not spread_by_baseline(found.search, found.decided.claimed, k).any()
