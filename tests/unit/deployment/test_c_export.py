"""The header, compiled by the C compiler, and the ONNX file give the model's torques over 100,000 steps (a hybrid in ONNX: 20,000)."""

import ctypes
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import torch
from campaigns import DEFAULT_LAWS, GIVEN, campaign, planted
from rigs import arm
from strip_nets import remembering

from nnhydro.deployment import c_header, c_program
from nnhydro.deployment.c_header import export_c
from nnhydro.deployment.files import export_step, only_wake
from nnhydro.deployment.native import Native, NativeArm, compiler
from nnhydro.deployment.onnx.expressions import Program, add, combine
from nnhydro.deployment.onnx.onnx_graph import infinite_atoms, onnx_model
from nnhydro.deployment.step import record_step
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.effects.hypotheses.coulomb_friction import CoulombFriction
from nnhydro.effects.hypotheses.flow_memory import FlowMemory
from nnhydro.effects.hypotheses.link_interference import LinkInterference
from nnhydro.effects.hypotheses.sensor_timing import SensorTiming
from nnhydro.effects.hypotheses.torque_bias import TorqueBias
from nnhydro.effects.hypotheses.wake_development import WakeDevelopment
from nnhydro.errors import ConfigError, ModelError
from nnhydro.fitting.network.train import train
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.motion import Motion
from nnhydro.physics.travel.state_model import state_loads

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler here")
FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-fPIC", "-shared")
SAME = {"double": 1e-9, "single": 1e-5}  # of the rms torque
DRIVER = """
int widest = 2; /* 1: as on a processor without AVX-512, 0: without AVX2 */
#define __builtin_cpu_supports(part) (widest > ((part)[3] == '5') && __builtin_cpu_supports(part))
#include "arm.h"
void drive(long n, const real_t *in, real_t *out) {
    arm_state s;
    arm_reset(&s);
    for (long k = 0; k < n; ++k)
        arm_step(&s, in + 9*k, in + 9*k + 2, in + 9*k + 4, in[9*k + 6], in[9*k + 7], in[9*k + 8], out + 2*k STD);
}
"""


