"""An arm held in a wave: its frequency, size and intervals; it is known no better than the added mass that nothing else tells."""

import numpy as np
import pytest
from diagnosed import diagnosed, named, searched, value

from nnhydro.diagnosis.findings.baseline_spread import spread_by_baseline
from nnhydro.diagnosis.findings.finding import findings_of


@pytest.mark.slow
def test_a_wave_on_an_arm_that_is_held_is_named_with_its_frequency():
    told = diagnosed("held in a wave")
    assert named(told) == {("wave_orbital", 0)}
    got, low, high = value("held in a wave", "wave_orbital", "frequency")
    assert got == pytest.approx(0.965, abs=5e-4), "a hundredth of the resolution of 20 s"
    assert high - low < 0.05
    assert told.heldout.after < 0.5 * told.heldout.before


@pytest.mark.slow
def test_a_wave_on_a_held_arm_is_as_large_as_its_drag_and_frequency_say():
    told = diagnosed("held in a wave")
    (finding,) = told.findings
    amplitude, frequency = (finding.parameters[name].value for name in ("amplitude", "frequency"))
    assert frequency == pytest.approx(0.965, abs=5e-4), "a twentieth of the resolution of 20 s"
    assert amplitude * (1 + told.recalibrated["cm"][0]) == pytest.approx(0.12 * 2, rel=0.15), "what a wave at rest shows is this product"
    assert told.heldout.after < 0.022, "its drag is in the model: without the part that is not linear 2.9 % remain"


@pytest.mark.slow
def test_every_value_of_a_finding_stands_within_its_interval_nonlinear_ones_too():
    found = searched("held in a wave")
    wave = next(f for f in findings_of(found.search, found.decided.claimed) if f.effect == "wave_orbital")
    for name in ("frequency", "direction", "amplitude"):
        low, high = wave.parameters[name].ci95
        assert low < wave.parameters[name].value < high
    low, high = wave.parameters["frequency"].ci95
    assert low < 0.965 < high
    assert high - low < 0.002, "six recordings of 20 s"


@pytest.mark.slow
def test_a_wave_on_a_held_arm_hangs_on_the_added_mass():
    found = searched("held in a wave")
    search, claimed = found.search, found.decided.claimed
    (k,) = (k for k in claimed.chosen if search.key(k)[0] == "wave_orbital")
    h = search.view.library.hypotheses[k]
    spread = np.sqrt(np.diag(spread_by_baseline(search, claimed, k)))
    beta = claimed.fit.mean[claimed.places(search.view)[k]].reshape(-1, h.width) * search.view.library.scale[search.view.library.at(k)]
    rms = np.sqrt((beta**2).mean(axis=0))
    base = found.design.baseline
    mass, free = base.prior.mean[-1], float(np.abs(base.prior.F[-1]).max())  # C_M and its prior standard deviation
    assert spread / rms == pytest.approx(1 - (1 + mass) / (1 + mass + free), rel=0.1), "its load is (1 + C_M) times its size"
