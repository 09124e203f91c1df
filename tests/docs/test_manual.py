"""The manual is built by its own tools, with a page an effect."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import nnhydro

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.slow(seconds=30)
def test_the_manual_is_built_without_a_warning(tmp_path):
    pytest.importorskip("furo", reason="the manual's tools are not installed: pip install 'nnhydro[docs]'")
    source = tmp_path / "docs"  # a copy: a build makes a page per effect beside the sources
    shutil.copytree(DOCS, source, ignore=shutil.ignore_patterns("effects", "_build"))
    done = subprocess.run([sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", str(source), str(tmp_path / "out")],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-4000:]
    effects = {path.stem for path in (tmp_path / "out" / "effects").glob("*.html")} - {"index"}
    assert effects == set(nnhydro.catalogue())
