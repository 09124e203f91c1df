"""Small parts of the diagnosis, each by itself: neighbours on a grid, regions, signs, masses that testify, motions a rig allows."""

import numpy as np
import pytest
from races import NOISE, SINGLE, K, P, race, tables

from nnhydro.diagnosis.feasible import _towed, draw
from nnhydro.diagnosis.instances import beside
from nnhydro.diagnosis.locate import _region
from nnhydro.diagnosis.locks import gain_p, known_p, left_out_p, passes, sign_flip_p
from nnhydro.diagnosis.rig import Rig
from nnhydro.identification.config import TrainingConfig

RIG = Rig(np.array([[-1.0, 1.0]]), np.array([1.5]), np.array([6.0]), 0.5, np.array([9.0]), 4.0)


@pytest.mark.parametrize(("values", "value", "span"), [
    ((1.0, 2.0, 4.0), 2.0, (1.0, 4.0)), ((1.0, 2.0, 4.0), 1.0, (0.5, 2.0)), ((1.0, 2.0, 4.0), 4.0, (2.0, 8.0)),
    ((-1.0, 0.0, 2.0), 0.0, (-1.0, 2.0)), ((-1.0, 0.0, 2.0), -1.0, (-2.0, 0.0)), ((-1.0, 0.0, 2.0), 2.0, (0.0, 4.0)),
    ((3.0,), 3.0, (3.0, 3.0)),
])
def test_the_search_reaches_to_the_neighbours_and_as_far_beyond_an_end(values, value, span):
    assert beside(values, value) == pytest.approx(span)


@pytest.mark.parametrize(("size", "region"), [
    ((0.0, 1.0, 3.0, 1.6, 0.0), [2.0, 4.0]), ((3.0, 2.0, 0.0, 0.0, 3.0), [0.0, 2.0]), ((0.0, 0.0, 0.0, 2.0, 3.0), [3.0, 5.0]),
    ((1.0, 1.0, 1.0, 1.0, 1.0), [0.0, 5.0]),
])
def test_a_region_is_where_the_size_stays_above_half_of_its_largest(size, region):
    assert _region(np.arange(6.0), np.array(size)) == region


def test_signs_decide_from_four_recordings_on():
    assert sign_flip_p(np.ones(3)) == 1.0
    assert sign_flip_p(np.ones(4)) == pytest.approx(1 / 16)
    assert sign_flip_p(np.ones(8)) == pytest.approx(1 / 256)
    assert sign_flip_p(-np.ones(8)) == 1.0
    assert sign_flip_p(np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1e9])) == pytest.approx(1 / 64), "one violent recording does not decide alone"
    assert sign_flip_p(np.array([-1.0, -1.0, -1.0, -1.0, -1.0, 1e9])) > 0.5


def test_a_proposed_motion_stays_within_the_rig_and_uses_it():
    rng = np.random.default_rng(3)
    from rigs import arm

    found = draw(RIG, arm(1), 50.0, 24, rng)
    assert len(found) == 24
    rates = np.array([np.abs(one.state.qd).max() for one in found])
    accelerations = np.array([np.abs(one.state.qdd).max() for one in found])
    assert (rates <= 1.5 + 1e-9).all()
    assert (accelerations <= 6.0 + 1e-9).all()
    moving = np.maximum(rates / 1.5, accelerations / 6.0) > 0.25
    assert moving.mean() > 0.4, "motions far below what the rig can do show nothing"


def test_the_smallest_training_is_allowed():
    chosen = TrainingConfig(hidden=(1,), members=1, epochs=1, patience=1)
    assert chosen.hidden == (1,)
    assert TrainingConfig(hidden=(4096,)).hidden == (4096,)
    assert (TrainingConfig(cutoff_hz=0.5).cutoff_hz, TrainingConfig(bound=0.5).bound) == (0.5, 0.5)
    assert TrainingConfig(learning_rate=1.0).learning_rate == 1.0
    with pytest.raises(ValueError, match="learning_rate"):
        TrainingConfig(learning_rate=1.5)
    for name in ("cutoff_hz", "bound"):
        with pytest.raises(ValueError, match=name):
            TrainingConfig(**{name: 0.0})
    with pytest.raises(ValueError, match="1 to 4096 neurons"):
        TrainingConfig(hidden=(8, 4097))
    with pytest.raises(ValueError, match="1 to 4096 neurons"):
        TrainingConfig(hidden=(0,))


