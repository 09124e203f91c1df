"""The manual is built by its own tools, with a page an effect."""

import shutil
import subprocess
import sys
from base64 import b64decode
from pathlib import Path

import pytest

import nnhydro

PIXEL = b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR42mNk+A8AAQUBAScY42YAAAAASUVORK5CYII=")  # a PNG of one pixel
DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.slow(seconds=30)
def test_the_manual_is_built_without_a_warning(tmp_path):
    pytest.importorskip("furo", reason="the manual's tools are not installed: pip install 'nnhydro[docs]'")
    source = tmp_path / "docs"  # a copy: a build makes a page per effect beside the sources
    shutil.copytree(DOCS, source, ignore=shutil.ignore_patterns("effects", "_build"))
    (source / "effects").mkdir()
    drawn, *others = nnhydro.catalogue()
    for name in others:  # one picture is drawn by the build, which takes what is there: test_effect_figure.py shows that each can be drawn
        (source / "effects" / f"{name}.png").write_bytes(PIXEL)
    done = subprocess.run([sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", str(source), str(tmp_path / "out")],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-4000:]
    assert (tmp_path / "out" / "_images" / f"{drawn}.png").stat().st_size > 10_000
    effects = {path.stem for path in (tmp_path / "out" / "effects").glob("*.html")} - {"index"}
    assert effects == set(nnhydro.catalogue())
