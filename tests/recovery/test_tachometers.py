"""A flywheel that a constant torque spins up, recorded by a tachometer whose integral stands as the angle; written without nnhydro.

    J dw/dt = T - b w,    w = (T / b) (1 - exp(-b t / J))
"""

import numpy as np
import pandas as pd
import pytest
import yaml

import nnhydro
from nnhydro.diagnosis.diagnose import diagnose

J, B, TORQUE, NOISE = 4.8e-3, 3.6e-3, 1.0, 2.5  # kg m^2, N m s/rad, N m, rad/s


def campaign(place, seed):
    """Write five pieces of one run at 50 Hz to `place`, the inertia known to 5 %."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 5.0, 0.02)
    speed = TORQUE / B * (1 - np.exp(-B * t / J)) + NOISE * rng.standard_normal(len(t))
    angle = np.concatenate([[0.0], np.cumsum(0.02 * (speed[1:] + speed[:-1]) / 2)])
    (place / "recordings").mkdir(parents=True)
    for k, rows in enumerate(np.array_split(np.arange(len(t)), 5)):
        table = pd.DataFrame({"t_s": t[rows], "q1_rad": angle[rows], "dq1_rad_s": speed[rows], "tau1_Nm": TORQUE})
        table.to_csv(place / "recordings" / f"up{k}.csv", index=False)
    link = {"length_m": 0.1, "diameter_m": 0.02, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": J, "known_to": 0.05}
    (place / "arm.yaml").write_text(yaml.safe_dump({
        "schema": "nnhydro/arm/1", "name": "flywheel", "links": [link],
        "fluid": {"density_kg_m3": 0.0, "kinematic_viscosity_m2_s": 1e-6}}))
    return nnhydro.load(place)


@pytest.mark.parametrize("seed", [1, 2])
def test_back_emf_is_found_although_a_constant_torque_is_explained_exactly_by_dry_friction(seed, tmp_path):
    """The integral of the rates is smooth. If it counted as measured, the accelerations would seem exact, and the inertia wrong."""
    result = diagnose(campaign(tmp_path / "flywheel", seed), "rigid")
    assert [finding.effect for finding in result.findings] == ["viscous_friction"]
    low, high = result.findings[0].parameters["coefficient"].ci95
    assert low <= B <= high
    assert result.heldout.after < 0.08
    assert "integral" in result.checks["left_out"]