@pytest.fixture(autouse=True, scope="module")
def recorded_once():
    """A model is recorded once for both precisions and all tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(c_header, "record_step", cache(c_header.record_step))
        yield


def theory(a, loads, instruments=()):
    return StripTheory(a, GIVEN, {}, "physics", loads, tuple(instruments))


def long_run(rows, links=2, dt=2e-3):
    """A run from rest that turns back and stops again and again, as float32 holds it."""
    t = torch.arange(rows, dtype=torch.float64) * dt
    w = torch.tensor([1.7, 2.3][:links], dtype=torch.float64)
    a = torch.tensor([0.8, 0.5][:links], dtype=torch.float64)
    phase = w * t[:, None]
    still = torch.zeros(rows, dtype=torch.float64)
    return Motion(t, a * (1 - torch.cos(phase)), a * w * torch.sin(phase), a * w**2 * torch.cos(phase), still, still)


def towed(rows, speed=0.05, dt=2e-3):
    """A slow tow from rest with both joints held: its wake grows by some 1e-5 of itself a step, and on for minutes."""
    t, held = torch.arange(rows, dtype=torch.float64) * dt, torch.zeros(rows, 2, dtype=torch.float64)
    u0 = speed * (t / 0.02).clamp(max=1.0)
    return Motion(t, held + torch.tensor([0.4, 0.3]), held, held, u0, torch.where(t < 0.02, speed / 0.02, 0.0).to(u0))


@cache
def library(header, driver, flags):
    """The library of a header and its driver, compiled once."""
    with TemporaryDirectory() as folder:
        for name, text in (("arm.h", header), ("drive.c", driver)):
            (Path(folder) / name).write_text(text)
        done = subprocess.run([compiler(), *FLAGS, *flags, "drive.c", "-o", "drive.so", "-lm"], cwd=folder, capture_output=True, text=True,
                              check=False)
        assert done.returncode == 0, done.stderr
        return ctypes.CDLL(str(Path(folder) / "drive.so"))


def compiled(folder, precision, std, flags=()):
    """The header in `folder` as a function of a motion that returns its torques (n, 2)."""
    kind, real = (np.float64, "double") if precision == "double" else (np.float32, "float")
    # under -Werror the standard deviation must be asked for where the model has one
    text = DRIVER.replace("real_t", real).replace(" STD", ", std" if std else "").replace("arm_reset(&s);",
                                                                                      f"arm_reset(&s);\n    {real} std[2];" if std else
                                                                                      "arm_reset(&s);")
    loaded = library((folder / "arm.h").read_text(), text, flags)

    def torques(motion, widest=2):
        n = len(motion)
        ctypes.c_int.in_dll(loaded, "widest").value = widest
        dt = torch.diff(motion.t, prepend=motion.t[:1] - 0.7)  # the first one is not read
        columns = [motion.q, motion.qd, motion.qdd, motion.u0[:, None], motion.du0[:, None], dt[:, None]]
        given = np.ascontiguousarray(torch.cat(columns, dim=1).numpy(), kind)
        out = np.zeros((n, 2), kind)
        loaded.drive(ctypes.c_long(n), given.ctypes.data_as(ctypes.c_void_p), out.ctypes.data_as(ctypes.c_void_p))
        return out

    return torques


def driven(folder, motion, precision, std):
    """Torques (n, 2) of the header in `folder` for a motion."""
    return compiled(folder, precision, std)(motion)


MODELS = {
    "constant": lambda a: theory(a, planted(a)),
    "state": lambda a: theory(a, state_loads(a)),
    "diagnosed": lambda a: theory(a, planted(a).plus("rub", CoulombFriction(joint=1, level=(0.3,), bending=(0.05,)))
                                  .plus("lag", FlowMemory(share=(0.5,) * 2, response=(0.2,), travel=(0.3,)))
                                  .plus("grows", WakeDevelopment(*(((0.3 - 0.1 * k,)) for k in range(6)), reach=(8.0,))),
                                  [TorqueBias(joint=1, offset=(0.5,))]),
    "sheltered": lambda a: theory(a, planted(a).plus("lee", LinkInterference((0.3,), (0.2,), (0.1,), (2.0,), (10.0,), joint=1))),
}


@cache
def hybrid(baseline):
    """A hybrid trained for an instant on `baseline`."""
    a = arm(2)
    return train(campaign(a, state_loads(a), 4, seconds=2.0, rate=50.0), DEFAULT_LAWS.model_copy(update={"baseline": baseline}))


@cache
def model_of(name):
    """The model called so."""
    return hybrid("constant") if name == "hybrid" else MODELS[name](arm(2))


@cache
def hundred_thousand(name):
    """A model, a long run, and the model's torques of it."""
    model, motion = model_of(name), long_run(100_000)
    return model, motion, model.torque(motion).numpy()


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("name", MODELS)
def test_a_hundred_thousand_steps_in_c_are_the_model_s_torques(name, precision, tmp_path):
    model, motion, want = hundred_thousand(name)
    told = export_c(model, tmp_path / "arm.h", precision)
    got = driven(tmp_path, motion, precision, told["std"])
    assert np.abs(got - want).max() < SAME[precision] * np.sqrt((want**2).mean())


@pytest.mark.slow(seconds=40)
def test_a_hybrid_is_written_as_loops_and_gives_the_same_over_a_hundred_thousand_steps(tmp_path):
    (model, motion, want), slow = hundred_thousand("hybrid"), towed(20_000)
    for precision in ("double", "single"):
        told = export_c(model, tmp_path / "arm.h", precision)
        assert "static NOINLINE void plain_loop" in (tmp_path / "arm.h").read_text()
        torques = compiled(tmp_path, precision, told["std"])
        far = np.abs(torques(motion) - want).max() / np.sqrt((want**2).mean())
        assert far < SAME[precision], f"{precision}: {far:.1e}"
    assert only_wake(model)
    want = model.torque(slow).numpy()
    assert np.abs(torques(slow) - want).max() < SAME["single"] * np.sqrt((want**2).mean())


