"""An exported model gives, in onnxruntime and step by step, the torques of the model; what a step cannot carry is refused."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted, recording
from onnx_session import session
from rigs import arm, run, states

from nnhydro.api.model import Model
from nnhydro.deployment.onnx import onnx_file
from nnhydro.deployment.onnx.onnx_file import export_onnx
from nnhydro.errors import ConfigError, MissingExtraError
from nnhydro.features.wake import STATES, STRIPS
from nnhydro.models.prediction import predict
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.loads.axial_drag import AxialDrag
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.motion import Motion

ROUND_OFF = 1e-12  # of the torque: sums in another order
SAME = 1e-6  # of the rms torque, what a controller is promised


def theory(a, loads=None):
    return StripTheory(a, GIVEN, {}, "constant", planted(a) if loads is None else loads)


def relative(got, want):
    return float(np.abs(np.asarray(got) - np.asarray(want)).max() / np.sqrt((np.asarray(want) ** 2).mean()))


def fed(exported, motion, dtype=np.float64):
    """Outputs of an exported model for the rows of a motion, a call each, memory handed on as the sidecar says."""
    shapes, outputs = {x.name: x.shape for x in exported.get_inputs()}, [x.name for x in exported.get_outputs()]
    t = motion.t.numpy()
    columns = {k: getattr(motion, k).numpy() for k in ("q", "qd", "qdd", "u0", "du0")} | {"dt": np.diff(t, prepend=t[0] + 1.0)}
    columns = {k: x.astype(dtype).reshape(len(t), *shapes[k]) for k, x in columns.items() if k in shapes}
    memory, found = {"memory": np.zeros(shapes["memory"], dtype)} if "memory" in shapes else {}, {k: [] for k in outputs}
    found.pop("memory_next", None)
    for row in range(len(t)):
        out = dict(zip(outputs, exported.run(outputs, {k: x[row] for k, x in columns.items()} | memory), strict=True))
        memory = {"memory": out.pop("memory_next")} if memory else {}
        for k, x in out.items():
            found[k].append(x)
    return {k: np.stack(rows) for k, rows in found.items()}


@pytest.fixture(scope="module")
def exported(hybrid, tmp_path_factory):
    path = tmp_path_factory.mktemp("exported") / "hybrid.onnx"
    return export_onnx(hybrid, path, digest="abc"), path


@pytest.mark.parametrize("keys", [{}, {"gravity_m_s2": 9.81}, {"drive": {"kind": "remote", "pulley_ratio": 1.5}},
                                  {"gear": {"ratio": 5.0, "efficiency": 0.8, "torque_at": "motor"}}],
                         ids=["plain", "upright", "belt", "gear"])
@pytest.mark.parametrize("links", [1, 2, 3])
def test_a_physics_model_is_exported_exactly(links, keys, tmp_path):
    if links != 2 and "drive" in keys:
        pytest.skip("a belt drives two links")
    a = arm(links, **keys)
    friction = CoulombTerm((0.05,) * links)
    model = theory(a, planted(a).plus("friction", friction).plus("axial", AxialDrag((0.03,) * links)))
    told = export_onnx(model, tmp_path / "m.onnx")
    motion = states(links, 30)
    assert relative(fed(session(tmp_path / "m.onnx"), motion)["tau"], model.torque(motion)) < ROUND_OFF
    assert [x["name"] for x in told["inputs"]] == ["q", "qd", "qdd", "u0", "du0"]
    assert told["memory"] is None


@pytest.mark.slow
def test_a_hybrid_gives_in_onnxruntime_what_predict_gives_for_a_whole_recording(hybrid, exported):
    _, path = exported
    for speed in (0.0, 0.4):
        r = recording(hybrid.arm, planted(hybrid.arm), seed=9, seconds=2.0, rate=50.0, speed=speed)
        wanted = predict(hybrid, r)
        zero = np.zeros(len(r))
        carriage = (zero, zero) if r.u0 is None else (r.u0, r.du0)
        motion = Motion(*(torch.from_numpy(np.array(x)) for x in (r.t, r.q, r.qd, r.qdd, *carriage)))
        got = fed(session(path), motion)
        assert relative(got["tau"], wanted.tau) < SAME
        assert relative(got["std"], wanted.std) < SAME


def test_the_memory_matters(hybrid, exported):
    motion = run(2)
    forgetful = replace(motion, steady=True)
    got = fed(session(exported[1]), motion)["tau"]
    assert relative(got, hybrid.torque(motion)) < SAME
    assert relative(got, hybrid.torque(forgetful)) > 1e-3


@pytest.mark.slow
def test_single_precision_is_close(hybrid, tmp_path):
    export_onnx(hybrid, tmp_path / "h.onnx", "single")
    got = fed(session(tmp_path / "h.onnx"), run(2), np.float32)["tau"]
    assert relative(got, hybrid.torque(run(2))) < 1e-4


def test_the_sidecar_says_how_to_feed_it(exported):
    told, path = exported
    assert json.loads((path.parent / "hybrid.onnx.json").read_text()) == told
    assert told["schema"] == "nnhydro/onnx/2"
    assert told["model_digest"] == "abc"
    assert {x["name"]: x for x in told["inputs"]}["memory"]["shape"] == [STATES * 2 * STRIPS]
    assert "dt = -1" in told["memory"]
    assert told["checked"]["relative_deviation_in_double"]["along_runs"] < 1e-9
    assert json.loads(session(path).get_modelmeta().custom_metadata_map["nnhydro"]) == told


@pytest.mark.slow
def test_values_that_nobody_asks_for_any_more_are_left_behind(hybrid, exported):
    import onnx

    graph = onnx.shape_inference.infer_shapes(onnx.load(exported[1])).graph
    sizes = {x.name: x.type.tensor_type.shape.dim[0].dim_value for x in graph.value_info}
    joined = [sizes[node.output[0]] for node in graph.node if node.op_type == "Concat"]
    assert max(joined) < 0.7 * len(onnx_file.record_step(hybrid).program.atoms)  # the neurons of a strip are needed together


def test_the_strips_are_not_one_large_matrix_of_zeros(exported):
    import onnx

    graph = onnx.load(exported[1]).graph
    assert sum(int(np.prod(x.dims)) for x in graph.initializer) < 250_000


@pytest.mark.slow
def test_a_hybrid_with_a_trained_memory_is_exported_with_all_that_it_remembers(hybrid, with_memory, tmp_path):
    path, model = tmp_path / "h.onnx", with_memory
    assert Model(model).export(path) == ()
    assert relative(fed(session(path), run(2))["tau"], model.torque(run(2))) < SAME
    assert relative(hybrid.torque(run(2)), model.torque(run(2))) > 0.1


def test_without_the_library_the_pip_command_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(MissingExtraError, match=r"nnhydro\[onnx\]"):
        export_onnx(theory(arm(1)), tmp_path / "m.onnx")
    assert not list(tmp_path.iterdir())


def test_an_unknown_precision_and_a_folder_are_refused(tmp_path):
    with pytest.raises(ConfigError, match="double, single"):
        export_onnx(theory(arm(1)), tmp_path / "m.onnx", "half")
    with pytest.raises(ConfigError, match="is a folder"):
        export_onnx(theory(arm(1)), tmp_path)
