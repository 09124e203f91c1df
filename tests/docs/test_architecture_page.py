"""docs/architecture.md says what the code is: its tables and its picture are those made from the imports."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest
from campaigns import campaign, planted, write_folder
from rigs import arm

from nnhydro.cli.main import run
from nnhydro.diagnosis.decision import decide
from nnhydro.physics.loads.viscous_friction import ViscousTerm

ROOT = Path(__file__).resolve().parents[2]
SPEC = importlib.util.spec_from_file_location("architecture_tables", ROOT / "docs" / "_ext" / "architecture_tables.py")
made = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(made)
AGAIN = "run: python docs/_ext/architecture_tables.py"


def test_the_tables_are_those_of_the_imports():
    assert made.page() == made.PAGE.read_text(encoding="utf-8"), AGAIN


def test_the_picture_is_that_of_the_imports():
    assert made.picture() == made.PICTURE.read_text(encoding="utf-8"), AGAIN


@pytest.mark.parametrize("folder", sorted({path.parent for path in made.PACKAGE.rglob("*.py")}), ids=lambda path: path.name)
def test_every_folder_says_what_is_inside(folder):
    assert made.holds(folder), f"{folder / '__init__.py'} has no docstring: one sentence on what the folder holds"


def test_floors_are_the_longest_chains():
    assert made.floors({"a": (), "b": ("a",), "c": ("a", "b")}) == {"a": 0, "b": 1, "c": 2}
    with pytest.raises(AssertionError, match="circle: a > b > a"):
        made.floors({"a": ("b",), "b": ("a",)})


def test_every_dot_of_the_picture_lies_below_the_diagonal():
    graph = made.depends(made.PACKAGE, "nnhydro")
    level = made.floors(graph)
    assert all(level[other] < level[name] for name, others in graph.items() for other in others)
    assert made.picture().count("<circle") == sum(len([o for o in others if o != "demo"]) for others in graph.values())


def test_folders_and_files_that_the_page_names_are_there():
    named = set(re.findall(r"`([\w*]+(?:/[\w*.]+)+)`", made.PAGE.read_text(encoding="utf-8")))
    assert len(named) > 8
    assert [name for name in sorted(named) if not any(list(place.glob(name)) for place in (ROOT, made.PACKAGE))] == []


class ReachedError(Exception):
    """The line that decides was reached."""


@pytest.mark.slow
def test_the_functions_between_the_command_and_the_line_that_decides_are_those_of_the_page(tmp_path, monkeypatch):
    called = []

    def judge(*_):
        frame = sys._getframe(1)
        while frame is not None and frame.f_code.co_name != "run_alone":
            if not frame.f_code.co_name.startswith("<") and str(made.PACKAGE) in frame.f_code.co_filename:
                called.insert(0, (frame.f_code.co_name, str(Path(frame.f_code.co_filename).relative_to(made.PACKAGE))))
            frame = frame.f_back
        raise ReachedError

    monkeypatch.setattr(decide, "_judge", judge)
    one = arm(1)
    whole = campaign(one, planted(one).plus("viscous_friction", ViscousTerm((0.5,))), count=4, noise=0.01)
    with pytest.raises(ReachedError):
        run(["diagnose", str(write_folder(whole, tmp_path / "campaign")), "--out", str(tmp_path / "out"), "--quiet"])
    listed = re.findall(r"^\d\. `(?:\w+\.)?(\w+)` (?:in `([\w/.]+)`|in the same file)", made.PAGE.read_text(encoding="utf-8"), re.M)
    assert [name for name, _ in called] == [name for name, _ in listed][:-1]
    assert [file for _, file in called] == [file for _, file in listed][:-1]
    assert listed[-1][0] == "_judge"
    assert len(listed) <= 5
