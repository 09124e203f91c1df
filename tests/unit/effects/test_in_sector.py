"""What acts while one joint lies in a sector of its angles."""

import json

import numpy as np
import pytest
import torch
from campaigns import planted
from rigs import arm, run

from nnhydro.effects.catalogue import catalogue, instrument_of
from nnhydro.effects.in_sector import InSector, ReadInSector, within
from nnhydro.effects.sensor_view import SensorView
from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import term_of

ARM = arm(2)


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
    view = SensorView(Flow(ARM, motion), planted(ARM).torques)
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


def test_a_sector_holds_its_lower_end_and_not_its_upper_one():
    q = torch.tensor([-1.0, 0.0, 0.5, 1.0, 2.0])
    assert within(q, 0.0, 1.0).tolist() == [False, True, True, False, False]
    assert within(q, None, 1.0).tolist() == [True, True, True, False, False]
    assert within(q, 0.0, None).tolist() == [False, True, True, True, True]
