"""Values that no tank, no fluid and no joint has are told, with their place and the likely cause; unusual ones are left alone."""

from dataclasses import replace

import numpy as np
import pytest
from planted import LINKS, campaign, healthy, recording, the_arm

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.cut_off import cut_cell
from nnhydro.recordings.recording import SteadyTable
from nnhydro.recordings.survey import survey


def found(c: Campaign) -> set[str]:
    return {oddity.check for oddity in survey(c).oddities}


def test_a_steady_table_towed_in_millimetres_a_second_is_refused_with_the_line_that_maps_it():
    q, u0 = np.zeros((5, 2)), np.linspace(200, 1000, 5)
    fast = Campaign.of(the_arm(), [], (SteadyTable("tow", tuple("abcde"), q, q, u0, np.column_stack([3 * u0, u0])),))
    oddity = next(o for o in survey(fast).oddities if o.check == "water_speed_in_table")
    assert oddity.severity == "error"
    assert "'steady: {u0_m_s: {from: u0_m_s, unit: mm/s}}'" in oddity.remedy


@pytest.mark.parametrize(("speed", "density", "severities"), [(20.0, 1000.0, []), (50.0, 1000.0, ["warning"]), (600.0, 1000.0, ["error"]),
                                                              (60.0, 1.2, []), (600.0, 1.2, ["warning"])])
def test_a_carriage_may_be_as_fast_as_tanks_and_tunnels_are(speed: float, density: float, severities: list[str]):
    arm = the_arm(fluid={"density_kg_m3": density})
    told = survey(campaign(lambda c: {"u0_m_s": speed * np.tanh(c["t_s"])}, in_all=True, arm=arm)).oddities
    assert [o.severity for o in told if o.check == "water_speed" and o.recording == "run1"] == severities


def test_runs_without_tow_do_not_speak_against_the_unit_of_the_carriage():
    """Their zeros are zeros in any unit: the advice was to convert the towed files, and not to map the column."""
    runs = [recording({**healthy(k), "u0_m_s": (600.0 if k == 1 else 0.0) * np.tanh(healthy(k)["t_s"])}, f"run{k}") for k in (1, 2, 3, 4)]
    (oddity,) = (o for o in survey(Campaign.of(the_arm(), runs)).oddities if o.check == "water_speed")
    assert "'u0_m_s: {from: u0_m_s, unit: mm/s}'" in oddity.remedy
    slow = replace(runs[1], u0=np.full(len(runs[1].t), 0.3))
    mixed = Campaign.of(the_arm(), [runs[0], slow, replace(slow, name="run3")])
    (oddity,) = (o for o in survey(mixed).oddities if o.check == "water_speed")
    assert "only 1 of 3 recordings is so" in oddity.remedy


def stated_speeds(stated: dict[str, str], density: float = 1000.0, **channels: np.ndarray) -> list[str]:
    one = recording({**healthy(1), **channels})
    arm = the_arm(fluid={"density_kg_m3": density})
    oddities = survey(Campaign.of(arm, [replace(one, origin=replace(one.origin, stated=stated))])).oddities
    return [o.message for o in oddities if o.check in ("stated_speed", "water_speed", "degrees", "fast_motion")]


def test_a_stated_unit_is_doubted_where_nothing_in_a_liquid_is_so_fast():
    c = healthy(1)
    tow = stated_speeds({"u0_m_s": "m/s"}, u0_m_s=600 * np.tanh(c["t_s"]))
    turned = stated_speeds({"q1_rad": "rad"}, q1_rad=np.degrees(c["q1_rad"]))
    soon = stated_speeds({"t_s": "ms"}, t_s=c["t_s"] / 60)
    for found, stated, likely in ((tow, "m/s", "mm/s"), (turned, "rad", "deg"), (soon, "ms", "s")):
        assert len(found) in (1, 2)
        assert f"by the stated unit {stated}, beyond anything in a liquid; in {likely} that would be" in found[0]
        assert f"write 'unit: {likely}' in the line of" in found[0]


def test_a_stated_unit_is_taken_as_given_where_it_is_possible():
    c = healthy(1)
    assert not stated_speeds({"u0_m_s": "m/s"}, u0_m_s=19 * np.tanh(c["t_s"]))
    assert not stated_speeds({"u0_m_s": "m/s"}, 1.2, u0_m_s=600 * np.tanh(c["t_s"]))
    assert not stated_speeds({"q1_rad": "rad", "q2_rad": "rad"}, 0.0, q1_rad=300 * c["t_s"])
    assert not stated_speeds({"q1_rad": "rad", "q2_rad": "rad"}, q1_rad=5 * c["t_s"])


