"""What recordings are compared with: named physics, a model folder, or the user's own column, and which of its parameters may move."""


import pytest
from campaigns import campaign, planted
from rigs import arm

from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.design import design_of
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.errors import ConfigError, RecordingError
from nnhydro.recordings.filtering.low_pass import LowPass
from nnhydro.recordings.filtering.preprocessing import Preparation

ARM = arm(1)
WHOLE = campaign(ARM, planted(ARM), count=4, noise=0.01)
PROBLEM = problem_of(WHOLE, edge=3.0)


def test_baselines_are_named_columns_files_or_refused(tmp_path):
    units, how = PROBLEM.units(), Preparation(LowPass(3.0))
    assert baseline_of(None, ARM, units, how).name == "constant"
    assert baseline_of(None, arm(1, density=0.0), units, how).name == "rigid"
    with pytest.raises(ConfigError, match="neither a baseline"):
        baseline_of(str(tmp_path / "nothing"), ARM, units, how)
    with pytest.raises(RecordingError, match="tau1_sim_Nm"):
        design_of(PROBLEM, baseline_of("column", ARM, units, how))
