"""The tutorial notebook: every cell runs, in order, and what is stored in it came from such a run."""

import ast
import json
from pathlib import Path

import matplotlib as mpl
import pytest

NOTEBOOK = Path(__file__).resolve().parents[2] / "docs" / "tutorial.ipynb"


def code_cells():
    return [cell for cell in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]


class Picture:
    """Stands for IPython.display.Image where no notebook runs."""

    def __init__(self, data):
        assert data[:4] == b"\x89PNG"


def shown(source, names):
    """Run a cell and return the value of its last line, where that is an expression: what a notebook would show."""
    tree = ast.parse(source.replace("from IPython.display import Image\n", ""))
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, str(NOTEBOOK), "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), str(NOTEBOOK), "eval"), names)


@pytest.mark.slow(seconds=40)
def test_every_cell_runs_and_shows_what_a_notebook_can_draw(monkeypatch):
    mpl.use("agg")
    names = {"__name__": "tutorial", "Image": Picture}
    for cell in code_cells():
        value = shown("".join(cell["source"]), names)
        kinds = {kind for output in cell["outputs"] for kind in output.get("data", {})}
        if "text/html" in kinds:
            assert "<table" in value._repr_html_()
        elif "image/png" in kinds:
            assert isinstance(value, Picture)
        elif kinds:
            assert repr(value)


def test_what_is_stored_came_from_a_run_without_an_error():
    cells = code_cells()
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert all(output["output_type"] in ("execute_result", "display_data") for output in outputs), "no errors, no warnings"
    assert sum("text/html" in output["data"] for output in outputs) >= 5
    assert str(NOTEBOOK.parents[1]) not in NOTEBOOK.read_text(encoding="utf-8"), "no path of a machine"
