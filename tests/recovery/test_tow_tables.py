"""Tables of steady tows, the law written here anew: spheres that sink in oil, put on one body by similarity.

    tau = K u (1 + 0.1 u / u_max)          Stokes drag, a little more at the highest Reynolds number (Oseen)
"""

import numpy as np
import pandas as pd
import pytest
import yaml

import nnhydro
from nnhydro.diagnosis.diagnose import diagnose

RHO, DIAMETER, FASTEST, STOKES = 1144.0, 0.004, 0.085, 0.89  # kg/m^3, m, m/s, N m s/m


@pytest.mark.parametrize("seed", [1, 5])
def test_drag_in_oil_is_linear_in_speed_and_no_current(seed, tmp_path):
    """To first order a current makes drag linear, too; at its own value it is as fast as the tow, and explains much less."""
    _, timing, density = np.split(0.012 * np.random.default_rng(seed).standard_normal(99), [45, 90])
    exact = np.repeat(np.geomspace(1.2e-3, FASTEST, 9), 5)
    tau = STOKES * exact * (1 + 0.1 * exact / FASTEST) * (1 + np.repeat(density, 5))
    u = exact * (1 + timing)
    table = pd.DataFrame({"run": [f"r{i:02d}" for i in range(45)], "q1_rad": 0.0, "dq1_rad_s": 0.0, "u0_m_s": u, "tau1_Nm": tau})
    (tmp_path / "steady").mkdir()
    table.to_csv(tmp_path / "steady" / "spheres.csv", index=False)
    link = {"length_m": 1.0, "diameter_m": DIAMETER, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 0.0, "known_to": 0.2}
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump({
        "schema": "nnhydro/arm/1", "name": "spheres in oil", "links": [link],
        "fluid": {"density_kg_m3": RHO, "kinematic_viscosity_m2_s": 1.66e-4}}))
    found = diagnose(nnhydro.load(tmp_path), "constant").findings
    assert [finding.effect for finding in found] == ["drag_form"]
    low, high = found[0].parameters["linear"].ci95
    assert low <= STOKES / (RHO * DIAMETER / 4) <= high
