"""`nnhydro simulate` as a person types it."""

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from nnhydro.cli.simulate import simulate
from nnhydro.errors import NnhydroError

RECIPE = """
arm:
  fluid: {density_kg_m3: 1000.0}
  links: [{length_m: 0.6, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.3, inertia_kg_m2: 0.03}]
terms: {normal_drag: {C_D: 1.0}}
motions:
  - {kind: slew, name: reach, q_rad: [[0.0], [1.0]], duration_s: 1.0}
"""


def app() -> typer.Typer:
    made = typer.Typer(pretty_exceptions_enable=False)
    made.command()(simulate)
    return made


def test_it_says_what_was_made_and_what_comes_next(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text(RECIPE)
    result = CliRunner().invoke(app(), [str(tmp_path / "r.yaml"), "--out", str(tmp_path / "tank")], catch_exceptions=False)
    assert result.exit_code == 0
    assert "recordings/reach.csv" in result.output
    assert f"nnhydro check {tmp_path / 'tank'}" in result.output.replace("\n", "")
    assert (tmp_path / "tank/recordings/reach.csv").is_file()


def test_the_result_is_json_for_programs(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text(RECIPE)
    result = CliRunner().invoke(app(), [str(tmp_path / "r.yaml"), "--out", str(tmp_path / "tank"), "--json"], catch_exceptions=False)
    document = json.loads(result.output)
    assert document["terms"] == ["rigid_body", "normal_drag"]
    assert document["files"] == [{"file": "recordings/reach.csv", "kind": "slew", "rows": 201, "seconds": 2.0}]


def test_a_missing_recipe_is_named(tmp_path: Path) -> None:
    with pytest.raises(NnhydroError, match=r"nowhere\.yaml: cannot be read"):
        CliRunner().invoke(app(), [str(tmp_path / "nowhere.yaml"), "--out", str(tmp_path / "x")], catch_exceptions=False)