@pytest.mark.slow
def test_a_hybrid_on_coefficients_over_the_travel_gives_the_same_on_any_processor_and_in_single_precision(tmp_path):
    model = hybrid("state")
    motion = long_run(6000)
    want = model.torque(motion).numpy()
    for precision in ("double", "single"):
        told = export_c(model, tmp_path / "arm.h", precision)
        torques = compiled(tmp_path, precision, told["std"])
        for widest in (2, 1, 0):
            far = np.abs(torques(motion, widest) - want).max() / np.sqrt((want**2).mean())
            assert far < SAME[precision], f"{precision} {widest}: {far:.1e}"


@pytest.mark.slow(seconds=50)
def test_a_hybrid_with_a_trained_memory_is_written_with_its_state(tmp_path):
    model, wanted = remembering(hybrid("constant")), []
    for motion in (long_run(8000), towed(4500)):
        want = model.torque(motion).numpy()
        assert np.abs(want - hybrid("constant").torque(motion).numpy()).max() > 0.1 * np.sqrt((want**2).mean())
        wanted.append((motion, want))
    for precision, flags in (("double", ()), ("single", ("-DNO_DISPATCH",))):
        told = export_c(model, tmp_path / "arm.h", precision)
        torques = compiled(tmp_path, precision, told["std"], flags)
        for motion, want in wanted:
            far = np.abs(torques(motion) - want).max() / np.sqrt((want**2).mean())
            assert far < SAME[precision], f"{precision}: {far:.1e}"


@pytest.mark.slow
def test_a_slow_tow_in_single_precision_forgets_no_travel(tmp_path):
    model, motion = model_of("state"), towed(4500)
    told = export_c(model, tmp_path / "arm.h", "single")
    assert "double memory[" in (tmp_path / "arm.h").read_text()
    want = model.torque(motion).numpy()
    far = np.abs(driven(tmp_path, motion, "single", told["std"]) - want).max() / np.sqrt((want**2).mean())
    assert far < SAME["single"], f"{far:.1e}: with travel added up in single precision it is 9e-5"


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


def test_what_no_step_can_carry_is_refused_or_left_out(tmp_path):
    a = arm(2)
    model = theory(a, planted(a), [SensorTiming(lag=(0.05,), low_pass=(0.0,))])
    with pytest.raises(ModelError, match="--without-instruments"):
        record_step(model)
    told = export_step(model, tmp_path / "arm.h", "c", bare=True)
    assert told["left_out"] == ["sensor_timing: a delay of the sensors, not of the arm"]
    assert "left out: sensor_timing" in (tmp_path / "arm.h").read_text()
    with pytest.raises(ConfigError, match="double, single"):
        export_c(model, tmp_path / "arm.h", "half")
    with pytest.raises(ConfigError, match="is a folder"):
        export_c(model, tmp_path, "double")


def through_onnx(path, motion):
    """Torques (n, 2) of the ONNX file `path`, fed step by step with the memory that it gave back."""
    import onnxruntime

    alone = onnxruntime.SessionOptions()
    alone.intra_op_num_threads = alone.inter_op_num_threads = 1  # threads that wait for so small a step cost more than it
    session = onnxruntime.InferenceSession(str(path), alone, providers=["CPUExecutionProvider"])
    shapes, found = {x.name: x.shape for x in session.get_inputs()}, []
    outputs = [x.name for x in session.get_outputs() if x.name in ("tau", "memory_next", "wake_next")]
    kept = [name for name in shapes if name in ("memory", "wake")]
    memory = [np.zeros(shapes[name]) for name in kept]
    dt = np.full((len(motion), 1), 2e-3)
    dt[0] = 0.0 if "wake" in kept else -1.0
    columns = {"q": motion.q, "qd": motion.qd, "qdd": motion.qdd, "u0": motion.u0, "du0": motion.du0, "dt": dt}
    columns = {name: np.asarray(columns[name]).reshape(-1, *shapes[name]) for name in shapes if name not in kept}
    for k in range(len(motion)):
        given = {name: column[k] for name, column in columns.items()} | dict(zip(kept, memory, strict=True))
        tau, *memory = session.run(outputs, given)
        found.append(tau.ravel())
    return np.stack(found)


