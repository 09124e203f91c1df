"""The command as a program of its own."""

import subprocess
import sys

from nnhydro.cli import effects
from nnhydro.cli.main import COLLECTED, INTERRUPTED, run


def test_a_command_looks_for_unused_cycles_of_objects_seldom():
    script = ("import atexit, gc, sys\nfrom nnhydro.cli.main import main\natexit.register(lambda: print(gc.get_threshold()))\n"
              "sys.argv = ['nnhydro', '--version']\nmain()")
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert said.splitlines()[-1] == str(COLLECTED)


def test_a_command_that_is_stopped_says_so(monkeypatch, capsys):
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(effects, "effects", interrupted)
    assert run(["effects"]) == INTERRUPTED
    assert capsys.readouterr().err.startswith("nnhydro: stopped")
