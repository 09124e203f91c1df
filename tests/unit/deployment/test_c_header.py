"""The header, compiled by the C compiler, gives the model's torques over 100,000 steps; no name in it becomes code."""

import re
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

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


@cache
def written(name, precision):
    """The header of a model, and whether it tells a standard deviation."""
    with TemporaryDirectory() as folder:
        told = export_c(model_of(name), Path(folder) / "arm.h", precision)
        return (Path(folder) / "arm.h").read_text(), told["std"]


def exported(name, precision, folder):
    """Whether the header of a model, written to `folder`, tells a standard deviation."""
    text, std = written(name, precision)
    (folder / "arm.h").write_text(text)
    return std


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
    torques = compiled(tmp_path, precision, exported("with memory on state", precision, tmp_path), plain)
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
    pytest.param("with memory on state", "single", marks=pytest.mark.slow)])
def test_a_step_whose_input_is_not_finite_gives_nan_and_leaves_what_was_remembered(name, precision, tmp_path):
    torques, motion = compiled(tmp_path, precision, exported(name, precision, tmp_path)), long_run(400)
    broken, bad = replace(motion, **{key: getattr(motion, key).clone() for key in ("t", "q", "qd", "qdd", "u0", "du0")}), [0, 380, 381]
    broken.q[0, 1], broken.t[380] = torch.nan, torch.inf  # the first step, and times: two steps have no dt
    for k, key in enumerate(("q", "qd", "qdd", "u0", "du0")):
        getattr(broken, key)[200 + 7 * k] = torch.inf if k % 2 else torch.nan
        bad.append(200 + 7 * k)
    got, good = torques(broken), np.setdiff1d(np.arange(400), bad)
    assert np.isnan(got[bad]).all()
    alone = replace(motion.rows(torch.from_numpy(good)), t=motion.t[:len(good)])
    assert largest_error(got[good], torques(alone)) < SAME[precision]


def compiles(folder, statements):
    """Whether `statements` compile with the header in `folder`; raises CalledProcessError where not."""
    (folder / "use.c").write_text(f'#include "arm.h"\nvoid use(const double *q, const double *qd, const double *qdd, double u0, '
                                  f'double du0, double dt, double *tau, double *std) {{\n(void)std;\n{statements}\n}}\n')
    subprocess.run([compiler(), "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "use.c"], cwd=folder, check=True)
    return True


@with_compiler
@pytest.mark.parametrize("name", ["state", pytest.param("hybrid", marks=pytest.mark.slow(seconds=5))])
def test_the_call_in_the_header_s_comment_and_that_of_the_manual_compile(name, tmp_path):
    told = export_c(model_of(name), tmp_path / "arm.h")
    (call,) = (line for line in (tmp_path / "arm.h").read_text().splitlines() if line.strip().startswith("arm_state s;"))
    assert compiles(tmp_path, call)
    page = (Path(__file__).parents[3] / "docs" / "dynamics.md").read_text()
    (block,) = re.findall(r"^```\n(arm_state s;\n.*?)^```$", page, re.M | re.S)
    assert compiles(tmp_path, block if told["std"] else block.replace(", std", ""))


@with_compiler
def test_a_step_of_negative_dt_begins_a_run_and_the_header_says_so(tmp_path):
    export_c(model_of("state"), tmp_path / "arm.h")
    assert "dt < 0" in (tmp_path / "arm.h").read_text()
    torques, motion, later = compiled(tmp_path, "double", False), long_run(200), slice(100, None)
    again = replace(motion, t=torch.where(motion.t < motion.t[100], motion.t, motion.t - 1.0))
    np.testing.assert_array_equal(torques(again)[later], torques(motion.rows(later)))
    assert largest_error(torques(motion)[later], torques(again)[later]) > 1e-3


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
