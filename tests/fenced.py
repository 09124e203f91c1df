"""Fenced blocks of a Markdown page: files, changes of files, commands, Python, and what these print."""

import io
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

from nnhydro.cli.main import run

FENCE = re.compile(r"^```(?P<head>[^\n]*)\n(?P<body>.*?)^```$", re.M | re.S)
CAPTION = re.compile(r":caption: (?P<name>\S+)\n+")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
NEAR = 0.05  # of a number that a page shows: noise, libraries and machines differ
INSTALLS = ("pip install", "python3 -m venv")


@dataclass
class Block:
    """A fenced block: its language, its text, and the file that it is or changes, where it has a caption."""

    page: str
    kind: str
    text: str
    file: str = ""


def blocks(path: Path) -> Iterator[Block]:
    """The blocks of a page that are more than pictures of folders."""
    for match in FENCE.finditer(path.read_text(encoding="utf-8")):
        head, body = match["head"].strip(), match["body"]
        if head.startswith("{code-block}"):
            caption = CAPTION.match(body)
            assert caption, f"{path.stem}: a code-block without a caption is no file: write ```{head.split()[-1]}"
            yield Block(path.stem, head.split()[-1], body[caption.end():], caption["name"])
        elif head in ("python", "sh", "text"):
            yield Block(path.stem, head, body)
        else:
            assert head in ("", "mermaid", "{toctree}", "{eval-rst}"), f"{path.stem}: a block of kind {head!r} would not be tested"


def typed(command: str, folder: Path, python: Path, **environment: str) -> str:
    """What a shell prints for a block of commands; its `python` is the one in the folder `python`."""
    lines = [line for line in command.splitlines() if not line.startswith(INSTALLS)]
    path = os.pathsep.join([str(python), str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", "\n".join(lines)], cwd=folder, capture_output=True, text=True,
                          env={**os.environ, "PATH": path, "OMP_NUM_THREADS": "1", **environment})
    assert done.returncode == 0, f"$ {command}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


def run_here(command: str) -> str:
    """What `nnhydro` prints for a block of its commands, each run in this process: nothing but the start of Python is saved."""
    came = io.StringIO()
    for line in command.splitlines():
        if line.startswith(INSTALLS):
            continue
        name, *arguments = shlex.split(line, comments=True) or [""]
        if name:
            with redirect_stdout(came):
                assert (name, run(arguments)) == ("nnhydro", 0), f"$ {line}\n{came.getvalue()[-2000:]}"
    return came.getvalue()


def alike(shown: str, came: str) -> bool:
    """Whether a line of the page is what came out: the same words, numbers within NEAR."""
    if NUMBER.sub("#", " ".join(shown.split())) != NUMBER.sub("#", " ".join(came.split())):
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(came), strict=True)
    return all(abs(float(a) - float(b)) <= NEAR * abs(float(a)) + 0.5 * 10.0 ** -len(a.partition(".")[2]) for a, b in pairs)


def changed(text: str, change: str) -> str:
    """`text` after a change written as a diff without line numbers: lines with " " and "-" are found in it once, those with "+" are new."""
    lines = change.strip("\n").splitlines()
    assert all(line[:1] in (" ", "+", "-", "") for line in lines), f"each line of a change begins with a blank, + or -:\n{change}"
    before = "\n".join(line[1:] for line in lines if line[:1] != "+")
    after = "\n".join(line[1:] for line in lines if line[:1] != "-")
    assert f"\n{text}".count(f"\n{before}\n") == 1, f"these lines do not stand in the file exactly once:\n{before}"
    return f"\n{text}".replace(f"\n{before}\n", f"\n{after}\n")[1:]


def follow(page: Path, tree: Path, python: Path) -> str:
    """Do what a page says in a copy of the tree, block by block: write files, change lines, type commands; return what was printed last.

    `python` is the folder of the Python that the commands find.
    """
    out = ""
    for block in blocks(page):
        path = tree / block.file
        if block.kind == "diff":
            path.write_text(changed(path.read_text(encoding="utf-8"), block.text), encoding="utf-8")
        elif block.file:
            assert not path.exists(), f"{page.stem}: {block.file} is there already"
            path.write_text(block.text, encoding="utf-8")
        elif block.kind == "sh":
            out = typed(block.text, tree, python, PYTHONPATH=str(tree))
        elif block.kind == "python":
            done = subprocess.run([python / "python", "-c", block.text], cwd=tree, capture_output=True, text=True,
                                  env={**os.environ, "PYTHONPATH": str(tree)})
            assert done.returncode == 0, f"{page.stem}: {done.stderr[-2000:]}"
        else:
            for line in filter(str.strip, block.text.splitlines()):
                assert any(alike(line, came) for came in out.splitlines()), f"{page.stem} shows {line!r}, but this came out:\n{out}"
    return out
