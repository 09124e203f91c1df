"""What no finding explains: on what the unknown depends, how sure it is, and recordings in which more remains than noise leaves."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from problems import design, law, search, unknown

from nnhydro.diagnosis.constants import DETECTED, FORM, MATERIAL, P_ALARM, UNLIKE_NOISE
from nnhydro.diagnosis.noise.spectrum import white_noise
from nnhydro.diagnosis.unexplained import unexplained
from nnhydro.diagnosis.unexplained.unexplained import (
    Dependence,
    Remainder,
    p_of,
    unexplained_of,
    unknown_parts,
    unlike_recordings,
    unlisted_weight,
)

LAWS = (law("a"), law("b"))


def with_unknown(size, group=0, joint=0, undriven=False):
    """A search on rows in which an unknown of one group of its columns acts at one joint."""
    of = design(3, groups=8, rows=60, noise=0.05)
    of.undriven, of.part_scale = undriven, np.array([100.0, 100.0])
    phi = unknown(of)
    of.y[:, joint] += size * phi.Phi[:, phi.group == group] @ np.array([1.0, 0.5, 0.2])
    return search(of, LAWS, np.random.default_rng(8).standard_normal((*of.y.shape, 2)), level=0.05**2)


@pytest.mark.parametrize(("group", "name"), [(0, "q1_rad"), (1, "pairs")])
@pytest.mark.parametrize("joint", [0, 1])
def test_the_unknown_depends_on_the_variable_and_lies_at_the_joint_where_it_was_put(group, name, joint):
    one = with_unknown(0.5, group, joint)
    parts = unknown_parts(one, one.score(()))
    assert parts[joint].depends_on == (name,)
    assert parts[joint].real
    assert not parts[1 - joint].real


def test_the_share_of_the_unknown_is_its_rms_over_that_of_the_torque_less_what_the_baseline_can_take():
    one = with_unknown(0.5, joint=1)
    of, fit = one.view.library.design, one.score(()).fit
    white = one.whitened
    u = white.unknown.Phi @ fit.mean[white.p + white.m:white.p + 2 * white.m]
    u -= of.Y[:, 1] @ np.linalg.pinv(of.Y[:, 1]) @ u
    assert unknown_parts(one, one.score(()))[1].share == pytest.approx(np.sqrt((u**2).sum() / of.duration) / of.scale[1])


def test_where_nothing_is_driven_the_unknown_is_a_share_of_the_weight():
    driven, free = (unknown_parts(one := with_unknown(0.5, undriven=undriven), one.score(()))[0].share for undriven in (False, True))
    assert free == pytest.approx(driven / (FORM * 100.0))


@pytest.mark.parametrize(("share", "on", "real"), [(MATERIAL, ("q1_rad",), True), (0.99 * MATERIAL, ("q1_rad",), False), (0.5, (), False)])
def test_an_unknown_is_worth_reporting_from_a_hundredth_of_the_torque_on_some_variable(share, on, real):
    assert Dependence(1, share, on).real == real


def test_the_p_of_no_unknown_halves_its_nats_and_pays_for_every_size():
    one = with_unknown(0.0)
    found = one.score(())
    p = [p_of(one, replace(found, unknown_nats=nats)) for nats in (0.0, 10.0, 12.0, 1e4)]
    assert p[0] == 1.0
    assert p[1] == pytest.approx(found.sizes.tau.size * np.exp(-5))
    assert p[2] == pytest.approx(p[1] / np.e)
    assert p[3] == 1e-12


def rest_of(one, after, floor, fitted, monkeypatch, loud=(), nats=0.0):
    """What is left beside the empty set at given errors: held out, of noise alone, fitted to all."""
    monkeypatch.setattr(unexplained, "fitted_error", lambda *_: fitted)
    monkeypatch.setattr(unexplained, "recordings_with_changed_parameters", lambda *_: ())
    monkeypatch.setattr(unexplained, "unlike_recordings", lambda *_: loud)
    monkeypatch.setattr(unexplained, "strongest", lambda *_: None)
    monkeypatch.setattr(unexplained, "_whiten", lambda *_: [])
    one.view.library.design.problem.edge = 1.0
    noise = white_noise(one.view.library.design)
    return unexplained_of(one, replace(one.score(()), unknown_nats=nats), SimpleNamespace(after=after, remains=[]), (), floor, noise)


@pytest.mark.parametrize(("after", "fitted", "alarm"), [
    (0.031 * UNLIKE_NOISE / 3, 0.031 * UNLIKE_NOISE / 3, True),
    (0.029 * UNLIKE_NOISE / 3, 0.029 * UNLIKE_NOISE / 3, False),  # less than three times the noise
    (0.2, 0.02, False),  # for want of recordings alone: all of them are fitted well
])
def test_an_error_of_three_times_the_noise_is_an_alarm_unless_it_is_for_want_of_recordings(after, fitted, alarm, monkeypatch):
    rest = rest_of(with_unknown(0.0), after, 0.01, fitted, monkeypatch)
    assert rest.detected == alarm
    assert rest.p_value == (P_ALARM if alarm else 1.0)
    assert rest.share == after


def test_a_recording_unlike_others_is_an_alarm_by_itself(monkeypatch):
    rest = rest_of(with_unknown(0.0), 0.01, 0.01, 0.01, monkeypatch, loud=("run3",))
    assert (rest.detected, rest.p_value, rest.recordings) == (True, P_ALARM, ("run3",))


@pytest.mark.parametrize(("nats", "detected"), [(DETECTED, True), (DETECTED - 0.1, False)])
def test_the_unknown_is_detected_from_its_nats_on_and_weighs_half_there(nats, detected, monkeypatch):
    rest = rest_of(with_unknown(0.5), 0.01, 0.01, 0.01, monkeypatch, nats=nats)
    assert rest.detected == detected
    assert bool(rest.learned) == detected
    assert rest.weight == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("nats", [0.0, DETECTED - 0.1, DETECTED, 1e4])
@pytest.mark.parametrize("size", [0.0, 0.5])
@pytest.mark.parametrize("loud", [(), ("run3",)])
def test_a_cause_outside_the_catalogue_is_probable_exactly_where_one_is_detected(nats, size, loud, monkeypatch):
    rest = rest_of(with_unknown(size), 0.01, 0.01, 0.01, monkeypatch, loud=loud, nats=nats)
    assert rest.detected == (rest.weight >= 0.5)
    assert rest.detected == (rest.p_value < 1)


def test_an_unknown_too_small_to_be_reported_weighs_nothing_and_an_alarm_as_much_as_its_p_value_allows():
    assert unlisted_weight(1e4, False, []) == 0.0
    assert unlisted_weight(1e4, True, []) == pytest.approx(1.0)
    assert unlisted_weight(0.0, True, [0.05]) == pytest.approx(0.711, abs=1e-3), "a p-value of 0.05 is odds of 2.5 at the most"
    assert unlisted_weight(0.0, False, [0.05, P_ALARM]) == pytest.approx(0.982, abs=1e-3)


def loudness(shares, levels=None, towed=True):
    """The noise of recordings whose rows hold `shares` of unit noise, over torques of white noise of the given `levels`."""
    of = design(5, groups=len(shares), rows=60, joints=1)
    rng = np.random.default_rng(0)
    levels = np.ones(len(shares)) if levels is None else levels
    of.problem.edge = 1e4
    of.problem.stretches = [SimpleNamespace(group=g, name=f"run{g}", segment=SimpleNamespace(
        steady=False, tau=level * rng.standard_normal((400, 1)))) for g, level in enumerate(levels)]
    return replace(white_noise(of), sigma2=np.square(np.asarray(shares, float))[:, None]), of


@pytest.mark.parametrize(("factor", "named"), [(14.0, ("run2",)), (7.0, ())])
def test_a_recording_in_which_ten_times_as_much_remains_as_in_others_is_unlike_them(factor, named):
    assert unlike_recordings(*loudness([1, 1, factor, 1, 1])) == named


def test_a_recording_that_is_noisy_from_sample_to_sample_is_not_unlike_others():
    assert unlike_recordings(*loudness([1, 1, 50, 1, 1], levels=[1, 1, 50, 1, 1])) == ()


def test_a_recording_in_which_the_drive_jumps_is_not_unlike_others():
    """What a jump, known to a row, leaves in the band says nothing of the machine."""
    noise, of = loudness([1, 1, 14, 1, 1])
    jumps = of.problem.stretches[2].segment
    jumps.tau = jumps.tau + 20.0 * np.sign(np.sin(np.arange(400) / 30))[:, None]
    assert unlike_recordings(noise, of) == ()


def test_recordings_without_jumps_are_not_unlike_those_with_jumps():
    noise, of = loudness([1, 1, 1, 1, 1])
    for stretch in of.problem.stretches[:2]:
        stretch.segment.tau = stretch.segment.tau + 50.0 * np.sign(np.sin(np.arange(400) / 30))[:, None]
    assert unlike_recordings(noise, of) == ()


def test_of_three_recordings_none_is_called_unlike_the_others():
    assert unlike_recordings(*loudness([1, 50, 1])) == ()


def test_a_remainder_tells_its_variables_only_where_it_is_detected():
    law_ = Dependence(1, 0.2, ("q1_rad", "dq1_rad_s"))
    found, hidden = (Remainder(detected, 0.1, 0.9, 0.001, (law_,)).document() for detected in (True, False))
    assert found["depends_on"] == ["dq1_rad_s", "q1_rad"]
    assert hidden["depends_on"] == []
    assert found["weight"] == 0.9
