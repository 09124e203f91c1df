"""Tables of steady runs, their laws written here anew: spheres that sink in oil, put on one body by similarity, and propellers.

    tau = K u (1 + 0.1 u / u_max)          Stokes drag, a little more at the highest Reynolds number (Oseen)
    tau = T (1 +- a) w |w|                 a propeller that pushes harder forwards (+) than backwards
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


def table(folder, rates, tau, tows=0.0, length=0.038, diameter=0.02):
    """Write the table of a body, by default of one of 76 mm that stands for a propeller: the torque `tau` N m at `rates` and `tows`."""
    (folder / "steady").mkdir()
    names = [f"r{i:02d}" for i in range(len(rates))]
    rows = pd.DataFrame({"run": names, "q1_rad": 0.0, "dq1_rad_s": rates, "u0_m_s": tows, "tau1_Nm": tau})
    rows.to_csv(folder / "steady" / "thrust.csv", index=False)
    link = {"length_m": length, "diameter_m": diameter, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 0.0, "known_to": 0.2}
    (folder / "arm.yaml").write_text(yaml.safe_dump({
        "schema": "nnhydro/arm/1", "name": "thruster", "links": [link],
        "fluid": {"density_kg_m3": 1000.0, "kinematic_viscosity_m2_s": 1e-6}}))
    return nnhydro.load(folder)


@pytest.mark.parametrize("seed", [2, 3])
def test_a_propeller_that_pushes_harder_forwards_has_a_drag_that_differs_by_direction_and_no_friction(seed, tmp_path):
    rng = np.random.default_rng(seed)
    w = np.concatenate([-np.linspace(60, 390, 24), np.linspace(60, 390, 24)])
    tau = 1.28e-5 * (1 + 0.11 * np.sign(w)) * w * np.abs(w) * (1 + 0.01 * rng.standard_normal(48))
    found = diagnose(table(tmp_path, w, tau), "constant").findings
    assert [finding.effect for finding in found] == ["drag_form"]
    low, high = found[0].parameters["direction[1]"].ci95
    coefficient = 1.28e-5 / (1000.0 * 0.02 * 0.038**4 / 8)  # C_D: tau = rho D C_D L^4 w^2 / 8
    assert low <= 0.11 * coefficient <= high
    assert "not alike in both directions" in found[0].statement


@pytest.mark.parametrize("seed", [2, 3])
@pytest.mark.parametrize("exponent", [2.0, 2.1])
def test_a_thrust_beyond_the_drag_of_any_cylinder_asks_for_the_diameter_and_names_no_body_at_the_tip(exponent, seed, tmp_path):
    """With the larger exponent such a body fits better, but only with a linear drag below 0."""
    w = np.linspace(60, 390, 21)
    tau = 4e-4 * 390**2 * (w / 390) ** exponent * (1 + 0.01 * np.random.default_rng(seed).standard_normal(21))
    told = diagnose(table(tmp_path, w, tau), "constant")
    assert not told.findings
    assert "it can only lie between 0 and 5: check the lengths, diameters" in told.verdict()
    assert told.detected
    assert told.noise_floor < 0.1, "what the bounds leave is no noise"
    reason = next(d.reason for d in told.decisions if d.effect == "tip_drag")
    assert "beyond their physical bounds explain as much" in reason or exponent == 2.1


@pytest.mark.parametrize("seed", [2, 3])
def test_a_ball_at_the_tip_of_a_thin_rod_is_named_where_no_coefficient_of_the_rod_acts_like_it(seed, tmp_path):
    """Turned and towed: at its tip the ball feels w = L qd + u0, and C_D of the rod would be 22 towed but 44 turned."""
    L, rng = 0.3, np.random.default_rng(seed)
    rates, tows = (x.ravel() for x in np.meshgrid(np.linspace(-3, 3, 7), np.linspace(-0.6, 0.6, 7)))
    w, x = L * rates + tows, np.linspace(0, L, 2001)
    along = x[:, None] * rates + tows
    rod = np.trapezoid(500 * 1.1 * 0.003 * along * np.abs(along) * x[:, None], x, axis=0)
    tau = (500 * 0.01 * L * w * np.abs(w) + rod) * (1 + 0.01 * rng.standard_normal(49)) + 0.002 * rng.standard_normal(49)
    told = diagnose(table(tmp_path, rates, tau, tows, length=L, diameter=0.003), "constant")
    assert [finding.effect for finding in told.findings] == ["tip_drag"]
    low, high = told.findings[0].parameters["drag_area"].ci95
    assert low <= 0.01 <= high
    assert "it can only lie between 0 and 5" in told.verdict()
