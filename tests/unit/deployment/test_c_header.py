"""The header, compiled by the C compiler, gives the model's torques over 100,000 steps; no name in it becomes code."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted
from rigs import HOSTILE, arm
from stepped import MODELS, SAME, compiled, driven, largest_error, long_run, model_of, over, theory, towed, under_way

from nnhydro.deployment.c_header import export_c, header
from nnhydro.deployment.native import compiler
from nnhydro.deployment.step import record_step
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.travel.state_model import state_loads

with_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler here")


@with_compiler
@pytest.mark.slow
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("name", MODELS)
def test_a_hundred_thousand_steps_in_c_are_the_model_s_torques(name, precision, tmp_path):
    model, motion, want = over(100_000, name)
    told = export_c(model, tmp_path / "arm.h", precision)
    assert largest_error(driven(tmp_path, motion, precision, told["std"]), want) < SAME[precision]


@with_compiler
@pytest.mark.parametrize("name", ["state", "diagnosed"])
def test_what_moves_in_its_first_step_has_moved_for_ever(name, tmp_path):
    model, motion = model_of(name), under_way()
    told = export_c(model, tmp_path / "arm.h")
    assert largest_error(driven(tmp_path, motion, "double", told["std"]), model.torque(motion).numpy()) < SAME["double"]


@with_compiler
@pytest.mark.slow(seconds=20)
@pytest.mark.parametrize("precision", ["double", "single"])
def test_a_hybrid_is_written_as_loops_and_gives_the_same_over_long_runs(precision, tmp_path):
    """In double precision by plain loops, in single by the widest that this processor has."""
    (model, motion, want), slow = over(10_000, "with memory on state"), towed(4500)
    plain = ("-DNO_DISPATCH",) if precision == "double" else ()
    torques = compiled(tmp_path, precision, export_c(model, tmp_path / "arm.h", precision)["std"], plain)
    assert "static NOINLINE void plain_loop" in (tmp_path / "arm.h").read_text()
    assert largest_error(torques(motion), want) < SAME[precision]
    assert largest_error(torques(slow), model.torque(slow).numpy()) < SAME[precision]


@with_compiler
@pytest.mark.slow(seconds=15)
def test_a_network_with_memory_gives_the_same_on_each_kind_of_processor(tmp_path):
    model, motion, want = over(6000, "network with memory")
    torques = compiled(tmp_path, "double", export_c(model, tmp_path / "arm.h")["std"])
    for widest in (2, 1, 0):
        assert largest_error(torques(motion, widest), want) < SAME["double"]


def test_the_net_that_remembers_carries_more_than_a_tenth_of_the_torque():
    motion = long_run(2000)
    assert largest_error(model_of("with memory").torque(motion).numpy(), model_of("hybrid").torque(motion).numpy()) > 0.1


@with_compiler
@pytest.mark.slow
def test_a_slow_tow_in_single_precision_forgets_no_travel(tmp_path):
    model, motion = model_of("state"), towed(4500)
    told = export_c(model, tmp_path / "arm.h", "single")
    assert "double values[" in (tmp_path / "arm.h").read_text()
    want = model.torque(motion).numpy()
    far = largest_error(driven(tmp_path, motion, "single", told["std"]), want)
    assert far < SAME["single"], f"{far:.1e}: with travel added up in single precision it is 9e-5"


@with_compiler
@pytest.mark.parametrize(("name", "precision"), [
    ("state", "double"), ("state", "single"),
    pytest.param("with memory on state", "double", marks=pytest.mark.slow(seconds=15))])
def test_a_step_whose_input_is_not_finite_gives_nan_and_leaves_what_was_remembered(name, precision, tmp_path):
    torques = compiled(tmp_path, precision, export_c(model_of(name), tmp_path / "arm.h", precision)["std"])
    motion = long_run(400)
    broken, bad = replace(motion, **{key: getattr(motion, key).clone() for key in ("t", "q", "qd", "qdd", "u0", "du0")}), [0, 380, 381]
    broken.q[0, 1], broken.t[380] = torch.nan, torch.inf  # the first step, and times: two steps have no dt
    for k, key in enumerate(("q", "qd", "qdd", "u0", "du0")):
        getattr(broken, key)[200 + 7 * k] = torch.inf if k % 2 else torch.nan
        bad.append(200 + 7 * k)
    got, good = torques(broken), np.setdiff1d(np.arange(400), bad)
    assert np.isnan(got[bad]).all()
    alone = replace(motion.rows(torch.from_numpy(good)), t=motion.t[:len(good)])
    assert largest_error(got[good], torques(alone)) < SAME[precision]


@with_compiler
def test_flags_under_which_nan_passes_for_a_number_are_refused(tmp_path):
    export_c(model_of("constant"), tmp_path / "arm.h")
    with pytest.raises(AssertionError, match="compile without -ffast-math"):
        compiled(tmp_path, "double", False, ("-ffinite-math-only",))


@with_compiler
@pytest.mark.slow
def test_the_header_says_what_it_is_and_comes_with_steps_to_try_it(tmp_path):
    a = arm(2)
    told = export_c(theory(a, state_loads(a)), tmp_path / "my arm.h", digest="abc")
    text = (tmp_path / "my arm.h").read_text()
    assert "my_arm_step(my_arm_state *s" in text
    assert "malloc" not in text
    assert "abc" in text
    rows = np.genfromtxt(tmp_path / "my arm.h.test.csv", delimiter=",", names=True)
    assert rows.dtype.names[-2:] == ("tau1_Nm", "tau2_Nm")
    assert (rows["dt_s"] < 0).sum() == 2
    assert told["memory"] == 2 * 10 * 6 + 2 * 3


def test_the_header_is_code_where_it_was_code_before():
    model = StripTheory(arm(2), GIVEN, {}, HOSTILE, planted(arm(2)))
    plain, hostile = (header(record_step(m), "arm", "double", "", (HOSTILE,) * (m is model))
                      for m in (replace(model, name="constant"), model))
    assert hostile.partition("*/\n#ifndef")[2] == plain.partition("*/\n#ifndef")[2] != ""
    assert hostile.index("*/") == hostile.index("*/\n#ifndef"), "the first comment ends where the code begins"
