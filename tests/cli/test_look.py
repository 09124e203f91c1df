"""How commands look: a table, a verdict in a sentence, the next command; --quiet leaves the verdict; colours only on a terminal."""

import io
import json
import re
import subprocess
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from pathlib import Path

import pytest
from campaigns import campaign, planted, write_folder
from rigs import arm

import nnhydro.cli
from nnhydro.cli.main import run

SLOW = pytest.mark.slow  # they draw figures
COMMANDS = sorted(path.stem for path in Path(nnhydro.cli.__file__).parent.glob("*.py") if path.stem not in ("__init__", "main"))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A campaign folder, a fitted model and an unseen motion."""
    a = arm()
    root = tmp_path_factory.mktemp("look")
    folder = write_folder(campaign(a, planted(a), count=4, noise=0.01), root / "campaign")
    assert run(["identify", str(folder), "--out", str(root / "model"), "--json"]) == 0
    return root


def calls(root):
    """One call a command that ends with a verdict, on small data."""
    at = {name: str(root / name) for name in ("campaign", "model", "out", "torques", "x.onnx")}
    motion = str(root / "campaign" / "recordings" / "run0.csv")
    return {"check": [at["campaign"]], "identify": [at["campaign"], "--out", at["out"]],
            "predict": [at["model"], motion, "--out", at["torques"]], "gains": [at["model"], "--out", str(root / "gains")],
            "export": [at["model"], "--out", at["x.onnx"]],
            "benchmark": [at["campaign"], "--models", "textbook,constant", "--folds", "2", "--out", str(root / "compared")]}


@pytest.fixture(scope="module")
def printed(place):
    """What a command of `calls` prints, run once: its output and its news."""
    @cache
    def call(command):
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            assert run([command, *calls(place)[command]]) == 0
        return out.getvalue(), err.getvalue()
    return call


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_can_be_quiet_and_speak_json(command, capsys):
    assert run([command, "--help"]) == 0
    out = re.sub(r"\s+", " ", capsys.readouterr().out)
    assert "--json" in out
    assert "--quiet" in out


@pytest.mark.slow
@pytest.mark.parametrize("command", ["check", "identify", "predict", pytest.param("gains", marks=SLOW), "export",
                                     pytest.param("benchmark", marks=SLOW)])
def test_a_command_ends_with_a_verdict_and_quiet_leaves_that_alone(command, place, printed, capsys, monkeypatch):
    arguments, (out, err) = calls(place)[command], printed(command)
    for figures in ("benchmark.page.benchmark_figures", "models.gains.gain_figure"):  # they are drawn once, above
        monkeypatch.setattr(f"nnhydro.report.{figures}", lambda *given: [])
    assert run([command, *arguments, "--quiet"]) == 0
    quiet = capsys.readouterr()
    assert quiet.err == ""
    (verdict,) = quiet.out.splitlines()
    assert verdict.endswith(".")
    lines = out.splitlines()
    assert verdict in lines
    assert len(lines) > 2
    assert "\x1b" not in out + err, "no colours where there is no terminal"
    assert run([command, *arguments, "--json"]) == 0
    json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("command", ["check", "identify", "predict", pytest.param("benchmark", marks=SLOW)])
def test_the_next_command_is_one_of_ours_and_can_be_typed(command, place, printed):
    (following,) = [line for line in printed(command)[0].splitlines() if line.startswith("Next: ")]
    words = following.removeprefix("Next: ").split("   (")[0].split()
    assert words[0] == "nnhydro"
    assert words[1] in COMMANDS
    assert words[2].startswith(str(place)), "it names the same campaign or model"


@SLOW  # a fresh interpreter
def test_a_wide_table_is_not_cut_where_it_is_piped(place, quick_python):
    text = subprocess.run([quick_python / "python", "-m", "nnhydro", "identify", str(place / "campaign"), "--out", str(place / "out")],
                          capture_output=True, text=True, check=True).stdout
    assert "rigid_body.second_moment[2]" in text
    assert "…" not in text


def test_one_quiet_run_does_not_hush_the_next(place, capsys):
    run(["check", str(place / "campaign"), "-q"])
    capsys.readouterr()
    run(["check", str(place / "campaign")])
    assert len(capsys.readouterr().out.splitlines()) > 5


@pytest.mark.parametrize("arguments", [[], ["--help"]])
def test_without_a_command_the_help_is_printed_as_it_is_written(arguments, capsys):
    assert run(arguments) == 0
    out, err = capsys.readouterr()
    assert not err
    lines = out.splitlines()
    assert any(line.strip().startswith("Usage: nnhydro") for line in lines)
    assert {line.split()[0] for line in lines if line.startswith("  ") and line.split()} >= set(COMMANDS)
