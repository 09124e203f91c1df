"""What a rig can do: limits that are stated replace what its recordings have shown."""

import re

import numpy as np
import pytest
from problems import rig

from nnhydro.diagnosis.experiment.rig_limits import read_limits
from nnhydro.errors import ConfigError


def test_stated_limits_replace_what_the_rig_has_shown_and_the_rest_stays(tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text("q_rad: [[-2, 2], [-1, 1.5]]\ndq_rad_s: 3\nu0_m_s: 0.8\n")
    wider = rig().with_limits(read_limits(path))
    np.testing.assert_array_equal(wider.q, [[-2, 2], [-1, 1.5]])
    np.testing.assert_array_equal(wider.rate, [3, 3])
    np.testing.assert_array_equal(wider.acceleration, rig().acceleration)
    assert (wider.u0, wider.seconds, wider.stated) == (0.8, rig().seconds, True)


@pytest.mark.parametrize(("text", "line"), [
    ("dq_rads: 3\n", "unknown key 'dq_rads': did you mean 'dq_rad_s'"),
    ("q_rad: [[-1, 1]]\n", "limits.yaml: q_rad has 1 range for an arm of 2 joints: give one"),
    ("q_rad: [[1, -1], [0, 1]]\n", "the lower angle first"),
    ("tau_Nm: [1, 2, 3]\n", "limits.yaml: tau_Nm lists 3 numbers for an arm of 2 joints: list one per joint"),
    ("dq_rad_s: [1]\n", "limits.yaml: dq_rad_s lists 1 number for an arm of 2 joints: list one per joint, or give one number"),
    ("dq_rad_s: fast\n", "limits.yaml: dq_rad_s: must be a number, got 'fast'"),
    ("dq_rad_s: [1, -1]\n", "dq_rad_s[1]: must be at least 0")])
def test_limits_that_do_not_fit_are_refused_in_one_line(tmp_path, text, line):
    path = tmp_path / "limits.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=re.escape(line)):
        read_limits(path).check(2)
