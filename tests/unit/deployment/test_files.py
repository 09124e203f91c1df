"""A model as a file for a controller: each kind by its writer, faults of the sensors left out where that is asked for."""

import pytest
from campaigns import GIVEN, planted
from rigs import arm

from nnhydro.deployment import files
from nnhydro.effects.hypotheses.encoder_offset import EncoderOffset
from nnhydro.effects.hypotheses.torque_bias import TorqueBias
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
    assert files.export_step(MODEL, tmp_path / "arm", kind, "single", "abc") == {"model": writer}
    assert list(asked) == [writer]
    assert asked[writer][:2] == (MODEL, tmp_path / "arm")


@pytest.mark.parametrize("kind", ["c", "onnx"])
def test_faults_of_the_sensors_are_left_out_and_said_but_the_encoders_angle_stays(kind, asked, tmp_path):
    told = files.export_step(MODEL, tmp_path / "arm", kind, bare=True)
    assert told["left_out"] == ["torque_bias: a fault of the sensors, not of the arm"]
    ((model, *others),) = asked.values()
    assert [instrument.id for instrument in model.instruments] == ["encoder_offset"]
    assert kind != "c" or others[-1] == ["left out: torque_bias: a fault of the sensors, not of the arm"]
