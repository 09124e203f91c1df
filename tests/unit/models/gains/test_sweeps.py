"""Sweeps over speed and angle, model beside its references."""

import pytest
from campaigns import GIVEN, planted
from rigs import arm
from untrained import learned

from nnhydro.errors import ConfigError
from nnhydro.models.gains.sweeps import Around, document, sweeps
from nnhydro.models.strip_theory import StripTheory


def theory(a, loads=None):
    return StripTheory(a, GIVEN, {}, "constant", planted(a) if loads is None else loads)


def test_sweeps_show_the_model_beside_baseline_textbook_and_dry_arm():
    hybrid = learned(arm(2), hybrid=True)
    made = sweeps(hybrid, Around(1.5, 0.2, (0.1, 0.4)))
    assert [(s.joint, s.over) for s in made] == [(j, over) for j in (0, 1) for over in ("speed_rad_s", "angle_rad")]
    assert list(made[0].gains) == ["model", "baseline", "textbook", "dry arm"]
    assert float(made[0].values[0]) == -1.5
    assert float(made[0].values[len(made[0].values) // 2]) == 0.0
    assert float(made[0].damping("dry arm").abs().max()) < 1e-12
    assert document(hybrid, Around(), made)["units"]["qdd"] == "kg m^2"


def test_one_link_is_swept_over_speed_alone():
    made = sweeps(theory(arm(1)))
    assert [s.over for s in made] == ["speed_rad_s"]
    assert list(made[0].gains) == ["model", "textbook", "dry arm"]


def test_a_posture_needs_an_angle_a_joint():
    with pytest.raises(ConfigError, match="3 angles"):
        sweeps(theory(arm(2)), Around(posture_rad=(1.0, 2.0, 3.0)))
