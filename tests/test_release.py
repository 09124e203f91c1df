"""What a release is: a version from the git tag, a wheel and a source archive that install clean, a citation that agrees with them."""

import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import pytest
import yaml

import nnhydro

ROOT = Path(__file__).resolve().parent.parent
FILES = ("pyproject.toml", "MANIFEST.in", "README.md", "LICENSE", "CITATION.cff")
GIT = ("git", "-c", "user.name=t", "-c", "user.email=t@example.invalid", "-c", "commit.gpgsign=false", "-c", "tag.gpgsign=false")


def call(*command, cwd):
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """The package in a git repository of its own, one commit, no tag."""
    source = tmp_path_factory.mktemp("release") / "nnhydro"
    shutil.copytree(ROOT / "nnhydro", source / "nnhydro", ignore=shutil.ignore_patterns("__pycache__"))
    (source / "datasets").mkdir()
    (source / "datasets" / "large.csv").write_text("0\n")
    for file in FILES:
        shutil.copy(ROOT / file, source / file)
    call(*GIT, "init", "-q", cwd=source)
    call(*GIT, "add", "-A", cwd=source)
    call(*GIT, "commit", "-q", "-m", "all", cwd=source)
    return source


def built(source, out, *kinds):
    """Build and return the files."""
    call(sys.executable, "-m", "build", "--no-isolation", *kinds, "--outdir", str(out), cwd=source)
    return sorted(out.iterdir())


def version_of(source, out):
    """The version that a wheel of `source` would have: its metadata alone."""
    out.mkdir()
    program = "import sys; from setuptools import build_meta; build_meta.prepare_metadata_for_build_wheel(sys.argv[1])"
    call(sys.executable, "-c", program, str(out), cwd=source)
    return next(out.glob("*.dist-info")).name.removeprefix("nnhydro-").removesuffix(".dist-info")


@pytest.mark.slow
def test_without_a_tag_there_is_still_a_version(tree, tmp_path):
    assert re.match(r"0\.\d+\.?\d*\.?dev\d+\+g[0-9a-f]+", version_of(tree, tmp_path / "out"))


@pytest.mark.slow
def test_a_tag_is_the_version_of_wheel_and_source_archive_and_of_what_is_built_from_that(tree, tmp_path):
    call(*GIT, "tag", "v7.8.9", cwd=tree)
    try:
        archive, wheel = built(tree, tmp_path / "first", "--wheel", "--sdist")[::-1]
    finally:
        call(*GIT, "tag", "-d", "v7.8.9", cwd=tree)
    assert (archive.name, wheel.name) == ("nnhydro-7.8.9.tar.gz", "nnhydro-7.8.9-py3-none-any.whl")
    with tarfile.open(archive) as packed:
        names = packed.getnames()
        packed.extractall(tmp_path / "unpacked", filter="data")
    assert not any("datasets" in name for name in names), "data sets do not belong into the source archive"
    assert any(name.endswith("CITATION.cff") for name in names)
    (again,) = built(tmp_path / "unpacked" / "nnhydro-7.8.9", tmp_path / "second", "--wheel")  # no git there
    assert again.name == wheel.name
    pip = (sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-index")
    call(*pip, "--target", str(tmp_path / "site"), str(again), cwd=tmp_path)
    said = call(sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path / 'site')!r}); import nnhydro; "
                "from nnhydro.cli.main import run; run(['--version']); print(nnhydro.__file__)", cwd=tmp_path)
    assert said.splitlines()[0] == "7.8.9"
    assert str(tmp_path) in said.splitlines()[1]


@pytest.mark.slow
def test_a_tree_without_git_has_the_fallback_version(tree, tmp_path):
    bare = tmp_path / "bare"
    shutil.copytree(tree, bare, ignore=shutil.ignore_patterns(".git", "*.egg-info", "build"))
    fallback = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools_scm"]["fallback_version"]
    assert version_of(bare, tmp_path / "out") == fallback


def test_the_version_is_known_and_looks_like_one():
    assert re.match(r"\d+\.\d+", nnhydro.__version__)


def test_the_citation_agrees_with_the_package():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert citation["cff-version"] == "1.2.0"
    assert citation["license"] == project["license"]
    assert [author["name"] for author in citation["authors"]] == [author["name"] for author in project["authors"]]
    assert citation["title"].startswith("nnhydro")
    assert {"message", "abstract", "type"} <= set(citation)
    assert [work["year"] for work in citation["references"]] == [1995, 1998]
