"""`nnhydro reproduce` as a person types it."""

import json

import pytest

from nnhydro.cli.main import run
from nnhydro.report.mclain_figures import FIGURES


@pytest.mark.slow
def test_it_prints_the_table_says_what_is_missing_and_writes_the_figures(tmp_path, capsys):
    out = tmp_path / "paper"
    assert run(["reproduce", "mclain", "--out", str(out)]) == 0
    text = capsys.readouterr().out
    for part in ("43.4 %", "51.5 %", "12.6 %", "4.5 (4 in the abstract)", "Not in the text"):
        assert part in text
    for kind in ("png", "svg", "csv"):
        assert {path.stem for path in out.glob(f"*.{kind}")} == set(FIGURES)
    assert all(path.read_bytes()[:4] == b"\x89PNG" and path.stat().st_size > 10_000 for path in out.glob("*.png"))
    assert json.loads((out / "reproduction.json").read_text())["errors"]["textbook"] == pytest.approx(0.5149, abs=1e-4)


@pytest.mark.slow
def test_json_is_for_programs(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("nnhydro.report.mclain_figures.FIGURES", {})  # they were drawn above
    assert run(["reproduce", "--json", "--out", str(tmp_path / "paper")]) == 0
    assert json.loads(capsys.readouterr().out)["fitted_constants"]["C_D"] == pytest.approx(0.832, abs=1e-3)


def test_an_unknown_paper_is_refused_in_one_line(tmp_path, capsys):
    assert run(["reproduce", "sorensen", "--out", str(tmp_path / "paper")]) == 2
    assert "unknown paper 'sorensen': choose one of mclain, rivera" in capsys.readouterr().err
    assert run(["reproduce", "mclain", "--campaign", str(tmp_path), "--out", str(tmp_path / "paper")]) == 2
    assert "leave it out, or reproduce rivera" in capsys.readouterr().err
    assert not (tmp_path / "paper").exists()


@pytest.mark.slow
def test_the_identifier_of_rivera_is_studied_on_the_campaign_that_ships_with_the_package(tmp_path, capsys):
    out = tmp_path / "study"
    assert run(["reproduce", "rivera", "--epochs", "2", "--out", str(out)]) == 0
    text = capsys.readouterr().out
    for part in ("inputs: dimensional, angle", "64 neurons", "gain matrix d tau/d qdd", "L/D held out", "no figure of his can be compared"):
        assert part in text
    found = json.loads((out / "reproduction.json").read_text())
    assert set(found["neurons"]) == {"4", "8", "16", "32", "64"}
    assert (out / "gains.png").stat().st_size > 10_000
