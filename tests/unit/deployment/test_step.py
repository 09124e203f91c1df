"""A model as one step in time, or the reason why it cannot be one."""

import pytest
import torch
from campaigns import GIVEN, planted
from rigs import arm
from stepped import theory

from nnhydro.deployment.c_header import export_c
from nnhydro.deployment.files import export_step
from nnhydro.deployment.step import record_step
from nnhydro.effects.hypotheses.sensor_timing import SensorTiming
from nnhydro.errors import ConfigError, ModelError
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.loads.normal_drag import NormalDrag


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


class InNumpy(TorqueModel):
    """A model that leaves torch on the way."""

    def torque(self, motion):
        return torch.from_numpy(NormalDrag((1.0, 1.0)).torque(Flow(self.arm, motion)).numpy().copy())

    def document(self):
        return {}


def test_a_model_that_computes_outside_torch_is_refused():
    with pytest.raises(ModelError, match="outside torch"):
        record_step(InNumpy(arm(2), GIVEN, {}))
