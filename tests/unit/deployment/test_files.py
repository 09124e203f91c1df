"""A model as a file for a controller: each kind by its writer, faults of the sensors left out where that is asked for."""

import json
from dataclasses import replace

import numpy as np
import pytest
from campaigns import GIVEN, planted
from rigs import arm

from nnhydro.api.model import Model
from nnhydro.deployment import files
from nnhydro.effects.hypotheses.encoder_offset import EncoderOffset
from nnhydro.effects.hypotheses.torque_bias import TorqueBias
from nnhydro.models.domain import DOMAIN, Domain
from nnhydro.models.strip_theory import StripTheory

MODEL = StripTheory(arm(1), GIVEN, {}, "constant", planted(arm(1)), (TorqueBias(joint=1, offset=(0.5,)),
                                                                      EncoderOffset(joint=1, offset=(0.1,))))


@pytest.fixture
def asked(monkeypatch):
    """Which writer was asked for what."""
    found = {}
    for name in ("export_c", "export_casadi", "export_onnx"):
        monkeypatch.setattr(files, name, lambda *arguments, name=name: found.update({name: arguments}) or {"model": name})
    return found


@pytest.mark.parametrize(("kind", "writer"), [("c", "export_c"), ("casadi", "export_casadi"), ("onnx", "export_onnx")])
def test_each_kind_of_file_has_its_writer(kind, writer, asked, tmp_path):
    assert files.export_step(MODEL, tmp_path / "arm", kind, "single", "abc") == {"model": writer, "left_out": []}
    assert list(asked) == [writer]
    assert asked[writer][:2] == (MODEL, tmp_path / "arm")


@pytest.mark.parametrize("kind", ["c", "onnx"])
def test_faults_of_the_sensors_are_left_out_and_said_but_the_encoders_angle_stays(kind, asked, tmp_path):
    told = files.export_step(MODEL, tmp_path / "arm", kind, bare=True)
    assert told["left_out"] == ["torque_bias: a fault of the sensors, not of the arm"]
    ((model, *others),) = asked.values()
    assert [instrument.id for instrument in model.instruments] == ["encoder_offset"]
    assert kind != "c" or others[-1] == ["left out: torque_bias: a fault of the sensors, not of the arm"]


def test_what_moved_in_the_recordings_and_is_no_input_is_said_and_stands_in_the_files(tmp_path):
    still = replace(MODEL, instruments=())
    domain = Domain(np.ones(1), np.ones((1, 1)), 1.0, ("heading of the base", "measured current"))
    moved = replace(still, fit={DOMAIN: domain.document()})
    (line,) = files.export_step(moved, tmp_path / "moved.h", "c")["left_out"]
    assert line.startswith("heading of the base, measured current: ")
    assert "nnhydro predict" in line
    assert f"left out: {line}" in (tmp_path / "moved.h").read_text()
    assert files.export_step(still, tmp_path / "still.h", "c")["left_out"] == []
    header = (tmp_path / "still.h").read_text()
    assert "No inputs: base motion along +X, heading of the base, current" in header
    assert "left out" not in header


def test_the_onnx_file_says_what_are_no_inputs(tmp_path):
    pytest.importorskip("onnx")
    domain = Domain(np.ones(1), np.ones((1, 1)), 1.0, ("measured current",))
    model = replace(MODEL, instruments=(), fit={DOMAIN: domain.document()})
    (line,) = Model(model).export(tmp_path / "arm.onnx")
    told = json.loads((tmp_path / "arm.onnx.json").read_text())
    assert told["left_out"] == [line]
    assert "heading of the base" in told["no_inputs"]
