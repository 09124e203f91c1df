"""Derivatives, gaps and the one low-pass: what happens to a recording before any model sees it."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import GIVEN, angles_only, dry, multi_sine, planted, recording, sensor_torque, steady_table, write_csv
from filtered_motions import noisy_run, run_at
from rigs import arm

from nnhydro.errors import RecordingError
from nnhydro.physics.motion import Motion
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation, plan, prepare, resample, steady_segment
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.recording import Recording

AT_15 = Preparation(LowPass(15.0))


def relative(got, want, keep):
    """Largest deviation on the rows `keep`, relative to the largest value."""
    return float(np.abs(got - want)[keep].max() / np.abs(want[keep]).max())


@pytest.mark.parametrize(("rate", "rates_within", "accelerations_within"), [(100.0, 1e-3, 2e-3), (250.0, 1e-3, 2e-3)])
def test_rates_and_accelerations_of_a_known_motion_are_recovered(rate, rates_within, accelerations_within):
    r, qd, qdd = run_at(np.arange(0, 6, 1 / rate))
    (segment,) = prepare(r, AT_15)
    assert relative(segment.qd, qd, segment.keep) < rates_within
    assert relative(segment.qdd, qdd, segment.keep) < accelerations_within


def test_a_coarse_encoder_costs_few_per_cent_at_the_cutoff_that_the_data_choose():
    r, qd, qdd = run_at(np.arange(0, 8, 0.01), step=2 * np.pi / 4096)
    how = plan(iter([r]))
    (segment,) = prepare(r, how)
    assert how.low_pass is not None
    assert relative(segment.qd, qd, segment.keep) < 0.02
    assert np.sqrt(((segment.qdd - qdd)[segment.keep] ** 2).mean() / (qdd[segment.keep] ** 2).mean()) < 0.08


@pytest.mark.parametrize("scatter", [0.05, 0.15, 0.4])
def test_rows_at_random_times_take_nothing_from_the_torque(scatter: float):
    dt, random = 0.02, np.random.default_rng(3)
    t = dt * (np.arange(1500) + random.uniform(-scatter, scatter, 1500))
    wave = np.column_stack([np.sin(2 * np.pi * f * t) for f in (1.0, 3.0)])  # 50 and 17 rows per period
    even = resample(Recording("run", t, wave, wave), 0, len(t))
    truth = np.column_stack([np.sin(2 * np.pi * f * even.t) for f in (1.0, 3.0)])
    inner = slice(10, -10)
    assert even.tau is not None
    for x in (even.q, even.tau):
        share = (x[inner] * truth[inner]).sum(axis=0) / (truth[inner] ** 2).sum(axis=0)
        assert np.abs(share - 1).max() < 5e-4  # straight lines: 1 % and more


def test_two_rows_at_almost_the_same_time_are_no_slope():
    random = np.random.default_rng(4)
    t = np.sort(np.concatenate([0.01 * np.arange(1000), 0.01 * np.arange(5, 995, 10) + 1e-6]))
    noise = random.standard_normal((len(t), 2))
    even = resample(Recording("run", t, noise, noise), 0, len(t))
    assert even.tau is not None
    assert even.tau.std() < 1.05
    assert even.q.std() < 1.05


def test_uneven_sampling_costs_little():
    t = np.cumsum(np.random.default_rng(1).uniform(0.002, 0.008, 1500))
    r, _, _ = run_at(t)
    (segment,) = prepare(r, AT_15)
    q, qd, qdd = multi_sine(segment.t, 2, 1)
    assert np.ptp(np.diff(segment.t)) < 1e-9
    assert relative(segment.q, q, segment.keep) < 1e-4
    assert relative(segment.qd, qd, segment.keep) < 1e-3
    assert relative(segment.qdd, qdd, segment.keep) < 5e-3


def test_a_gap_makes_two_segments_that_never_reach_into_it():
    t = np.arange(0, 6, 0.01)
    r, _, _ = run_at(np.delete(t, slice(250, 330)))
    before, after = prepare(r, AT_15)
    assert before.t[-1] == pytest.approx(2.49)
    assert after.t[0] == pytest.approx(3.30)
    assert (before.start_row, before.stop_row, after.start_row, after.stop_row) == (0, 250, 250, len(r))


@pytest.mark.parametrize("channel", ["q", "tau", "u0"])
def test_rows_that_are_not_finite_split_the_recording_and_are_never_filled(channel):
    r = angles_only(recording(arm(2), planted(arm(2)), speed=0.4))
    broken = np.array(getattr(r, channel))
    broken[200:203] = np.nan
    parts = list(prepare(replace(r, **{channel: broken}), AT_15))
    assert [(p.start_row, p.stop_row) for p in parts] == [(0, 200), (203, len(r))]
    assert all(np.isfinite(getattr(p, name)).all() for p in parts for name in ("q", "qd", "qdd", "u0", "du0", "tau"))


def test_only_an_empty_torque_leaves_the_motion_whole_when_torque_is_not_asked_for():
    r = recording(arm(2), planted(arm(2)))
    (segment,) = prepare(replace(r, tau=np.full_like(r.tau, np.nan)), AT_15, with_torque=False)
    assert len(segment) == len(r)
    assert segment.tau is None


@pytest.mark.parametrize(("shift", "said"), [(-0.05, "runs backward at row 101"), (-0.01, "repeats at row 101")])
def test_time_that_does_not_advance_is_refused_with_its_row(shift, said):
    # the header is row 1, so t[99], the last that can be right, stands in row 101
    t = np.arange(0, 3, 0.01)
    t[100:] += shift
    r, _, _ = run_at(np.round(t, 9))
    with pytest.raises(RecordingError, match=said):
        list(prepare(r, AT_15))


def test_torque_and_model_pass_the_same_filter_so_an_exact_model_leaves_nothing():
    a = arm(2)
    r = recording(a, planted(a), seconds=8.0, highest=2.5)
    (segment,) = prepare(angles_only(r), AT_15)
    model = segment.filter(sensor_torque(a, planted(a), Motion.of(segment)))
    assert relative(model, segment.tau, segment.keep) < 5e-3
    rough = sensor_torque(a, planted(a), Motion.of(segment))  # the filter of the states alone is not that of the torque
    sharp = r.tau + 0.5 * np.sin(2 * np.pi * 22 * r.t)[:, None]
    (noisy,) = prepare(replace(angles_only(r), tau=sharp), AT_15)
    assert np.abs(noisy.tau - model)[segment.keep].max() < 0.3 * np.abs(sharp - rough)[segment.keep].max()


def test_the_ends_that_the_filter_touches_are_not_compared():
    r, _, _ = run_at(np.arange(0, 6, 0.01))
    (segment,) = prepare(r, AT_15)
    assert not segment.keep[:20].any()
    assert not segment.keep[-20:].any()
    assert segment.keep[20:-20].all()
    (short,) = prepare(Recording("s", r.t[:30], r.q[:30], r.tau[:30]), AT_15)
    assert short.keep.sum() >= 15


def test_where_every_derivative_is_given_nothing_is_filtered():
    r = recording(arm(2), planted(arm(2)), speed=0.4)
    assert plan(iter([r])) == GIVEN
    (segment,) = prepare(r, GIVEN)
    assert segment.keep.all()
    for name in ("q", "qd", "qdd", "tau", "u0", "du0"):
        assert np.array_equal(getattr(segment, name), getattr(r, name)), name


def test_a_given_cutoff_is_respected():
    assert plan(iter([noisy_run(1e-3)]), 7.5).low_pass == LowPass(7.5)
    assert plan(iter([recording(arm(2), dry(arm(2)))]), 7.5).low_pass == LowPass(7.5)


def test_a_preparation_survives_its_document():
    for how in (GIVEN, Preparation(LowPass(12.34, 3), "qd")):
        assert Preparation.parse(how.document()) == how


def test_steady_tables_are_compared_row_by_row_and_never_filtered():
    a = arm(2)
    table = steady_table(a, planted(a))
    segment = steady_segment(table)
    assert segment.steady
    assert segment.keep.all()
    assert np.array_equal(segment.tau, table.tau)
    assert np.array_equal(segment.filter(table.tau), table.tau)
    assert not segment.qdd.any()


@pytest.mark.parametrize("ratio", [1.0, 1.5])
def test_a_belt_motors_angle_becomes_the_joints(tmp_path, ratio):
    a = arm(2, drive={"kind": "remote", "pulley_ratio": ratio, "angle2": "absolute"})
    t = np.arange(0, 1, 0.01)
    q, qd, _ = multi_sine(t, 2)
    psi, dpsi = ({"1": x[:, 0], "2": x[:, 0] + x[:, 1] / ratio} for x in (q, qd))
    columns = {"t_s": t} | {f"q{j}_rad": x for j, x in psi.items()} | {f"dq{j}_rad_s": x for j, x in dpsi.items()}
    read = read_recording(write_csv(tmp_path / "run.csv", columns | {"tau1_Nm": t, "tau2_Nm": t}), a)
    np.testing.assert_allclose(read.q, q, atol=1e-12)
    np.testing.assert_allclose(read.qd, qd, atol=1e-12)