@pytest.mark.parametrize("name", MODELS)
def test_a_few_hundred_steps_in_onnxruntime_are_the_model_s_torques(name, tmp_path):
    model, motion = model_of(name), long_run(300)
    export_step(model, tmp_path / "arm.onnx", "onnx")
    want = model.torque(motion).numpy()
    assert np.abs(through_onnx(tmp_path / "arm.onnx", motion) - want).max() < 1e-9 * np.sqrt((want**2).mean())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["state", "diagnosed"])
def test_what_moves_in_its_first_step_has_moved_for_ever(name, tmp_path):
    model, run = model_of(name), long_run(350)
    motion = replace(run, t=run.t[:200], q=run.q[150:], qd=run.qd[150:], qdd=run.qdd[150:], u0=run.u0[:200] + 0.2, du0=run.du0[:200])
    export_step(model, tmp_path / "arm.onnx", "onnx")
    told = export_step(model, tmp_path / "arm.h", "c")
    want = model.torque(motion).numpy()
    for got in (through_onnx(tmp_path / "arm.onnx", motion), driven(tmp_path, motion, "double", told["std"])):
        assert np.abs(got - want).max() < 1e-9 * np.sqrt((want**2).mean())


def test_atoms_that_may_be_infinite_are_known():
    p = Program(2)
    x, y = p.input(0), p.input(1)
    ever = p.where(p.apply("positive", x), np.inf, y)
    wild = [ever, p.apply("mul", ever, x), p.apply("max", ever, x), p.apply("exp", ever)]
    tame = [p.apply("min", ever, 5.0), p.apply("div", 1.0, ever), p.apply("exp", p.mul(-1.0, ever)), p.apply("positive", ever)]
    assert infinite_atoms(p) == {k for value in wild for k in value.terms}
    assert not infinite_atoms(p) & {k for value in tame for k in value.terms}


def test_a_network_and_its_mirror_image_are_one_product_whose_halves_are_added_and_taken_off(monkeypatch):
    monkeypatch.setattr(c_program, "MANY", 0)  # tables, however small the program
    rng, p = np.random.default_rng(1), Program(20)
    W, s = rng.standard_normal((5, 20)), np.where(rng.random(20) < 0.4, -1.0, 1.0)
    rows = [combine([(c, p.input(k)) for k, c in enumerate(row)]) for row in np.concatenate([W, W * s])]
    outputs = [p.unary("tanh", row) for row in rows]
    assert "= e + o" in c_program.c_function("void run", p, outputs, "double")
    native, x = Native(p, outputs, 20), rng.uniform(-0.3, 0.3, 20)
    native.given[:] = x
    np.testing.assert_allclose(native(), np.tanh(np.concatenate([W, W * s]) @ x), atol=1e-13)


