"""The table of constants in docs/diagnosis.md, made from nnhydro/diagnosis/constants.py: `python docs/_ext/constants_table.py`."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE, PAGE = ROOT / "nnhydro" / "diagnosis" / "constants.py", ROOT / "docs" / "diagnosis.md"
BEGIN, END = "<!-- constants -->\n", "<!-- end of constants -->"


def constants() -> list[tuple[str, str, str]]:
    """Return name, value and reason of every constant, in the order of the file."""
    text = SOURCE.read_text(encoding="utf-8")
    lines = text.splitlines()
    found = []
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            value = ast.get_source_segment(text, node.value) or ""
            found.append((node.targets[0].id, value, lines[node.lineno - 1].partition("#")[2].strip()))
    return found


def table() -> str:
    """Return the rows in Markdown."""
    rows = [f"| `{name}` | {value} | {reason} |" for name, value, reason in constants()]
    return "\n".join(["| constant | value | meaning and reason |", "| --- | --- | --- |", *rows]) + "\n"


def page() -> str:
    """Return the page with the table as it should be."""
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + table() + END + rest.partition(END)[2]


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
