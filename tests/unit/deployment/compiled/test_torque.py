"""A compiled model gives what the model gives, many times as fast; what cannot be compiled is refused with the reason."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from compiled_models import EQUAL, WITHOUT_MEMORY, assert_equal, model_of, one_by_one
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import LINKS, arm, run, states

from nnhydro.deployment.compiled import engines, torque
from nnhydro.deployment.compiled.torque import WORTH, CompiledModel, compile_model, quickest
from nnhydro.errors import ModelError
from nnhydro.models.baselines import BASELINES, baseline
from nnhydro.models.prediction import predict
from nnhydro.models.storage import load_model, save_model
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import term_kinds
from nnhydro.physics.loads.history_force import HistoryForce
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.recording import Recording

DRIVES = {"direct": {}, "belt": {"drive": {"kind": "remote", "pulley_ratio": 1.5}},
          "gears": {"gear": {"ratio": 25.0, "efficiency": 0.8, "torque_at": "motor"}}}


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), links=st.integers(1, 3), drive=st.sampled_from(list(DRIVES)),
       name=st.sampled_from(["constant", "rigid"]))
def test_whatever_arm_and_coefficients_the_torque_is_that_of_the_model(seed, links, drive, name):
    rng = np.random.default_rng(seed)
    keys = DRIVES[drive] if links == 2 or drive != "belt" else {}
    sizes = [{key: value * rng.uniform(0.3, 2.0) for key, value in link.items()} for link in LINKS[:links]]
    a = Arm.model_validate({"fluid": {"density_kg_m3": rng.uniform(0, 1100)}, "links": sizes, "gravity_m_s2": rng.uniform(0, 9.8), **keys})
    loads = Loads({key: replace(term, **{f.name: tuple(v * rng.uniform(0, 2) for v in getattr(term, f.name)) for f in term.parameters()})
                   for key, term in baseline(name).start(a).terms.items()})
    made, motion = compile_model(model_of(a, name, loads), "numpy"), states(links, 100, seed)
    assert_equal(made, motion)
    far = (one_by_one(made, motion) - made.model.torque(motion)).abs().max() / made.model.torque(motion).abs().max()
    assert float(far) <= EQUAL


@pytest.mark.parametrize("motion", [
    Motion.at([[0.3, 0.4]], 0.0, 0.0), Motion.at([[0.3, 0.4]], 0.0, 0.0, 0.5), Motion.at([[0.3, 0.4]], [[1.0, -1.0]], 0.0),
    Motion.at([[0.3, 0.4]], [[0.0, 1.0]], 0.0), Motion.at([[1e6, -1e6]], [[1.0, 2.0]], 1.0)],
    ids=["rest", "tow", "outer link does not turn", "inner link at rest", "many turns"])
def test_states_at_which_a_formula_could_break_are_ordinary(motion):
    assert_equal(compile_model(model_of(arm()), "numpy"), replace(motion, qdd=motion.qdd + 0.1))


@pytest.mark.slow
def test_numba_gives_the_same_in_one_loop():
    pytest.importorskip("numba")
    made = compile_model(model_of(arm(drive={"kind": "remote"})), "numba")
    for motion in (states(2, 5000), run(2, 333), states(2, 1)):
        assert_equal(made, motion)
    np.testing.assert_allclose(one_by_one(made, states(2, 20)).numpy(), made.torque(states(2, 20)).numpy(), rtol=1e-11, atol=1e-11)
    assert made.torque(Motion.at(np.empty((0, 2)), 0.0, 0.0)).shape == (0, 2)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "links"), [(name, 1 + k % 3) for k, name in enumerate(BASELINES) if name != "state"])
def test_numba_gives_every_baseline_and_any_number_of_links(name, links):
    pytest.importorskip("numba")
    made = compile_model(model_of(arm(links), name), "numba")
    for motion in (states(links, 500), run(links, 333), run(links, 9001), run(links, 1)):
        assert_equal(made, motion)


@pytest.mark.slow
def test_a_friction_that_needs_more_than_arithmetic_is_compiled_by_numba():
    pytest.importorskip("numba")
    a = arm()
    terms = {kind: term_kinds()[kind].at_start(a) for kind in WITHOUT_MEMORY}
    assert_equal(compile_model(model_of(a, loads=Loads(terms)), "numba"), states(2, 2000))


def test_values_that_are_not_finite_are_not_made_finite():
    made, motion = compile_model(model_of(arm()), "numpy"), states(2, 10)
    motion.qd[3, 1] = torch.nan
    motion.u0[5] = torch.inf
    tau = made.torque(motion)
    assert not torch.isfinite(tau[3]).all()
    assert not torch.isfinite(tau[5]).all()
    assert torch.isfinite(tau[[0, 1, 2, 4, 6, 7, 8, 9]]).all()


def test_a_compiled_model_predicts_and_is_saved_as_the_model_it_was_made_from(tmp_path):
    model = model_of(arm())
    made = compile_model(model, "numpy")
    motion = run(2, 400)
    recording = Recording("motion", motion.t.numpy(), motion.q.numpy(), None, motion.qd.numpy(), motion.qdd.numpy())
    np.testing.assert_allclose(predict(made, recording).tau, predict(model, recording).tau, rtol=0, atol=1e-10)
    save_model(made, tmp_path / "model")
    assert load_model(tmp_path / "model").document() == model.document()


@pytest.mark.slow
def test_long_recordings_are_predicted_by_what_is_soonest_done(monkeypatch):
    pytest.importorskip("numba")
    state, dry = model_of(arm(), "state"), model_of(arm(1), "rigid")
    few, many = WORTH[True], WORTH[False]
    assert quickest(state, few - 1) is state
    assert quickest(dry, many - 1) is dry
    assert isinstance(quickest(dry, many), CompiledModel)
    lagging = model_of(arm(1), loads=dry.loads.plus("history", HistoryForce.at_start(arm(1))))
    assert quickest(lagging, many) is lagging
    with monkeypatch.context() as patch:
        patch.setattr(torque, "compile_model", lambda model: ("compiled", model))  # test_travelling.py compiles it
        assert quickest(state, few) == ("compiled", state)
    monkeypatch.setattr(engines, "find_spec", lambda name: None)
    assert quickest(state, many) is state


def test_a_term_that_remembers_in_another_way_is_refused():
    a = arm()
    loads = baseline("constant").start(a).plus("history", HistoryForce.at_start(a))
    with pytest.raises(ModelError, match="holds a memory that is not compiled"):
        compile_model(model_of(a, loads=loads), "numpy")


def test_what_is_no_sum_of_load_terms_is_refused():
    class Other(TorqueModel):
        def torque(self, motion):
            return motion.q

        def document(self):
            return {}

    with pytest.raises(ModelError, match="only physics models"):
        compile_model(Other(arm(), Preparation(None), {}))
