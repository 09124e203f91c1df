"""Rivera's identifier as a study: the network itself, what it is shown, and the figures."""

import numpy as np
import pytest
import torch
from campaigns import GIVEN, campaign, planted
from rigs import arm

from nnhydro.evaluation import reproduce_rivera as study
from nnhydro.evaluation.rivera import TrainingSet
from nnhydro.fitting.linear.several_arms import calibrated_on
from nnhydro.models.baselines import BASELINES
from nnhydro.physics.coefficients.aspect_ratio import drag_coefficient
from nnhydro.recordings.splitting import units
from nnhydro.report.rivera_figures import FIGURES, write_figures

A = arm(2)
SMALL = campaign(A, planted(A), 5, seconds=2.0, rate=25.0)


def shown():
    return TrainingSet(units(SMALL, GIVEN), A)


def test_coefficients_follow_the_slenderness_of_the_arm():
    base = calibrated_on(BASELINES["constant"], shown().units, A, GIVEN)
    same, slender = (study.analytic(base, study.of_slenderness(A, factor)) for factor in (1.0, 2.0))
    own_C_D, same_C_D, slender_C_D = (model.loads.terms["normal_drag"].C_D for model in (base, same, slender))
    assert same_C_D == pytest.approx(own_C_D)
    own = torch.tensor([link.length_m / link.diameter_m for link in A.links]).double()
    want = torch.tensor(own_C_D).double() * drag_coefficient(2 * own) / drag_coefficient(own)
    assert slender_C_D == pytest.approx(want.tolist())
    assert [link.length_m for link in slender.arm.links] == [link.length_m for link in A.links]


@pytest.mark.slow
def test_the_study_answers_every_question_and_draws_it(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "NEURONS", (2, 3))
    monkeypatch.setattr(study, "INPUT_SETS", {name: study.INPUT_SETS[name] for name in ("dimensional", study.USUAL)})
    monkeypatch.setattr(study, "SHARES", (0.5, 1.0))
    said = []
    result = study.reproduce(SMALL, epochs=1, say=said.append)
    assert len(said) == 2 * 2 + 2 * 2 + 2
    assert set(result.slenderness) == set(study.SLENDER)
    assert all(np.isfinite(value) for value in (*result.training.values(), *result.slenderness.values(), result.constant))
    assert result.gains["qdd"][0].shape == result.gains["qdd"][1].shape
    assert len(study.table(result)) == 2 + 2 + 2 + 1 + 2 + 3
    written = write_figures(result, tmp_path)
    assert {path.stem for path in written} == set(FIGURES)
    assert "2 neurons" in {row[0] for row in study.table(result)}
