"""The unknown's columns: cosines over places in the range, memories from their start, and a constant for steady tables alone."""

from functools import cache

import numpy as np
import pytest
from campaigns import campaign, planted, steady_table
from rigs import arm

from nnhydro.diagnosis.model.unknown import CONSTANT, COSINES, PAIRED, PAIRS, SLOWED, Unknown, _low_pass, _travel, unknown_of, variables
from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

TWO = arm(2)


@cache
def made(tables=0):
    """The design of recordings and `tables` steady tables, and the unknown on its rows."""
    runs = campaign(TWO, planted(TWO), count=3, noise=0.01).recordings()
    whole = Campaign.of(TWO, list(runs), tuple(steady_table(TWO, planted(TWO), seed=k + 1, name=f"tows{k}") for k in range(tables)))
    problem = problem_of(whole, edge=3.0)
    of = design_of(problem, baseline_of("constant", TWO, problem.units(), Preparation(LowPass(problem.edge))))
    return of, unknown_of(of, of.baseline.at(np.zeros(of.Y.shape[2])))


def test_a_steady_table_has_a_constant_in_its_rows_and_recordings_have_none():
    of, got = made(1)
    column = got.Phi[:, got.group == got.names.index(CONSTANT)]
    assert column.shape[1] == 1
    steady = of.problem.frequency < 0
    assert 0 < steady.sum() < len(steady)
    np.testing.assert_array_equal(column[steady, 0], 1.0)
    np.testing.assert_allclose(column[~steady, 0], 0.0, atol=1e-12)
    assert got.s[got.group == got.names.index(CONSTANT)] == pytest.approx(1.0)
    assert CONSTANT not in made(0)[1].names


def test_the_smooth_part_is_all_but_the_constant():
    got = made(1)[1]
    smooth = got.smooth
    assert smooth.names == tuple(name for name in got.names if name != CONSTANT)
    assert smooth.Phi.shape[1] == len(smooth.s) == len(smooth.group) == got.Phi.shape[1] - 1
    np.testing.assert_array_equal(smooth.Phi, got.Phi[:, :-1])
    assert smooth.smooth is smooth
    first = Unknown(np.eye(3), np.array([1.0, 2.0, 3.0]), np.array([0, 1, 2]), (CONSTANT, "a", "b")).smooth
    np.testing.assert_array_equal(first.Phi, np.eye(3)[:, 1:])
    np.testing.assert_array_equal(first.s, [2.0, 3.0])


def test_higher_cosines_weigh_less_and_every_column_has_the_size_of_its_group():
    _, got = made()
    assert set(got.group) == set(range(len(got.names)))
    for g, name in enumerate(got.names):
        weights = got.s[got.group == g]
        if name == PAIRS:
            np.testing.assert_allclose(weights.reshape(-1, PAIRED**2), np.tile([1, 1 / 2, 1 / 2, 1 / 4], (len(weights) // PAIRED**2, 1)))
        else:
            np.testing.assert_allclose(weights, 1 / np.arange(1, COSINES + 1))


def test_columns_are_cosines_of_the_mean_of_place_and_rank():
    of, got = made()
    stretch = of.problem.stretches
    q1 = np.concatenate([x.segment.q[x.segment.keep, 0] for x in stretch])
    low, high = np.percentile(q1, (0.5, 99.5))

    def first(x):
        xi = (np.clip((x - low) / (high - low), 0, 1) + (q1[:, None] < x).mean(axis=0)) / 2
        return np.cos(np.pi * np.arange(1, COSINES + 1) * xi[:, None])

    want = of.rows(lambda one: first(one.segment.q[:, 0]))
    np.testing.assert_allclose(got.Phi[:, got.group == got.names.index("q1_rad")], want, atol=1e-9)


def test_a_slowed_rate_follows_a_step_with_its_time_and_starts_where_it_is():
    t = np.arange(400) / 100
    step = np.stack([np.where(t > 0, 1.0, 0.0), np.full(len(t), 2.0)], axis=1)
    got = _low_pass(t, step, SLOWED)
    np.testing.assert_allclose(got[1:, 0], 1 - np.exp(-t[1:] / SLOWED), rtol=1e-9)
    np.testing.assert_allclose(got[:, 1], 2.0, rtol=1e-12)


def test_travel_is_the_angle_since_the_last_reversal():
    t = np.linspace(0, 4, 4001)
    got = _travel(t, np.stack([np.cos(np.pi * t), np.full(len(t), -0.5)], axis=1))
    want = np.where(t < 0.5, np.sin(np.pi * t), 1 - np.sin(np.pi * ((t - 0.5) % 1 + 0.5))) / np.pi
    near = np.abs((t - 0.5) % 1 - 0.5) > 0.49  # a sample beside a reversal
    np.testing.assert_allclose(got[~near, 0], want[~near], atol=5e-3)
    np.testing.assert_allclose(got[:, 1], 0.5 * t, atol=1e-9)


def test_a_table_has_no_memory_and_torques_and_accelerations_count_only_where_something_is_driven():
    of, _ = made(1)
    model = of.baseline.at(np.zeros(of.Y.shape[2]))
    table = next(x for x in of.problem.stretches if x.segment.steady)
    named = variables(table, model)
    assert not named["travel1_rad"].any()
    assert not named["modelled dtau1_Nm_s"].any()
    np.testing.assert_array_equal(named["recent dq1_rad_s"], named["dq1_rad_s"])
    forced = {name.format(j) for name in ("modelled tau{}_Nm", "modelled dtau{}_Nm_s", "ddq{}_rad_s2") for j in (1, 2)}
    assert set(named) - set(variables(table, model, driven=False)) == forced
