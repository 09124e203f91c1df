"""Drag that depends on the Reynolds number: each form in a tow, its reference, its refusals."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypotheses import made, steady
from rigs import arm, assert_close

from nnhydro.effects.catalogue import candidates
from nnhydro.effects.effect import REGISTER
from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import term_of
from nnhydro.physics.loads.normal_drag import NormalDrag


@pytest.mark.parametrize("turn", [(), (0.2,)])
def test_a_power_law_of_the_Reynolds_number_is_seen_in_a_tow(turn):
    effect, a = made("reynolds_drag", arm(1), slope=(0.3,), bend=(0.1,), turn=turn), arm(1)
    u0 = 0.9
    r = np.log10(u0 * 0.07 / 1e-6 / 3e4)
    drag = NormalDrag((0.3 * r + 0.1 * r**2 + sum(turn) * r**3,)).torque(Flow(a, steady([[0.0]], 0.0, 0.0, u0)))
    assert_close(effect.torque(Flow(a, steady([[0.0]], 0.0, 0.0, u0))), drag)


@pytest.mark.parametrize("steep", [3, 4])
def test_a_crisis_of_drag_has_two_bends(steep):
    """C_D falls by 0.8 about Re = 4e4, tow after tow: the cubic leaves a third of what the parabola leaves."""
    a, u0 = arm(1), np.linspace(0.05, 1.2, 80)
    tows = Flow(a, steady(np.zeros((80, 1)), 0.0, 0.0, u0))
    measured = 0.8 / (1 + (u0 * 0.07 / 1e-6 / 4e4) ** steep) * 0.5 * 1000 * 0.07 * u0**2 * 0.55**2 / 2
    left = []
    for turn in ((0.0,), ()):
        law = made("reynolds_drag", a, slope=(0.0,), bend=(0.0,), turn=turn)
        X = torch.cat([law.columns(tows), NormalDrag((1.0,)).columns(tows)], dim=-1)[:, 0].numpy()
        theta = np.linalg.lstsq(X, measured, rcond=None)[0]
        assert all(low < value < high for value, (low, high) in zip(theta, law.linear_bounds(), strict=False)), "what physics allows"
        left.append(np.linalg.norm(measured - X @ theta))
    assert left[0] < left[1] / 3
    whole = made("reynolds_drag", a, slope=(0.0,), bend=(0.0,), turn=(0.0,))
    assert [law.linear_names() for law in whole.narrower()] == [("slope", "bend"), ("drop",)], "parabola and crisis are tried besides"
    laws = candidates(REGISTER["reynolds_drag"], a)
    assert len(laws) == len(set(laws)) == 2 + 4 * 2


def test_beyond_the_crisis_the_drag_has_fallen_by_the_drop_and_far_below_by_nothing():
    a, law = arm(1), made("reynolds_drag", arm(1), slope=(), bend=(), turn=(), drop=(0.6,), critical=(4e4,), width=(0.1,))
    tows = {u0: Flow(a, steady([[0.0]], 0.0, 0.0, u0)) for u0 in (0.05, 4e4 * 1e-6 / 0.07, 8.0)}
    for fallen, tow in zip((0.0, 0.5, 1.0), tows.values(), strict=True):
        assert_close(law.torque(tow), NormalDrag((-0.6 * fallen,)).torque(tow), rtol=1e-7, atol=1e-9)
    assert "C_D falls by 0.6 at a Reynolds number of 4e+04" in law.statement()
    assert float(law.torque(Flow(a, steady([[0.0]], 0.0, 0.0, 0.0))).abs().max()) == 0.0


@pytest.mark.parametrize(("low", "high", "speed"), [(5e3, 2e4, 0.1), (5e3, 2e4, 0.02), (5e3, 2e4, 2.0)])
def test_the_law_is_about_the_mean_Reynolds_number_and_constant_beyond_what_was_recorded(low, high, speed):
    a = arm(1)
    law = made("reynolds_drag", a, slope=(0.3,), bend=(0.0,), turn=()).at_reynolds(low, high)
    tow = Flow(a, steady([[0.0]], 0.0, 0.0, speed))
    r = np.log10(min(max(speed * 0.07 / 1e-6, low), high) / np.sqrt(low * high))
    assert_close(law.torque(tow), NormalDrag((0.3 * r,)).torque(tow))
    assert "about 10000 it changes" in law.statement()


@pytest.mark.parametrize("options", [{"lowest": "low"}, {"highest": float("nan")}, {"highest": float("inf")}, {"lowest": True},
                                     {"lowest": 0.0}, {"lowest": 3e4, "highest": 2e4}, {"highest": None}])
def test_a_model_file_whose_Reynolds_numbers_are_no_range_is_refused(options):
    document = replace(made("reynolds_drag", arm(1), slope=(0.3,), bend=(0.0,), turn=())).document()
    document["options"] |= options
    with pytest.raises(ModelError, match=next(iter(options))):
        term_of(document)