@pytest.mark.parametrize(("fluid", "expected"), [
    ({"density_kg_m3": 0.0}, set()), ({"density_kg_m3": 1.2}, set()), ({"density_kg_m3": 1.2, "kinematic_viscosity_m2_s": 1.5e-5}, set()),
    ({"density_kg_m3": 1.0, "kinematic_viscosity_m2_s": 1e-6}, {"density"}), ({"density_kg_m3": 62.4}, {"density"}),
    ({"density_kg_m3": 1025.0, "kinematic_viscosity_m2_s": 1.2e-6}, set()),
    ({"density_kg_m3": 900.0, "kinematic_viscosity_m2_s": 5e-4}, set()),
    ({"density_kg_m3": 1000.0, "kinematic_viscosity_m2_s": 1e-3}, {"viscosity"}), ({"density_kg_m3": 13_500.0}, {"density"})])
def test_a_fluid_is_a_gas_or_a_liquid(fluid: dict[str, float], expected: set[str]):
    assert found(campaign(arm=the_arm(fluid=fluid))) & {"density", "viscosity"} == expected


@pytest.mark.parametrize(("mass", "density", "expected"), [(1000.0, 1000.0, True), (60.0, 1000.0, False), (1000.0, 0.0, False)])
def test_no_link_in_a_liquid_is_denser_than_matter_but_a_dummy_may_be_dense(mass: float, density: float, expected: bool):
    arm = the_arm(links=({**LINKS[0], "mass_kg": mass}, LINKS[1]), fluid={"density_kg_m3": density})
    assert ("link_density" in found(campaign(arm=arm))) == expected


@pytest.mark.parametrize("value", [-999.0, 1e5])
def test_one_wild_value_is_named_and_nothing_else_is_drawn_from_it(value: float):
    for name in ("q1_rad", "tau2_Nm"):
        oddities = survey(campaign(lambda c, name=name: {name: np.where(np.arange(1000) == 300, value, c[name])})).oddities
        assert [(o.check, o.severity) for o in oddities] == [("wild_sample", "warning")]
        assert oddities[0].where == f"{name}, row 302"
        assert f"reads {value:g}" in oddities[0].what


def test_an_impulse_of_many_rows_is_no_wild_value():
    assert "wild_sample" not in found(campaign(lambda c: {"tau1_Nm": c["tau1_Nm"] + 3e3 * (np.abs(c["t_s"] - 5) < 0.05)}))


def test_two_joints_with_the_same_numbers_are_told():
    assert "same_column" in found(campaign(lambda c: {"tau2_Nm": c["tau1_Nm"]}))


def test_times_that_one_line_converted_for_all_files_are_told():
    mixed = campaign(lambda c: {name: x[:300] / (1e3 if name == "t_s" else 1) for name, x in c.items()})
    oddity = next(o for o in survey(mixed).oddities if o.check == "mixed_times")
    assert oddity.where == "t_s, run1"
    assert "convert the times of these files" in oddity.remedy


@pytest.mark.parametrize(("runs", "words"), [(3, "only 1 of 3 recordings is so: convert q1_rad from degrees to rad in the file"),
                                             (1, "map it with its unit, 'q1_rad: {from: q1_rad, unit: deg}'")])
def test_a_unit_that_only_some_files_have_is_no_matter_of_the_mapping(runs: int, words: str):
    mixed = campaign(lambda c: {name: np.degrees(c[name]) for name in ("q1_rad", "dq1_rad_s")}, runs=runs)
    oddity = next(o for o in survey(mixed).oddities if o.check == "degrees")
    assert words in oddity.remedy


def test_noise_of_a_sensor_without_load_is_told_joint_by_joint():
    oddities = survey(campaign(lambda c: {"tau2_Nm": np.random.default_rng(len(c)).standard_normal(1000)}, in_all=True)).oddities
    assert [(o.check, o.where) for o in oddities if o.check == "noise_torque"] == [("noise_torque", "tau2_Nm")]


@pytest.mark.parametrize(("last", "told"), [(-0.0, True), (-5.0, True), (-5.1234, False), (None, False)],
                         ids=["a bare minus", "a jump without digits", "a jump with all its digits", "a whole row"])
def test_a_last_cell_is_cut_off_where_it_lost_its_digits_and_leaves_its_course(last, told):
    t = np.linspace(0, 2 * np.pi, 201)
    torque = np.round(-0.6 - 0.3 * np.sin(t), 4)
    if last is not None:
        torque[-1] = last
    assert cut_cell(torque) == told
