"""Effects that act in a part of the campaign: windows over recordings and sectors, in words, as masks, and in models."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from campaigns import planted, recording
from hypothesis import given
from hypothesis import strategies as st
from rigs import arm, run

from nnhydro.diagnosis.problem.activity import ActivityWindow, Sector
from nnhydro.effects.catalogue import catalogue, instrument_of
from nnhydro.effects.in_sector import InSector, ReadInSector, within
from nnhydro.effects.sensor_view import SensorView
from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import term_of
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


def test_a_term_in_a_sector_is_the_term_there_and_nothing_elsewhere():
    motion, term = run(2), catalogue()["viscous_friction"].at_start(ARM, joint=2)
    flow = Flow(ARM, motion)
    whole, q = term.torque(flow), motion.q[:, 0]
    for low, high in ((-0.2, 0.4), (None, 0.1), (0.1, None), (None, None)):
        there = InSector(1, low, high, term)
        acts = within(q.numpy(), low, high)
        assert np.array_equal(there.torque(flow).numpy(), whole.numpy() * acts[:, None])
        assert term_of(json.loads(json.dumps(there.document()))) == there


@pytest.mark.parametrize("broken", [{"joint": 0}, {"joint": 1.5}, {"low": "0"}, {"term": 3}, {"term": {"kind": "nobody"}}])
def test_a_sector_that_makes_no_sense_is_refused(broken):
    options = {"joint": 1, "low": 0.0, "high": 1.0, "term": catalogue()["viscous_friction"].at_start(ARM, joint=1).document()} | broken
    with pytest.raises(ModelError):
        term_of({"kind": "in_sector", "parameters": {}, "options": options})


@pytest.mark.parametrize(("low", "high"), [(-0.2, 0.4), (None, 0.1), (0.1, None), (None, None)])
def test_a_reading_that_errs_in_a_sector_is_right_outside_it(low, high):
    effect = catalogue()["torque_gain"](joint=2, error=(0.2,))
    motion = run(2)
    view = SensorView(Flow(ARM, motion), lambda flow: planted(ARM).torque(flow))
    there = ReadInSector(low, high, effect, joint=1)
    acts = within(motion.q[:, 0].numpy(), low, high)[:, None]
    np.testing.assert_array_equal(there.apply(view), view.tau + (effect.apply(view) - view.tau) * torch.from_numpy(acts))
    np.testing.assert_array_equal(there.columns(view), effect.columns(view) * torch.from_numpy(acts)[..., None])
    assert (there.id, there.stage) == (effect.id, effect.stage)
    assert instrument_of(json.loads(json.dumps(there.document()))) == there


@pytest.mark.parametrize("broken", [{"joint": 0}, {"joint": 1.5}, {"low": "0"}, {"low": float("nan")}, {"high": True}, {"effect": 3},
                                    {"effect": {}}, {"effect": {"kind": "read_in_sector"}}])
def test_a_reading_in_a_sector_that_makes_no_sense_is_refused(broken):
    effect = catalogue()["torque_gain"](joint=2, error=(0.2,)).document()
    with pytest.raises(ModelError):
        instrument_of({"kind": "read_in_sector", "options": {"joint": 1, "low": 0.0, "high": 1.0, "effect": effect} | broken})


def test_a_reading_is_not_confined_to_a_sector_twice():
    effect = ReadInSector(0.0, 1.0, catalogue()["torque_gain"](joint=2, error=(0.2,)), joint=1)
    with pytest.raises(ModelError, match="acts everywhere"):
        ReadInSector(0.0, 1.0, effect, joint=2)
