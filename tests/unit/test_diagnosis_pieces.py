"""Small parts of the diagnosis, each by itself: neighbours on a grid, regions, signs, motions a rig allows."""

import numpy as np
import pytest

from nnhydro.diagnosis.feasible import _towed, draw
from nnhydro.diagnosis.instances import _neighbours
from nnhydro.diagnosis.locate import _region
from nnhydro.diagnosis.locks import sign_flip_p
from nnhydro.diagnosis.rig import Rig
from nnhydro.identification.config import TrainingConfig

RIG = Rig(np.array([[-1.0, 1.0]]), np.array([1.5]), np.array([6.0]), 0.5, np.array([9.0]), 4.0)


@pytest.mark.parametrize(("values", "value", "span"), [
    ((1.0, 2.0, 4.0), 2.0, (1.0, 4.0)), ((1.0, 2.0, 4.0), 1.0, (0.5, 2.0)), ((1.0, 2.0, 4.0), 4.0, (2.0, 8.0)),
    ((-1.0, 0.0, 2.0), 0.0, (-1.0, 2.0)), ((-1.0, 0.0, 2.0), -1.0, (-2.0, 0.0)), ((-1.0, 0.0, 2.0), 2.0, (0.0, 4.0)),
    ((3.0,), 3.0, (3.0, 3.0)),
])
def test_the_search_reaches_to_the_neighbours_and_as_far_beyond_an_end(values, value, span):
    assert _neighbours(values, value) == pytest.approx(span)


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
