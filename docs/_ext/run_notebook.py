"""Run docs/tutorial.ipynb and store what its cells show, without Jupyter: `python docs/_ext/run_notebook.py`."""

import ast
import base64
import json
from pathlib import Path
from pprint import pformat
from typing import Any

NOTEBOOK = Path(__file__).resolve().parents[1] / "tutorial.ipynb"


class Image:
    """Stands for IPython.display.Image: PNG bytes."""

    def __init__(self, data: bytes) -> None:
        self.data = data


def lines(text: str) -> list[str]:
    """Return `text` as notebooks store it."""
    return text.splitlines(keepends=True)


def shown(source: str, names: dict[str, Any]) -> Any:
    """Run a cell and return the value of its last line, where that is an expression."""
    tree = ast.parse(source.replace("from IPython.display import Image\n", ""))
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, str(NOTEBOOK), "exec"), names)
    return None if not isinstance(last, ast.Expr) else eval(compile(ast.Expression(last.value), str(NOTEBOOK), "eval"), names)


def output(value: Any, number: int) -> list[dict[str, Any]]:
    """Return the stored outputs of a cell that shows `value`."""
    if value is None:
        return []
    if isinstance(value, Image):
        data: dict[str, Any] = {"image/png": base64.b64encode(value.data).decode(), "text/plain": ["<IPython.core.display.Image object>"]}
    else:
        html = value._repr_html_() if hasattr(value, "_repr_html_") else None
        data = ({"text/html": lines(html)} if html else {}) | {"text/plain": lines(pformat(value))}
    return [{"data": data, "execution_count": number, "metadata": {}, "output_type": "execute_result"}]


def main() -> None:
    """Run all cells in order and write the notebook."""
    import matplotlib as mpl

    mpl.use("agg")
    document, names = json.loads(NOTEBOOK.read_text(encoding="utf-8")), {"__name__": "tutorial", "Image": Image}
    for number, cell in enumerate((c for c in document["cells"] if c["cell_type"] == "code"), 1):
        cell["outputs"], cell["execution_count"] = output(shown("".join(cell["source"]), names), number), number
        print(f"cell {number}", flush=True)
    NOTEBOOK.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
