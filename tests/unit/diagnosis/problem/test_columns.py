"""Columns of hypotheses on the rows: their torque a unit of their values, where they act, and what a prediction may look at."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import campaign, planted
from hypotheses import made
from rigs import arm

from nnhydro.diagnosis.problem.activity import ActivityWindow
from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.columns import columns_on
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.hypothesis import Hypothesis
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.effects.hypotheses import wake_reentry
from nnhydro.physics.travel.wake_memory import overtaking_by_law
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

ARM = arm(1)
WHOLE = campaign(ARM, planted(ARM), count=4, noise=0.01)


def of(whole=WHOLE, edge=3.0):
    """The rows of a campaign against the baseline with constant coefficients."""
    problem = problem_of(whole, edge=edge)
    return design_of(problem, baseline_of("constant", whole.arm, problem.units(), Preparation(LowPass(edge))))


def test_the_columns_of_an_effect_are_its_torque_a_unit_of_its_value_on_the_rows():
    design = of()
    rubbing = Hypothesis(made("viscous_friction", ARM, 1))
    X = design.columns([rubbing], design.baseline.physics)[..., 0]
    torque = Campaign.of(ARM, [replace(r, tau=r.tau + 0.3 * r.qd) for r in WHOLE.recordings()])
    np.testing.assert_allclose(of(torque).y - design.y, 0.3 * X, atol=1e-4 * np.abs(design.y).max())


def test_an_effect_in_some_recordings_has_columns_there_alone():
    design = of()
    somewhere = Hypothesis(made("viscous_friction", ARM, 1), activity=ActivityWindow(("run1",)))
    X = design.columns([somewhere], design.baseline.physics)
    at = design.problem.group_of == design.problem.names.index("run1")
    assert X[at].any()
    assert not X[~at].any()


@pytest.mark.parametrize("predicted", [True, False])
def test_the_measured_torque_says_when_play_is_crossed_and_no_prediction_looks_at_it(predicted):
    design = of()
    play = Hypothesis(made("backlash", ARM, 1))
    stretch = design.problem.stretches[0]
    other = replace(stretch, segment=replace(stretch.segment, tau=-stretch.segment.tau))
    one, two = (columns_on([play], design.baseline.physics, s, predicted) for s in (stretch, other))
    assert np.array_equal(one, two) == predicted


def test_wakes_that_differ_in_length_or_fading_take_one_pass_over_the_rows_of_a_stretch(monkeypatch):
    design, passes = of(), []
    laws = [Hypothesis(made("wake_reentry", ARM, length=(length,), fading=(0.3,))) for length in (3.0, 5.0, 9.0)]
    alone = np.concatenate([design.columns([law], design.baseline.physics) for law in laws], axis=2)

    def counted(*given):
        passes.append(len(given[2]))
        return overtaking_by_law(*given)

    monkeypatch.setattr(wake_reentry, "overtaking_by_law", counted)
    monkeypatch.setattr(wake_reentry, "overtaking", None)
    assert np.array_equal(design.columns(laws, design.baseline.physics), alone)
    assert passes == [3] * len(design.problem.stretches)


def test_readings_computed_in_one_pass_are_those_of_each_instrument_alone():
    design, of_water = of(), made("wake_reentry", ARM).with_linear(torch.tensor([0.3, 0.2, 0.4, 0.1], dtype=torch.float64))
    model = replace(design.baseline.physics, loads=design.baseline.physics.loads.plus("wake", of_water))
    instruments = {"joint_elasticity": (0.02, 0.0), "backlash": (0.01,), "encoder_offset": (0.1,), "ambient_current": (0.1, 0.05),
                   "wave_orbital": (0.1, 0.2), "flexible_mount": (0.02, 0.1), "sensor_timing": (0.02,)}
    laws = []
    for name, values in instruments.items():
        effect = made(name, ARM, 0 if name in ("ambient_current", "wave_orbital", "flexible_mount", "sensor_timing") else 1)
        count = len(effect.linear_values())
        laws.append(Hypothesis(effect).linearised_at({0: torch.tensor(values[:count], dtype=torch.float64)}, model))
    alone = np.concatenate([design.columns([law], model) for law in laws], axis=2)
    np.testing.assert_allclose(design.columns(laws, model), alone, atol=1e-9 * np.abs(alone).max())
