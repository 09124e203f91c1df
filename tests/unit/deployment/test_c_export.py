"""The header, compiled by the C compiler, gives the model's torques over 100,000 steps."""

import numpy as np
import pytest
from campaigns import planted
from rigs import arm
from stepped import MODELS, SAME, compiled, driven, hundred_thousand, largest_error, long_run, model_of, theory, towed

from nnhydro.deployment import c_program
from nnhydro.deployment.c_header import export_c
from nnhydro.deployment.files import export_step
from nnhydro.deployment.native import Native, NativeArm, compiler
from nnhydro.deployment.onnx.expressions import Program, combine
from nnhydro.deployment.step import record_step
from nnhydro.dynamics.dynamics import Dynamics
from nnhydro.effects.hypotheses.sensor_timing import SensorTiming
from nnhydro.errors import ConfigError, ModelError
from nnhydro.physics.travel.state_model import state_loads

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler here")


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("name", MODELS)
def test_a_hundred_thousand_steps_in_c_are_the_model_s_torques(name, precision, tmp_path):
    model, motion, want = hundred_thousand(name)
    told = export_c(model, tmp_path / "arm.h", precision)
    assert largest_error(driven(tmp_path, motion, precision, told["std"]), want) < SAME[precision]


def written(model, folder, precision, flags=()):
    """The header of `model` in C, as a function of a motion."""
    return compiled(folder, precision, export_c(model, folder / "arm.h", precision)["std"], flags)


@pytest.mark.slow(seconds=35)
@pytest.mark.parametrize("name", ["hybrid", "hybrid on state", "with memory"])
def test_a_hybrid_is_written_as_loops_and_gives_the_same_over_a_hundred_thousand_steps(name, tmp_path):
    (model, motion, want), slow = hundred_thousand(name), towed(4500)
    flags = () if name == "hybrid on state" else ("-DNO_DISPATCH",)  # one of them for each kind of processor, which takes gcc longer
    at_tow = model.torque(slow).numpy()
    for precision in ("double", "single"):
        torques = written(model, tmp_path, precision, flags)
        assert "static NOINLINE void plain_loop" in (tmp_path / "arm.h").read_text()
        far = largest_error(torques(motion), want)
        assert far < SAME[precision], f"{precision}: {far:.1e}"
        for widest in (1, 0) if not flags else ():
            assert largest_error(torques(motion.rows(slice(6000)), widest), want[:6000]) < SAME[precision]
        assert largest_error(torques(slow), at_tow) < SAME[precision]


def test_the_net_that_remembers_carries_more_than_a_tenth_of_the_torque():
    motion = long_run(2000)
    assert largest_error(model_of("with memory").torque(motion).numpy(), model_of("hybrid").torque(motion).numpy()) > 0.1


@pytest.mark.slow
def test_a_slow_tow_in_single_precision_forgets_no_travel(tmp_path):
    model, motion = model_of("state"), towed(4500)
    told = export_c(model, tmp_path / "arm.h", "single")
    assert "double memory[" in (tmp_path / "arm.h").read_text()
    want = model.torque(motion).numpy()
    far = largest_error(driven(tmp_path, motion, "single", told["std"]), want)
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
    assert largest_error(driven(tmp_path, motion, "double", told["std"]), want) < SAME["double"]
