"""When and where an effect was said to act, against the answer."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nnhydro.blind_tests.scoring_windows import placement_error
from nnhydro.blind_tests.truth.motions import Plan, carry_out
from nnhydro.blind_tests.truth.partial_causes import KINDS, draw_part

RUNS = [carry_out(Plan("fourier", 0.0, False, 4.0, k), 2, 50.0, f"run_{k + 1:02d}", 100.0 * k, k) for k in range(10)]


def answer(kind, recordings=(), moment=None, region=None):
    name, at = moment or (None, None)
    return {"kind": kind, "recordings": list(recordings), "moment_in": name, "moment_s": at, "region": region}


def names(*numbers):
    return [f"run_{k:02d}" for k in numbers]


def test_a_window_of_recordings_overlaps_by_those_in_both():
    true = answer("since", names(4, 5, 6, 7, 8))
    assert placement_error(true, {"since": "run_04"}, 8).overlap == 1
    assert placement_error(true, {"since": "run_05"}, 8).overlap == pytest.approx(4 / 5)
    assert placement_error(true, {"until": "run_03"}, 8).overlap == 0
    assert placement_error(true, {"recordings": names(4, 5, 1)}, 8).overlap == pytest.approx(2 / 6)
    assert placement_error(true, None, 8).overlap == pytest.approx(5 / 8)


def test_a_moment_counts_in_its_own_recording_only():
    true = answer("onset", names(4, 5, 6, 7, 8), ("run_04", 2.5))
    assert placement_error(true, {"since": "run_04", "since_s": 2.1}, 8).moment_error_s == pytest.approx(0.4)
    assert placement_error(true, {"since": "run_05", "since_s": 2.5}, 8).moment_error_s is None
    assert placement_error(true, {"since": "run_04", "since_s": None}, 8).moment_error_s is None


def test_sectors_overlap_by_their_angles():
    true = answer("region", names(1, 2), region={"joint": 1, "low_rad": 0.0, "high_rad": 1.0})
    assert placement_error(true, {"region": {"joint": 1, "low_rad": 0.5, "high_rad": 1.5}}, 2).overlap == pytest.approx(1 / 3)
    assert placement_error(true, {"region": {"joint": 1, "low_rad": 0.5, "high_rad": None}}, 2).overlap == pytest.approx(0.5)
    assert placement_error(true, {"region": {"joint": 2, "low_rad": 0.0, "high_rad": 1.0}}, 2).overlap == 0
    assert placement_error(true, None, 2).overlap == 0


KEYS = st.sampled_from(["since", "since_s", "until", "recordings", "region", "joint", "low_rad", "high_rad"])
JSON = st.recursive(st.none() | st.booleans() | st.floats() | st.text(max_size=8) | st.integers(),
                    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner), max_leaves=9)


@given(claimed=JSON, kind=st.sampled_from(["since", "onset", "region"]))
def test_whatever_a_diagnosis_claims_is_scored(claimed, kind):
    region = {"joint": 1, "low_rad": 0.0, "high_rad": 1.0} if kind == "region" else None
    said = placement_error(answer(kind, names(4, 5), ("run_04", 1.0) if kind == "onset" else None, region), claimed, 5)
    assert 0 <= said.overlap <= 1


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "always"])
def test_what_acts_in_a_part_acts_there_and_nowhere_else(kind):
    for seed in range(20):
        part = draw_part(np.random.default_rng(seed), kind, RUNS, 2)
        shares = {run.name: part.share(run) for run in RUNS}
        assert all(((w >= 0) & (w <= 1)).all() for w in shares.values())
        if part.sector is not None:
            joint, low, high = part.sector
            for run in RUNS:
                q = run.q[:, joint - 1]
                assert (shares[run.name][(q > low + 0.1) & (q < high - 0.1)] > 0.99).all()
                assert (shares[run.name][(q < low - 0.1) | (q > high + 0.1)] < 0.01).all()
            continue
        acting = {name for name, w in shares.items() if w.any()}
        assert acting == part.recordings
        assert 4 <= len(acting) <= 7
        partly = [name for name, w in shares.items() if w.any() and not w.all()]
        assert partly == ([part.moment[0]] if kind == "onset" else [])
