"""The pages for contributors, done as they say: files written, lines changed and commands typed in a copy of the tree."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from fenced import blocks, changed, follow

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs" / "contributing").glob("*.md"))
# files of the package that a contribution costs at most; the page on statistics adds two
TOUCHED = {"effect": 1, "feature_set": 2, "baseline": 2, "reader": 2, "report_panel": 3, "statistic": 4}
TREE = ("nnhydro", "tests", "docs", "pyproject.toml")


def files_of(page):
    """The files of the package and of its pages that a page writes or changes."""
    return {block.file for block in blocks(page) if block.file.startswith(("nnhydro/", "docs/"))}


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of what a contributor has, with a Python that sees it before any other."""
    folder = tmp_path_factory.mktemp("tree")
    for name in TREE:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "_build", "web", "fuzz"))
        else:
            shutil.copy(ROOT / name, folder / name)
    return folder


@pytest.mark.slow(seconds=12)
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_newcomer_gets_there_with_the_page_alone(page, tree, quick_python):
    if page.stem != "index":
        follow(page, tree, quick_python)


@pytest.mark.parametrize("name", TOUCHED)
def test_a_contribution_touches_few_files(name):
    assert len(files_of(ROOT / "docs" / "contributing" / f"{name}.md")) <= TOUCHED[name]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_lines_that_a_page_changes_stand_in_the_code(page):
    texts = {}
    for block in blocks(page):
        if block.kind == "diff":
            text = texts.get(block.file) or (ROOT / block.file).read_text(encoding="utf-8")
            texts[block.file] = changed(text, block.text)
    assert {file for file in texts if not file.startswith("tests/")} <= files_of(page)
    assert all(text != (ROOT / file).read_text(encoding="utf-8") for file, text in texts.items()), "a change that changes nothing"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_files_that_a_page_writes_pass_the_linter(page):
    ruff = shutil.which("ruff", path=str(Path(sys.executable).parent))
    if ruff is None:
        pytest.skip("ruff is one of the extras for developers")
    for block in blocks(page):
        if block.file.startswith("nnhydro/") and block.kind == "python":
            done = subprocess.run([ruff, "check", "-q", "--stdin-filename", str(ROOT / block.file), "-"], input=block.text, cwd=ROOT,
                                  capture_output=True, text=True)
            assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(("text", "change", "after"), [
    ("a\nb\nc\n", " b\n+x", "a\nb\nx\nc\n"), ("a\nb\n", "-a\n+y", "y\nb\n"), ("a\n", "+x\n a", "x\na\n")])
def test_a_change_is_made_where_its_lines_stand(text, change, after):
    assert changed(text, change) == after


@pytest.mark.parametrize("change", [" gone\n+x", " a\n+x"])
def test_a_change_of_lines_that_are_gone_or_stand_twice_is_refused(change):
    with pytest.raises(AssertionError, match="exactly once"):
        changed("a\nb\na\n", change)