@pytest.mark.parametrize("far", [0, 70_000], ids=["", "a long vector"])
def test_long_sums_alone_and_alike_are_those_of_a_matrix_product(monkeypatch, far):
    monkeypatch.setattr(c_program, "MANY", 0)
    rng = np.random.default_rng(2)
    n = 90 + far
    p, c = Program(n), rng.standard_normal((3, 19))
    at = [range(far + 5, far + 24), range(30, 49), [3, 1, 7, *range(60, 76)], [8, 2, 5, *range(62, 78)]]  # side by side, and scattered
    at += [range(k, k + 19) for k in (30, 38, 49, 57, 66)]
    weights = [c[0], c[1], c[0], c[1], *[c[2]] * 5]
    outputs = [combine([(x, p.input(k)) for k, x in zip(places, w, strict=True)]) for places, w in zip(at, weights, strict=True)]
    text = c_program.c_function("void run", p, outputs, "double")
    assert all(f"plain_{name}" in text for name in ("dots19run", "dots19at", "beside"))
    native, x = Native(p, outputs, n), rng.uniform(-1, 1, n)
    native.given[:] = x
    want = [w @ x[list(places)] for places, w in zip(at, weights, strict=True)]
    np.testing.assert_allclose(native(), want, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("given", [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
def test_sums_with_something_infinite_are_not_lost_to_their_neighbours(given):
    import onnxruntime

    p = Program(4)
    x = [p.input(k) for k in range(4)]
    ever = [p.where(p.apply("positive", x[k]), np.inf, x[k + 2]) for k in range(2)]
    ends = [p.apply("min", add(ever[0], x[2]), 5.0), p.apply("min", add(ever[1], x[3]), 5.0), p.apply("min", add(x[2], x[3]), 5.0)]
    made = onnx_model(p, {"x": (4,)}, {"y": np.array(ends, dtype=object)}, np.float64, 17, {})
    (got,) = onnxruntime.InferenceSession(made.SerializeToString(), providers=["CPUExecutionProvider"]).run(None, {"x": [*given, 0.5, 0.7]})
    np.testing.assert_allclose(got, [5.0 if given[0] > 0 else 1.0, 5.0 if given[1] > 0 else 1.4, 1.2])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "steps"), [("state", 100_000), ("hybrid", 20_000)])  # the hybrid's memory fades within 5,000
def test_long_runs_in_onnxruntime_are_the_model_s_torques(name, steps, tmp_path):
    model, motion, want = hundred_thousand(name)
    export_step(model, tmp_path / "arm.onnx", "onnx")
    assert np.abs(through_onnx(tmp_path / "arm.onnx", motion.rows(slice(steps))) - want[:steps]).max() < 1e-9 * np.sqrt((want**2).mean())


@pytest.mark.slow
@pytest.mark.parametrize("make", [planted, state_loads])
def test_a_compiled_arm_moves_as_the_dynamics_do(make):
    a = arm(2)
    dynamics = Dynamics(theory(a, make(a)))
    native, state = NativeArm(dynamics.model, dynamics.affine), dynamics.reset([0.1, 0.2])
    native.torque([0.1, 0.2], [0, 0], [0, 0])
    for _ in range(5):
        got = native.acceleration(state.q, state.qd, [1.0, -0.5])
        np.testing.assert_allclose(got, dynamics.forward_dynamics(state.q, state.qd, [1.0, -0.5], state=state), atol=1e-9)
        state = dynamics.follow(state, state.q + 0.01, state.qd + 0.3, 0.01)
        native.torque(state.q, state.qd, got, dt=0.01)
    motion = long_run(200)
    native.begin()
    through = [native.torque(*row, dt=2e-3) for row in zip(motion.q.numpy(), motion.qd.numpy(), motion.qdd.numpy(), strict=True)]
    np.testing.assert_allclose(through, dynamics.model.torque(motion), atol=1e-9)


def test_an_acceleration_is_found_where_newton_s_method_goes_to_and_fro():
    native = object.__new__(NativeArm)  # of a torque sign(a) sqrt|a|, on which Newton's step from a leads to -a
    native._known, native.affine, native.forward, native.n = None, False, None, 2
    native.torque = lambda q, qd, qdd, *others, **keys: np.sign(qdd) * np.sqrt(np.abs(qdd))
    np.testing.assert_allclose(native.acceleration([0, 0], [0, 0], [0.0, 0.0], start=[4.0, -2.0]), 0.0, atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["state", "sheltered"])
def test_a_few_hundred_steps_in_c_are_the_model_s_torques(name, tmp_path):
    model, motion = model_of(name), long_run(300)
    told = export_c(model, tmp_path / "arm.h")
    want = model.torque(motion).numpy()
    assert np.abs(driven(tmp_path, motion, "double", told["std"]) - want).max() < 1e-9 * np.sqrt((want**2).mean())
