"""The law of a finding is its torque with the interval of its value; beside it stands what the rest of the model leaves."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, campaign, planted
from drawn_traces import rubbing
from rigs import arm

from nnhydro.diagnosis.findings.finding import Finding
from nnhydro.effects.catalogue import candidates, catalogue
from nnhydro.effects.effect import LoadEffect
from nnhydro.models.strip_theory import StripTheory
from nnhydro.report.diagnosis.finding_law import law_of
from nnhydro.report.widgets.trace import diagnosis_traces


def test_the_law_of_a_finding_is_its_torque_with_the_interval_of_its_value():
    c, without, true, finding = rubbing()
    law = law_of(finding, true, diagnosis_traces(c, without, true), "corrected")
    assert (law.joint, law.driver) == (2, "rate of joint 2 [rad/s]")
    fast = np.abs(law.x) > 0.5
    np.testing.assert_allclose(law.law[fast], 0.3 * np.sign(law.x[fast]), atol=0.001)
    np.testing.assert_allclose(law.half[fast], 1.96 * 0.01, rtol=0.01)
    np.testing.assert_allclose(law.rest, law.law, atol=1e-9)


def test_what_the_law_leaves_is_seen_beside_it():
    c, without, _, finding = rubbing()
    weak = finding.law.with_linear(torch.tensor([0.2], dtype=torch.float64))
    model = replace(without, loads=without.loads.plus("coulomb_friction_2", weak))
    law = law_of(replace(finding, law=weak), model, diagnosis_traces(c, without, model), "corrected")
    fast = np.abs(law.x) > 0.5
    np.testing.assert_allclose(np.abs(law.law[fast]), 0.2, atol=0.001)
    np.testing.assert_allclose(np.abs(law.rest[fast]), 0.3, atol=0.001)


@pytest.mark.parametrize("id_", catalogue())
def test_every_effect_has_a_law_but_one_with_a_phase_or_a_time_of_its_own(id_):
    a = arm()
    base = StripTheory(a, GIVEN, {}, "constant", planted(a))
    (made, *_) = candidates(catalogue()[id_], a, (5.0, 2.0))
    effect = made.with_linear(torch.full_like(made.linear_values(), 0.01))
    if isinstance(effect, LoadEffect):
        model = replace(base, loads=base.loads.plus("found", effect))
    else:
        model = replace(base, instruments=(effect,))
    p = len(effect.linear_values())
    rest = dict.fromkeys(("family", "equivalence_set", "confidence", "parameters", "rivals"))
    finding = Finding(law=effect, statement="", number=0, covariance=1e-6 * np.eye(p), **rest)
    law = law_of(finding, model, diagnosis_traces(campaign(a, base.loads, count=2, seconds=2.0), base, model), "corrected")
    assert (law is None) == (effect.per_recording or effect.signature.depends_on == ("clock",))
    if law is not None:
        assert len(law.x) > 3
        assert np.isfinite([law.law, law.rest, law.half]).all()
        assert law.half.max() > 0
