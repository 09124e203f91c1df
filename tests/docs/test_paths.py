"""Files that docstrings, comments and pages name are there: what moves takes its mentions along."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NAMED = re.compile(r"(?<![\w./-])((?:\w+/)+\w+\.py)\b")
TEXTS = sorted({*(ROOT / "nnhydro").rglob("*.py"), ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md"),
                *(ROOT / "docs" / "guide").glob("*.md"), *(ROOT / "docs" / "decisions").glob("*.md"),
                *(ROOT / "training").rglob("README.md")})


def is_there(named, text):
    """Whether the file `named` lies beside the text, in a folder around it, or in the package."""
    around = [folder for folder in text.parents if folder.is_relative_to(ROOT)]
    return any((folder / named).exists() for folder in (*around, ROOT / "nnhydro", ROOT / "nnhydro" / "diagnosis", ROOT / "tests"))


@pytest.mark.parametrize("path", [path for path in TEXTS if NAMED.search(path.read_text(encoding="utf-8"))],
                         ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_that_a_text_names_is_there(path):
    found = {name for name in NAMED.findall(path.read_text(encoding="utf-8")) if not is_there(name, path)}
    assert found == set(), "the file was moved or renamed: name it as it is called now"


def test_a_file_that_was_moved_is_noticed():
    assert not is_there("physics/no_such_file.py", ROOT / "nnhydro" / "physics" / "flow.py")
    assert is_there("physics/flow.py", ROOT / "nnhydro" / "cli" / "main.py")


def test_the_control_study_shows_the_tables_of_its_results():
    """A row that is measured again changes on the page too."""
    study = ROOT / "training" / "control"
    for name in ("table.md", "effort.md"):
        assert (study / name).read_text(encoding="utf-8") in (study / "README.md").read_text(encoding="utf-8")
