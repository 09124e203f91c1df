"""What is studied of a campaign, and where in it every row lies."""

import os
import signal
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from campaigns import campaign, planted
from rigs import arm

from nnhydro.diagnosis import store
from nnhydro.diagnosis.case import drawn, opened, places_in
from nnhydro.effects.sensor_view import time_derivative
from nnhydro.physics.motion import tensor
from nnhydro.recordings.campaign import Campaign

ARM = arm(2)
MANY = campaign(ARM, planted(ARM), count=6, noise=0.01, seconds=2.0)


def clocked(starts):
    """The campaign's recordings, begun at these times of the day."""
    return Campaign.of(ARM, [replace(r, clock=start + np.asarray(r.t)) for r, start in zip(MANY.recordings(), starts, strict=False)])


def place(case, name):
    unit = next(u for u in case.all_units if u.name == name)
    return case.places(unit, 0)


def test_places_run_from_minus_one_at_the_first_row_to_one_at_the_last_by_the_clock():
    case = opened(clocked([100.0, 400.0, 300.0, 700.0])).case
    assert float(place(case, "run0")[0]) == pytest.approx(-1)
    assert float(place(case, "run3")[-1]) == pytest.approx(1)
    assert float(place(case, "run2")[0]) < float(place(case, "run1")[0])  # the clock counts, not the name


def test_without_a_clock_places_follow_the_order_of_the_recordings():
    case = opened(MANY).case
    first = [float(place(case, name)[0]) for name in MANY.names]
    assert first == pytest.approx([-1 + 2 * k * 2.99 / (6 * 1.99 + 5 * 1.0) for k in range(6)])  # s: each 1.99 long, with pauses of 1
    assert float(place(case, MANY.names[-1])[-1]) == pytest.approx(1)


def test_places_of_recordings_that_are_not_studied_are_on_the_same_scale():
    whole, part = opened(MANY), opened(MANY, most=3)
    fresh = {u.name: case.places(u, 0) for case in part.fresh() for u in case.all_units}
    assert set(fresh) == set(part.later)
    for name, where in fresh.items():
        assert where.tolist() == place(whole.case, name).tolist()


def test_of_a_large_campaign_recordings_are_drawn_from_every_stretch_of_it():
    names = tuple(f"{k:04d}" for k in range(1000))
    large = replace(MANY, names=names)
    numbers = [int(name) for name in drawn(large, 50, 0)]
    assert [n // 20 for n in numbers] == list(range(50))
    assert drawn(large, 50, 0) == drawn(large, 50, 0) != drawn(large, 50, 1)
    assert drawn(large, 2000, 0) == names


def test_places_need_no_recording_that_is_not_studied():
    def read(name):
        assert name in MANY.names, f"{name} was read"
        return MANY.load(name)

    large = Campaign(ARM, (*MANY.names, "never"), read)
    places_in(large, MANY.names)


@pytest.mark.parametrize("n", [4, 5, 50])
def test_the_time_derivative_is_that_of_a_cubic_spline(n):
    from scipy.interpolate import CubicSpline

    t, x = np.linspace(1, 3, n), np.random.default_rng(0).standard_normal((n, 2))
    assert np.allclose(time_derivative(tensor(t), tensor(x)).numpy(), CubicSpline(t, x)(t, 1), atol=1e-9)


def test_columns_beyond_the_memory_they_may_use_are_kept_in_files_that_go_with_the_store(monkeypatch):
    monkeypatch.setattr(store, "KEPT_BYTES", 1000)
    kept = store.Store()
    small, large, other = np.ones(10), np.arange(200.0), np.zeros(300)
    assert kept.kept(small) is small
    paths = [kept.kept(large), kept.kept(other)]
    assert np.array_equal(np.load(paths[0]), large)
    kept.hold([small, paths[0]])
    assert [path.exists() for path in paths] == [True, False]
    folder = paths[0].parent
    del kept
    assert not folder.exists()


def test_columns_that_a_killed_process_left_behind_are_removed_by_the_next_and_a_living_ones_are_not(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(store, "KEPT_BYTES", 0)
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        try:
            its = store.Store()
            os.write(writer, str(its.kept(np.ones(9))).encode())
            time.sleep(60)
        finally:
            os._exit(0)
    left = Path(os.read(reader, 1000).decode())
    mine = store.Store()
    first = mine.kept(np.ones(3))
    assert left.exists(), "its process is at work"
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    assert left.exists()
    other = store.Store()
    other.kept(np.ones(3))
    assert not left.parent.exists()
    assert first.exists()
    del mine, other
    assert list(tmp_path.iterdir()) == []
