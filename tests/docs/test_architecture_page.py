"""docs/architecture.md says what the code is: its tables and its picture are those made from the imports."""

import importlib.util
import re
from pathlib import Path

import pytest

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
