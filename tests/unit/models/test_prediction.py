"""A prediction has one finite row for every row of the motion, at the very same times, whatever the motion's file is like."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import TINY, angles_only, campaign, columns_of, multi_sine, planted, recording, sensor_torque, write_csv
from hypothesis import given
from hypothesis import strategies as st
from rigs import arm

from nnhydro.errors import NnhydroError, RecordingError
from nnhydro.fitting.network.train import train
from nnhydro.models.prediction import predict, write_prediction
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation, prepare
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.recording import Recording

HOW = Preparation(LowPass(12.0))


def model_of(a, how=HOW):
    return StripTheory(a, how, {}, "constant", planted(a))


def motion_at(t, links=2, seed=1, **keys):
    """Angles alone at the times t."""
    return Recording("m", np.asarray(t, float), multi_sine(t, links, seed)[0], **keys)


def torques_at(t, a, seed=1):
    """What the model says for the exact derivatives."""
    q, qd, qdd = multi_sine(t, a.n_links, seed)
    zero = np.zeros(len(t))
    return sensor_torque(a, planted(a), Motion(tensor(t), tensor(q), tensor(qd), tensor(qdd), tensor(zero), tensor(zero)))


def complete(prediction, motion):
    """One finite row per row, in order, at the same times bit for bit."""
    assert np.array_equal(prediction.t, motion.t)
    assert prediction.tau.shape == motion.q.shape
    assert np.isfinite(prediction.tau).all()
    if prediction.std is not None:
        assert prediction.std.shape == motion.q.shape
        assert np.isfinite(prediction.std).all()
    return prediction


def relative(got, want):
    return float(np.abs(got - want).max() / np.abs(want).max())


T = np.arange(0, 5, 0.01)


@pytest.mark.parametrize("links", [1, 2, 3])
def test_the_torques_are_the_models_for_the_derivatives_of_the_motion(links):
    a = arm(links)
    prediction = complete(predict(model_of(a), motion_at(T, links)), motion_at(T, links))
    assert relative(prediction.tau[50:-50], torques_at(T, a)[50:-50]) < 0.01


def test_the_low_pass_suits_the_motion_and_not_the_campaign_that_the_model_was_made_with():
    slow, fast = (predict(model_of(arm(2), Preparation(LowPass(f))), motion_at(T)).tau for f in (2.0, 20.0))
    assert np.array_equal(slow, fast)
    assert relative(slow[50:-50], torques_at(T, arm(2))[50:-50]) < 0.01


def test_noise_of_the_encoders_is_smoothed_before_it_is_differentiated():
    noisy = replace(motion_at(T), q=motion_at(T).q + 2e-4 * np.random.default_rng(0).standard_normal((len(T), 2)))
    want, smoothed = torques_at(T, arm(2)), predict(model_of(arm(2)), noisy).tau
    (segment,) = prepare(noisy, Preparation(None), with_torque=False)
    rough = model_of(arm(2)).torque(Motion.of(segment)).numpy()
    assert relative(smoothed[50:-50], want[50:-50]) < 0.1
    assert relative(rough[50:-50], want[50:-50]) > 1.0


@pytest.mark.parametrize(("degrees", "inside", "whole"), [(0.0, 1e-6, 1e-4), (0.01, 0.003, 0.01), (0.05, 0.01, 0.02)])
def test_torques_of_noisy_angles_lose_neither_the_motion_nor_the_ends(degrees, inside, whole):
    q = motion_at(T).q + np.radians(degrees) * np.random.default_rng(0).standard_normal((len(T), 2))
    want = torques_at(T, arm(2))
    error = predict(model_of(arm(2)), replace(motion_at(T), q=q)).tau - want
    for rows, largest in ((slice(50, -50), inside), (slice(None), whole)):
        assert float(np.sqrt((error[rows] ** 2).mean() / (want[rows] ** 2).mean())) < largest


def test_a_given_cutoff_replaces_the_chosen_one_and_smooths_given_derivatives_too():
    a = arm(2)
    r = recording(a, planted(a), speed=0.4)
    chosen, given_one = predict(model_of(a), motion_at(T)), predict(model_of(a), motion_at(T), 2.0)
    assert given_one.cutoff_hz == 2.0 != chosen.cutoff_hz
    assert not np.allclose(given_one.tau, chosen.tau)
    assert predict(model_of(a), r).cutoff_hz is None
    assert not np.allclose(predict(model_of(a), r, 1.0).tau, r.tau)
    with pytest.raises(NnhydroError, match="above half the sampling rate"):
        predict(model_of(a), motion_at(T), 80.0)


def test_given_derivatives_are_taken_as_they_are():
    a = arm(2)
    r = recording(a, planted(a), speed=0.4)
    assert relative(complete(predict(model_of(a), r), r).tau, r.tau) < 1e-9
    assert relative(predict(model_of(a, Preparation(None)), r).tau, r.tau) < 1e-9


def test_a_tenth_of_a_second_from_either_end_the_prediction_is_right_again():
    error = np.abs(predict(model_of(arm(2)), motion_at(T)).tau - torques_at(T, arm(2))).max(1) / np.abs(torques_at(T, arm(2))).max()
    assert error.max() < 0.5  # at the very ends nothing tells the acceleration
    assert error[10:-10].max() < 0.05


def test_torques_in_the_file_are_ignored(tmp_path):
    a = arm(2)
    r = angles_only(recording(a, planted(a), speed=0.4))
    plain = write_csv(tmp_path / "plain.csv", columns_of(r, torque=False))
    junk = write_csv(tmp_path / "junk.csv", columns_of(replace(r, tau=np.full_like(r.tau, np.nan))))
    text = junk.read_text().replace("nan", "broken")
    (tmp_path / "text.csv").write_text(text)
    want = predict(model_of(a), read_recording(plain, a, torque=False))
    for name in ("junk.csv", "text.csv"):
        got = predict(model_of(a), read_recording(tmp_path / name, a, torque=False))
        assert np.array_equal(got.tau, want.tau)
    assert np.array_equal(predict(model_of(a), replace(r, tau=np.full_like(r.tau, np.nan))).tau, want.tau)


def test_times_come_back_digit_for_digit(tmp_path):
    t = np.cumsum(np.random.default_rng(1).uniform(0.002, 0.008, 800)) + 1.7e9  # seconds since 1970
    motion = motion_at(t - t[0])
    motion = replace(motion, t=t)
    prediction = complete(predict(model_of(arm(2)), motion), motion)
    lines = write_prediction(prediction, tmp_path / "m.csv").read_text().splitlines()
    assert lines[0] == "t_s,tau1_Nm,tau2_Nm"
    assert [float(line.split(",")[0]) for line in lines[1:]] == t.tolist()


def test_a_model_that_knows_its_uncertainty_writes_it(tmp_path):
    a = arm(2)
    model = train(campaign(a, planted(a), 3, seconds=1.0, rate=50.0), TINY.model_copy(update={"epochs": 1}))
    prediction = complete(predict(model, motion_at(T)), motion_at(T))
    header, *rows = write_prediction(prediction, tmp_path / "m.csv").read_text().splitlines()
    assert header == "t_s,tau1_Nm,tau2_Nm,tau1_std_Nm,tau2_std_Nm,outside"
    np.testing.assert_allclose([float(x) for x in rows[7].split(",")[1:]], [*prediction.tau[7], *prediction.std[7], prediction.outside[7]],
                               rtol=1e-8)


def test_uneven_samples_are_predicted_at_their_own_times():
    t = np.cumsum(np.random.default_rng(1).uniform(0.002, 0.008, 1000))
    prediction = complete(predict(model_of(arm(2)), motion_at(t)), motion_at(t))
    assert relative(prediction.tau[50:-50], torques_at(t, arm(2))[50:-50]) < 0.02


def test_a_gap_in_the_middle_is_predicted_on_both_sides():
    t = np.delete(T, slice(200, 260))
    prediction = complete(predict(model_of(arm(2)), motion_at(t)), motion_at(t))
    want, away = torques_at(t, arm(2)), np.r_[50:150, 250:390]
    assert relative(prediction.tau[away], want[away]) < 0.02


def test_a_gap_and_what_is_too_short_are_named():
    t = np.concatenate([T[:200], T[200:] + 5.0])
    motion = replace(motion_at(t), q=motion_at(T).q)
    prediction = predict(model_of(arm(2)), motion)
    assert prediction.document()["notes"] == list(prediction.notes)
    assert [note.split(":")[1] for note in prediction.notes] == [" time jumps by 5.01 s at row 202"]
    error = np.abs(prediction.tau - torques_at(T, arm(2)))[190:210].max() / np.abs(torques_at(T, arm(2))).max()
    assert error < 0.02  # either side has an end of its own
    (short,) = predict(model_of(arm(2)), motion_at(T[:30])).notes
    assert "0.29 s without a gap are too short to tell motion from noise" in short
    assert predict(model_of(arm(2)), motion_at(T[:30]), 8.0).notes == predict(model_of(arm(2)), motion_at(T)).notes == ()
    (lost,) = predict(model_of(arm(2)), motion_at(np.delete(T, slice(5, 60)))).notes[1:]
    assert "5 rows in parts of fewer than 12 rows" in lost


@pytest.mark.parametrize("cut", [(5, 60), (200, 203), (430, 495)])
def test_a_stretch_of_a_few_rows_beside_a_gap_gets_its_rows(cut):
    t = np.delete(T, slice(*cut))
    complete(predict(model_of(arm(2)), motion_at(t)), motion_at(t))


@pytest.mark.parametrize("links", [1, 2])
@pytest.mark.parametrize("rows", [4, 5, 6, 8, 11, 12, 13, 20])
@pytest.mark.parametrize("how", [HOW, Preparation(None)], ids=["filtered", "unfiltered"])
def test_very_short_motions_are_predicted(rows, links, how):
    motion = motion_at(T[:rows], links)
    complete(predict(model_of(arm(links), how), motion), motion)
    r = recording(arm(links), planted(arm(links)))
    given_rates = r.rows(slice(0, rows), "start")
    assert relative(complete(predict(model_of(arm(links), how), given_rates), given_rates).tau, given_rates.tau) < 1e-9


@given(st.lists(st.floats(1e-3, 0.05), min_size=3, max_size=60), st.integers(1, 3))
def test_any_increasing_times_give_a_complete_prediction(steps, links):
    t = np.concatenate([[0.0], np.cumsum(steps)])
    complete(predict(model_of(arm(links)), motion_at(t, links)), motion_at(t, links))


def test_a_missing_carriage_is_a_carriage_at_rest():
    still = replace(motion_at(T), u0=np.zeros(len(T)))
    assert np.array_equal(predict(model_of(arm(2)), motion_at(T)).tau, predict(model_of(arm(2)), still).tau)
    towed = replace(motion_at(T), u0=np.full(len(T), 0.5))
    assert np.abs(predict(model_of(arm(2)), towed).tau - predict(model_of(arm(2)), still).tau).max() > 0.1


def test_a_noisy_carriage_is_filtered_even_where_the_joints_rates_are_given():
    a = arm(2)
    r = recording(a, planted(a), speed=0.5)
    noisy = replace(r, u0=r.u0 + 1e-3 * np.random.default_rng(1).standard_normal(len(r)), du0=None)
    assert relative(predict(model_of(a), noisy).tau[50:-50], r.tau[50:-50]) < 0.03


@pytest.mark.parametrize(("channel", "said"), [("q", "an angle"), ("u0", "u0_m_s"), ("t", "t_s")])
def test_a_motion_that_is_not_known_everywhere_is_refused_with_its_row(channel, said):
    motion = replace(motion_at(T), u0=np.zeros(len(T)))
    broken = np.array(getattr(motion, channel))
    broken[30] = np.nan
    with pytest.raises(RecordingError, match=f"row 32: {said}"):
        predict(model_of(arm(2)), replace(motion, **{channel: broken}))


def test_time_that_runs_backward_is_refused():
    t = T.copy()
    t[100:] -= 0.5
    with pytest.raises(RecordingError, match="backward"):
        predict(model_of(arm(2)), motion_at(t))


def test_a_motion_of_another_arm_is_refused():
    with pytest.raises(RecordingError, match=r"1 joint\(s\), the model's arm has 2"):
        predict(model_of(arm(2)), motion_at(T, 1))


def test_a_prediction_that_cannot_be_written_is_refused_in_one_line(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(NnhydroError, match="cannot be written"):
        write_prediction(predict(model_of(arm(2)), motion_at(T)), tmp_path / "file" / "m.csv")
