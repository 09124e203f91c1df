"""What the drives must supply, without the faults of the rig's sensors."""

import json

import numpy as np
import pytest
from campaigns import GIVEN, planted
from rigs import arm, assert_close
from rigs import run as motion

from nnhydro.cli.main import run
from nnhydro.deployment.step import record_step
from nnhydro.effects.hypotheses.encoder_offset import EncoderOffset
from nnhydro.effects.hypotheses.sensor_timing import SensorTiming
from nnhydro.effects.hypotheses.torque_bias import TorqueBias
from nnhydro.errors import ModelError
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.storage import save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.without_instruments import sensor_faults, without_instruments

A = arm(2)


def faulty(*instruments):
    return StripTheory(A, GIVEN, {"seen": []}, "constant corrected", planted(A), instruments)


BIAS, TIMING, ENCODER = TorqueBias((0.4,), joint=1), SensorTiming((-0.0005,), (0.0,)), EncoderOffset((0.05,), joint=2)


def test_a_model_without_instruments_gives_what_the_drives_must_supply():
    clean, at = without_instruments(faulty(BIAS, TIMING)), motion(2)
    assert_close(clean.torque(at), faulty().torque(at))
    assert sensor_faults(faulty(BIAS, TIMING, ENCODER)) == ("torque_bias", "sensor_timing")


def test_an_encoder_that_reads_with_an_offset_stays_for_the_controller_reads_it_too():
    assert without_instruments(faulty(BIAS, ENCODER)).instruments == (ENCODER,)


def test_faults_inside_a_corrected_simulation_are_left_off_too():
    model = CorrectedSimulation(A, GIVEN, {}, faulty(BIAS), faulty(), faulty(BIAS))
    at = motion(2)
    assert sensor_faults(model) == ("torque_bias",)
    assert_close(without_instruments(model).torque(at), faulty().torque(at))


@pytest.mark.parametrize("instruments", [(BIAS,), (TIMING,), (BIAS, TIMING)], ids=["bias", "timing", "both"])
def test_export_refuses_faults_of_sensors_and_names_the_option_that_leaves_them_off(instruments, tmp_path, capsys):
    pytest.importorskip("onnx")
    folder = save_model(faulty(*instruments), tmp_path / "m")
    command = ["export", str(folder), "--out", str(tmp_path / "arm.onnx")]
    assert run(command) == 2
    err = capsys.readouterr().err
    assert "add --without-instruments" in err
    assert ", ".join(instrument.id for instrument in instruments) in err
    assert run([*command, "--without-instruments", "--json"]) == 0
    json.loads(capsys.readouterr().out)


def test_the_exported_numbers_are_those_without_the_faults(tmp_path):
    onnxruntime = pytest.importorskip("onnxruntime")
    folder = save_model(faulty(BIAS, TIMING), tmp_path / "m")
    assert run(["export", str(folder), "--out", str(tmp_path / "arm.onnx"), "--without-instruments", "--quiet"]) == 0
    session = onnxruntime.InferenceSession(str(tmp_path / "arm.onnx"))
    at = motion(2)
    row = {"q": at.q[9], "qd": at.qd[9], "qdd": at.qdd[9], "u0": at.u0[9:10], "du0": at.du0[9:10]}
    fed = {x.name: row[x.name].numpy() for x in session.get_inputs() if x.name in row}
    assert np.allclose(session.run(["tau"], fed)[0], faulty().torque(at)[9].numpy(), atol=1e-9)


def test_the_message_names_the_one_cause_that_stands_in_the_way():
    for model in (faulty(BIAS, TIMING), CorrectedSimulation(A, GIVEN, {}, faulty(BIAS), faulty(), faulty(TIMING))):
        with pytest.raises(ModelError, match=r"what sensor_timing remembers .* add --without-instruments"):
            record_step(model)
    assert record_step(faulty(BIAS)).step.size == 0
