"""A cause has one size, in all recordings and for all parts of the torque that a sensor changes alike."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosed import searched
from problems import law, with_values

from nnhydro.diagnosis.decision import scatter
from nnhydro.diagnosis.decision.scatter import _parts, scatter_between_parts, scatter_between_recordings
from nnhydro.diagnosis.model.evidence import WhiteRows
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary

LAWS = tuple(law(f"law_{k}") for k in range(3))


@pytest.mark.parametrize("spread", [0.0, 0.2, 0.5])
def test_the_relative_scatter_between_recordings_is_that_planted(spread):
    one = with_values(2.0 * (1 + spread * np.resize([1.0, -1.0], 8)), rows=200, noise=0.1)
    assert scatter_between_recordings(one, one.score((0,)), 0) == pytest.approx(spread, rel=0.05, abs=0.02)


def test_recordings_in_which_a_law_hardly_acts_tell_nothing_of_its_scatter():
    one = with_values(2.0, rows=200, noise=0.1)
    X = one.view.library.parts[0].copy()
    slight = one.view.library.design.problem.group_of > 1
    one.view.library.design.y[slight] -= 2.0 * X[slight][..., 0]
    X[slight] *= 0.01  # of which noise makes sizes of any amount
    faint = Search(WeightedLibrary(one.whitened.__class__(one.view.library.design, one.whitened.unknown, one.whitened.v),
                                   Library(one.view.library.design, one.view.library.hypotheses, (X,), one.view.library.scale)), one.start)
    assert scatter_between_recordings(faint, faint.score((0,)), 0) < 0.02


def test_values_of_each_recording_s_own_have_no_scatter_between_recordings():
    one = with_values([1.0, -1.0] * 4, noise=0.05, laws=(law("law_0", per_recording=True), *LAWS[1:]))
    assert scatter_between_recordings(one, one.score((0,)), 0) == 0.0


def _late_arm():
    """The search on an arm whose torques all come late, the set that was found, and the delay in it."""
    found = searched("late")
    claimed = found.decided.claimed
    return found.search, claimed, next(k for k in claimed.chosen if found.search.key(k) == ("sensor_timing", 0))


@pytest.mark.slow
def test_a_delay_of_the_torque_sensor_has_one_size_for_inertia_and_drag():
    assert scatter_between_parts(*_late_arm()) < 0.05


def _arm_whose_drag_is_late():
    """The same where the drag alone is late."""
    one, claimed, late = _late_arm()
    library, design, at = one.view.library, one.view.library.design, claimed.places(one.view)[late]
    parts = _parts(one, claimed, late, claimed.fit.mean[at])
    other = replace(design, y=design.y - parts.sum(axis=2) + parts[..., 1])
    view = WeightedLibrary(WhiteRows(other, one.whitened.unknown, one.whitened.v), replace(library, design=other))
    lagged = Search(view, one.start)
    return lagged, lagged.score(claimed.chosen), late


@pytest.mark.slow
def test_a_delay_of_the_drag_alone_has_not():
    assert scatter_between_parts(*_arm_whose_drag_is_late()) > 0.3


@pytest.mark.slow
def test_the_parts_make_up_the_member_whatever_the_terms_alone_leave_of_it(monkeypatch):
    arm, true = _arm_whose_drag_is_late(), scatter._parts
    whole = scatter_between_parts(*arm)
    monkeypatch.setattr(scatter, "_parts", lambda *given: true(*given) * np.array([1.0] * (true(*given).shape[2] - 1) + [0.5]))
    assert scatter_between_parts(*arm) == pytest.approx(whole, rel=0.02)


@pytest.mark.slow
def test_a_size_for_each_part_gains_what_two_fits_say_less_one_half_nat_a_size(monkeypatch):
    """Of parts drawn at random, sizes of their own gain as noise does: twice the nats are more than their number less one in some draws."""
    one, claimed, late = _late_arm()
    fit, _, torque = scatter._torque(one, claimed, late)
    rng, sw = np.random.default_rng(0), fit.whitened.sw
    gains = []
    for _ in range(40):
        split = rng.standard_normal((*torque.shape, 30)) * np.abs(torque).mean() / sw[..., None]
        monkeypatch.setattr(scatter, "_parts", lambda *given, split=split: split)
        gains.append(scatter_between_parts(one, claimed, late) > 0)
    assert 0.05 < np.mean(gains) < 0.8


def test_what_acts_on_no_part_of_the_torque_has_no_scatter_between_parts():
    one = with_values(2.0, rows=50)
    assert scatter_between_parts(one, one.score((0,)), 0) == 0.0
