"""Full disks, closed pipes, folders that may not be written to, recordings that change: one line, and nothing half written."""

import json
import os
import resource
import shlex
import signal
import subprocess
import sys

import pytest
from planted import write_campaign

from nnhydro.cli.main import run
from nnhydro.runtime.stamp import STAMP


def names(folder):
    return sorted(p.name for p in folder.iterdir() if p.name != STAMP)


def limited(arguments, largest, capfd):
    """Run a command in a child in which no file may grow beyond `largest` bytes; return exit code and what it said."""
    capfd.readouterr()
    pid = os.fork()
    if not pid:
        code = 70
        try:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
            code = run(arguments)
        finally:
            sys.stderr.flush()
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    return code, capfd.readouterr().err


RECIPE = """schema: nnhydro/recipe/1
arm: {fluid: {density_kg_m3: 1000.0}, links: [{length_m: 0.5, diameter_m: 0.07, mass_kg: 1.0, com_m: 0.2, inertia_kg_m2: 0.02}]}
terms: {rigid_body: arm}
motions: [{kind: fourier, name: swim, q_rad: [0.0], duration_s: 3.0, reach_rad: [1.2], rate_rad_s: 2.0}]
"""


@pytest.mark.parametrize("largest", [300, 5000])  # bytes; the line of the error itself must fit
def test_a_disk_that_is_full_gets_one_line_and_keeps_what_was_there(largest, tmp_path, capfd):
    (tmp_path / "recipe.yaml").write_text(RECIPE)
    simulate = ["simulate", str(tmp_path / "recipe.yaml"), "--out", str(tmp_path / "out")]
    for before in ([], ["out"]):
        code, said = limited(simulate, largest, capfd)
        assert code == 2, said
        assert said.count("\n") == 1
        assert said.startswith("nnhydro: error: ")
        assert "nothing half written was left behind" in said
        assert names(tmp_path) == [*before, "recipe.yaml"]
        if not before:
            assert run([*simulate, "--quiet"]) == 0
    assert (tmp_path / "out" / "recordings" / "swim.csv").stat().st_size > 5000


@pytest.mark.slow
def test_a_full_disk_at_the_first_checkpoint_leaves_nothing_behind(tmp_path, capfd):
    root = write_campaign(tmp_path / "c", runs=3)
    (tmp_path / "t.toml").write_text('model = "network"\nhidden = [4]\nmembers = 1\nepochs = 2\n')
    train = ["train", str(root), "--config", str(tmp_path / "t.toml"), "--out", str(tmp_path / "model"), "--quiet"]
    code, said = limited(train, 2000, capfd)
    assert code == 2, said
    assert "ulimit -f" in said
    assert names(tmp_path) == ["c", "t.toml"]
    assert run(train) == 0
    assert names(tmp_path) == ["c", "model", "t.toml"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_to_gets_one_line(tmp_path, capsys):
    root = write_campaign(tmp_path / "c")
    (tmp_path / "locked").mkdir(mode=0o500)
    assert run(["identify", str(root), "--out", str(tmp_path / "locked" / "model")]) == 2
    assert "may not be written to" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(("line", "code"), [
    ("{n} check {c} | head -n 1", 0), ("{n} check {c} | true", 0), ("{n} check {c} --json | head -c 10", 0),
    ("{n} identify {c} --model textbook --out {o} 2>&1 | true", 0), ("{n} check {c} > /dev/full", 2), ("{n} check {c} >&-", 0),
])
def test_whoever_stops_reading_does_not_stop_the_work(line, code, tmp_path, quick_python):
    root = write_campaign(tmp_path / "c")
    line = line.format(n=f"{shlex.quote(str(quick_python / 'python'))} -m nnhydro", c=root, o=tmp_path / "model")
    done = subprocess.run(["bash", "-c", f"set -o pipefail; {line}"], capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    assert ("--out" not in line) or (tmp_path / "model" / "model.json").is_file(), "the results are written whether or not anybody reads"


@pytest.mark.slow
def test_json_on_a_pipe_is_whole(tmp_path, quick_python):
    root = write_campaign(tmp_path / "c")
    line = f"{shlex.quote(str(quick_python / 'python'))} -m nnhydro check {root} --json | cat"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)


@pytest.mark.parametrize(("line", "code", "said"), [
    ("{p} -c 'print(6 * 7); raise SystemExit(3)'", 3, "42"), ("{p} -m base64 -e <<< a", 0, "YQo="),
    ("{p} -c 'import sys; assert sys.stdout is None' >&-", 0, ""), ("{p} -c 'import os; os.kill(os.getpid(), 15)'", 143, ""),
    ("A=b {p} -c 'import os; print(os.environ[\"A\"], os.getcwd())'", 0, "b {c}")])
def test_a_quick_python_runs_as_any_python(line, code, said, tmp_path, quick_python):
    done = subprocess.run(["bash", "-c", line.format(p=quick_python / "python")], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip(), done.stderr) == (code, said.format(c=tmp_path), "")
