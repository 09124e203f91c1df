"""The ONNX file gives the model's torques over long runs, step by step: 5,000 of them, of a hybrid 1,250."""

import numpy as np
import pytest
from stepped import MODELS, long_run, model_of, under_way

from nnhydro.deployment.files import export_step


def through_onnx(path, motion):
    """Torques (n, 2) of the ONNX file `path`, fed step by step with the memory that it gave back."""
    import onnxruntime

    alone = onnxruntime.SessionOptions()
    alone.intra_op_num_threads = alone.inter_op_num_threads = 1  # threads that wait for so small a step cost more than it
    session = onnxruntime.InferenceSession(str(path), alone, providers=["CPUExecutionProvider"])
    shapes, found = {x.name: x.shape for x in session.get_inputs()}, []
    outputs = [x.name for x in session.get_outputs() if x.name in ("tau", "memory_next")]
    kept = [name for name in shapes if name == "memory"]
    memory = [np.zeros(shapes[name]) for name in kept]
    dt = np.diff(motion.t.numpy(), prepend=float(motion.t[0]) + 1.0)  # below 0 a run begins
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


@pytest.mark.parametrize("name", ["state", "diagnosed"])
def test_what_moves_in_its_first_step_has_moved_for_ever(name, tmp_path):
    model, motion = model_of(name), under_way()
    export_step(model, tmp_path / "arm.onnx", "onnx")
    want = model.torque(motion).numpy()
    assert np.abs(through_onnx(tmp_path / "arm.onnx", motion) - want).max() < 1e-9 * np.sqrt((want**2).mean())


@pytest.mark.slow
@pytest.mark.parametrize(("name", "steps", "dt"), [("state", 5000, 5e-3), ("hybrid", 1250, 1e-2)])  # the hybrid's memory fades within 10 s
def test_long_runs_in_onnxruntime_are_the_model_s_torques(name, steps, dt, tmp_path):
    model, motion = model_of(name), long_run(steps, dt=dt)
    export_step(model, tmp_path / "arm.onnx", "onnx")
    want = model.torque(motion).numpy()
    assert np.abs(through_onnx(tmp_path / "arm.onnx", motion) - want).max() < 1e-9 * np.sqrt((want**2).mean())
