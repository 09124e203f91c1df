"""The truth as a model: what it errs on motions as recorded is what no model can mend."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from nnhydro.blind_tests.conceal import _csv
from nnhydro.blind_tests.oracle import true_torque
from nnhydro.blind_tests.truth.campaign import Wish, _expected_torque, draw_campaign
from nnhydro.blind_tests.truth.registry import makers
from nnhydro.blind_tests.truth.sensors import FINE

FULL, RARE, BELT = 5, 6, 3  # seeds of recorders of every derivative, and of angles alone; the third has a belt besides


def error(drawn, columns=lambda unseen: unseen.links):
    """sum|predicted - truth| / sum|truth| over the unseen motions."""
    wrong = total = 0.0
    for name, unseen in drawn.unseen.items():
        truth = np.array(drawn.answer["unseen"][name]["tau_Nm"])
        wrong += np.abs(true_torque(unseen, drawn.arm, _csv(columns(unseen))) - truth).sum()
        total += np.abs(truth).sum()
    return wrong / total


@cache
def healthy(seed):
    """Two healthy links as the recorder of that seed sees them."""
    return draw_campaign(seed, 0, Wish("none", links=2, size="small"))


def exact(unseen):
    """The motion as it was, every derivative given; behind a belt the second encoder sees both joints."""
    run = unseen.run
    columns = {"t_s": run.t}
    for label, x in (("q{}_rad", run.q), ("dq{}_rad_s", run.qd), ("ddq{}_rad_s2", run.qdd)):
        seen = np.cumsum(x, axis=1) if unseen.arm.belt else x
        columns |= {label.format(j + 1): seen[:, j] for j in range(x.shape[1])}
    columns |= {"u0_m_s": run.u0, "du0_m_s2": run.du0} if run.u0.any() else {}
    return {key: x[::FINE] for key, x in columns.items()}


@pytest.mark.parametrize("seed", [RARE, BELT])
def test_on_the_exact_motion_the_truth_is_right_to_the_last_digit_of_the_file(seed):
    drawn = healthy(seed)
    assert drawn.answer["belt"] == (seed == BELT)
    assert error(drawn, exact) < 2e-4


@pytest.mark.parametrize("cause", ["flow_memory", "history_force", "wake_reentry", "wake_development", "sensor_timing", "torque_ripple"])
def test_what_remembers_is_stepped_as_finely_as_in_the_run(cause):
    drawn = healthy(RARE)
    unseen = next(iter(drawn.unseen.values()))
    draft = makers()[cause](np.random.default_rng(2), unseen.arm)
    with_it = replace(unseen, causes=(draft.make(np.sqrt(draft.low * draft.high)),))
    run, exact_truth = unseen.run, [_expected_torque(unseen.run, unseen.arm, causes)[::FINE] for causes in (with_it.causes, ())]
    said = true_torque(with_it, drawn.arm, _csv(exact(with_it)))
    assert run.dt == pytest.approx(1 / (50.0 * FINE))
    assert np.abs(said - exact_truth[0]).sum() < 0.05 * np.abs(exact_truth[1] - exact_truth[0]).sum()


@pytest.mark.slow
def test_the_phases_of_chance_that_were_drawn_are_not_known():
    drawn = healthy(FULL)
    unseen = next(iter(drawn.unseen.values()))
    wave = makers()["wave_orbital"](np.random.default_rng(2), unseen.arm).make(0.2)
    with_it = replace(unseen, causes=(wave,))
    truth, mean = _expected_torque(unseen.run, unseen.arm, (wave,))[::FINE], _expected_torque(unseen.run, unseen.arm, (wave,), 100)[::FINE]
    said = true_torque(with_it, drawn.arm, _csv(exact(with_it)))
    assert 0.3 < np.abs(said - truth).sum() / np.abs(mean - truth).sum() < 3


def test_derivatives_that_have_to_be_taken_cost_more_than_those_that_are_given():
    assert [healthy(seed).answer["given"] for seed in (FULL, RARE)] == ["all", "none"]
    assert 0 < error(healthy(FULL)) < error(healthy(RARE))


@pytest.mark.slow
def test_angles_of_a_compliant_drive_are_not_held_against_the_truth():
    drawn = draw_campaign(3, 0, Wish("encoder_offset", "strong", 1, size="small"))
    seen = {f"unseen/{name}.csv": unseen.links for name, unseen in drawn.unseen.items()}
    assert any(not np.array_equal(links["q1_rad"], drawn.files[file]["q1_rad"]) or
               not np.array_equal(links.get("q2_rad"), drawn.files[file].get("q2_rad")) for file, links in seen.items())
    assert error(drawn) < error(drawn, lambda unseen: drawn.files[f"unseen/{unseen.run.name}.csv"])
