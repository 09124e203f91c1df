"""Effects that act in a part of the campaign: windows over recordings and sectors, in words, as masks, and in models."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from campaigns import planted, recording
from hypothesis import given
from hypothesis import strategies as st
from rigs import arm

from nnhydro.diagnosis.problem.activity import ActivityWindow, Sector
from nnhydro.recordings.filtering.preprocessing import Preparation, prepare
from nnhydro.report.diagnosis.finding_law import _active_rows

ARM = arm(2)


def segment(name="run01", seed=1):
    return next(iter(prepare(recording(ARM, planted(ARM), name, seed=seed), Preparation(None))))


def test_a_window_of_recordings_holds_all_rows_of_these_and_none_of_others():
    window = ActivityWindow(("run01", "run02"), since=True)
    assert window.mask(segment("run01")).all()
    assert not window.mask(segment("run03")).any()


@given(low=st.floats(-2, 2), width=st.floats(0, 2), joint=st.sampled_from([1, 2]))
def test_a_window_of_angles_holds_the_rows_whose_angle_lies_in_it(low, width, joint):
    part = segment()
    mask = ActivityWindow(sector=Sector(joint, low, low + width)).mask(part)
    q = part.q[:, joint - 1]
    assert set(np.unique(mask)) <= {0.0, 1.0}
    assert np.array_equal(mask > 0, (q >= low) & (q <= low + width))


@pytest.mark.parametrize(("window", "said", "persists"), [
    (ActivityWindow(("a", "b"), since=True), "from recording a on", True),
    (ActivityWindow(("a", "b"), until=True), "until recording b", False),
    (ActivityWindow(("a", "c")), "in the recordings a, c", False),
    (ActivityWindow(sector=Sector(2, -0.5, 0.25)), "while joint 2 lies between -0.50 and 0.25 rad", True),
])
def test_a_window_says_when_it_acts_and_whether_it_will_act_next(window, said, persists):
    assert window.sentence() == said
    assert window.persists is persists
    assert window.document()["sentence"] == said
    assert json.loads(json.dumps(window.document())) == window.document()


def test_the_law_of_what_acts_in_a_part_is_drawn_over_the_rows_of_that_part():
    parts = [segment("run01", 1), segment("run02", 2)]
    traces = [SimpleNamespace(segment=part) for part in parts]
    assert _active_rows(SimpleNamespace(activity=None), traces).all()
    acting = _active_rows(SimpleNamespace(activity=ActivityWindow(("run02",))), traces)
    assert acting.tolist() == [False] * int(parts[0].keep.sum()) + [True] * int(parts[1].keep.sum())
