"""`nnhydro power` as a user meets it: a campaign or a plan in, a table or JSON out, a user's error in one line."""

import json

import pytest
from campaigns import campaign, planted, write_folder
from rigs import arm

from nnhydro.cli.main import run

PLAN = """arm:
  fluid: {density_kg_m3: 1000.0}
  links: [{length_m: 0.55, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.27, inertia_kg_m2: 0.026}]
motions:
  - {kind: slew, name: a, q_rad: [[0], [1.2], [0]], duration_s: 1.5}
  - {kind: slew, name: b, q_rad: [[0.5], [-0.8], [0]], duration_s: 1.2}
  - {kind: slew, name: c, q_rad: [[0], [1.0], [-0.4]], duration_s: 1.0}
  - {kind: slew, name: d, q_rad: [[0.2], [1.4], [0.2]], duration_s: 2.0}
  - {kind: slew, name: e, q_rad: [[0.2], [-1.4], [0.2]], duration_s: 1.7}
sensors: {torque_noise_Nm: %s}
"""


def plan(folder, noise):
    path = folder / "plan.yaml"
    path.write_text(PLAN % noise)
    return path


@pytest.mark.slow
def test_a_plan_says_for_each_effect_from_what_size_on_it_shows(tmp_path, capsys):
    assert run(["power", str(plan(tmp_path, 0.02)), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    rows = {(r["effect"], r["joint"], r["parameter"]): r for r in told["effects"]}
    assert 0.001 < rows["coulomb_friction", 1, "level"]["smallest_size"] < 0.1
    assert rows["coulomb_friction", 1, "level"]["unit"] == "N m"
    assert rows["added_mass", None, "C_M[1]"]["smallest_size"] is None
    assert all(0 <= r["visible_share"] <= 1 for r in told["effects"])
    assert list(tmp_path.iterdir()) == [tmp_path / "plan.yaml"]


@pytest.mark.slow
def test_a_campaign_ends_with_a_verdict_and_the_next_command(tmp_path, capsys):
    a = arm(1)
    folder = write_folder(campaign(a, planted(a), 4, noise=0.01, seconds=2.0, rate=50.0), tmp_path / "c")
    assert run(["power", str(folder)]) == 0
    said = capsys.readouterr().out
    assert "4 recordings can reveal" in said
    assert "visible" in said
    assert f"Next: nnhydro diagnose {folder}" in said


@pytest.mark.parametrize(("make", "match"), [(lambda f: plan(f, 0.0), "torque_noise_Nm"), (lambda f: f / "nothing", "does not exist"),
                                             (lambda f: plan(f, "loud"), "torque_noise_Nm")])
def test_what_cannot_be_used_is_one_line_and_exit_2(tmp_path, capsys, make, match):
    assert run(["power", str(make(tmp_path))]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert match in said[0]