def test_a_tow_begins_gently_within_a_fifth_of_the_recording():
    rng = np.random.default_rng(1)
    for seconds in (2.0, 4.0, 60.0):
        rig = Rig(RIG.q, RIG.rate, RIG.acceleration, RIG.u0, RIG.tau, seconds)
        towed = [one["carriage"]["ramp_s"] for _ in range(20) if (one := _towed(rig, rng))]
        assert towed
        assert set(towed) == {min(1.0, 0.2 * seconds)}


def test_masses_moved_far_beyond_what_is_known_of_them_testify_for_what_relieves_them():
    """A column that is baseline column 0 itself: recordings cannot tell it from the mass, only what is known of the mass can."""
    made = tables(35)
    for table in made:
        table[..., P] = 3.0 * table[..., 0]
        table[..., -1] += table[..., P] - 4.0 * table[..., 1]
    found = race(made, prior=np.array([8.0, 0.0, 0.0]))
    gain = found.total() - found.total([SINGLE[0]])
    assert known_p(found, found.scored()) == pytest.approx(1 / 1000), "no smaller than random signs can give"
    assert found.scored().cost - found.scored([SINGLE[0]]).cost > 0.5 * gain
    assert passes(found, SINGLE[0], gain, 0)
    assert not passes(found, SINGLE[0], 6 * np.log(K / 0.0101), 0), "one in a hundred among six that could have been it asks for more"
    assert passes(found, SINGLE[0], 6 * np.log(K / 0.0099), 0)
    relief = found.scored().cost - found.scored([SINGLE[0]]).cost
    assert passes(found, SINGLE[0], relief / 0.51, 0)
    assert not passes(found, SINGLE[0], relief / 0.49, 0), "more than half of that gain would be the recordings' to testify, who do not"
    four, few = (race(made[:n], prior=np.array([8.0, 0.0, 0.0])) for n in (4, 3))
    assert known_p(four, four.scored()) == pytest.approx(1 / 1000)
    assert known_p(few, few.scored()) == 1.0, "three recordings decide nothing"
    free = race(made, prior=1e-9)
    assert known_p(free, free.scored()) > 0.5
    assert not passes(free, SINGLE[0], gain, 0)


def test_the_p_of_masses_that_err_as_they_are_known_to_is_uniform():
    rng, prior, p = np.random.default_rng(36), np.array([4.0, 0.0, 50.0]), []
    for seed in range(200):
        made = tables(seed, units=4, noise=0.02 * NOISE, rows=(10, 20))
        error = rng.standard_normal(2) / np.sqrt(prior[[0, 2]])
        for table in made:  # two masses err by what is known of them, the coefficient of which nothing is known by any amount
            table[..., -1] += table[..., :P] @ np.array([error[0] - 1.0, 7.0, error[1] - 0.5])
        found = race(made, prior=prior, noise=0.02 * NOISE)
        p.append(known_p(found, found.scored()))
    assert np.abs(np.sort(p) - np.linspace(0, 1, 200)).max() < 1.63 / np.sqrt(200)  # Kolmogorov and Smirnov, one in a hundred


def test_what_both_locks_let_through_passes_though_most_of_its_gain_is_relief_of_the_masses():
    """The masses' own word asks for more than a gain of six, the locks do not."""
    made = tables(37, {0: 0.25})
    for table in made:
        table[..., P] += 0.3 * table[..., 0]
        table[..., -1] += 0.9 * table[..., 0]
    found = race(made, prior=np.array([20.0, 0.0, 0.0]))
    before, after = found.scored(), found.scored([SINGLE[0]])
    assert known_p(found, before) <= 0.01
    assert left_out_p(before, after) <= 0.05
    gain = 6.0
    assert before.cost - after.cost >= 0.5 * gain
    assert gain_p(gain, K) > 0.01
    assert passes(found, SINGLE[0], gain, 0)


def test_what_recordings_show_passes_whatever_it_relieves_of_masses_that_err_no_more_than_they_may():
    found = race(tables(12, {2: 0.5}), prior=np.array([4.0, 0.0, 0.0]))
    before, after = found.scored(), found.scored([SINGLE[2]])
    assert known_p(found, before) > 0.01
    assert before.cost > after.cost
    assert passes(found, SINGLE[2], 2 * (before.cost - after.cost), 0)
