"""The tables of constants in docs/diagnosis.md: `python docs/_ext/constants_table.py` makes them from the code.

The first table has the constants of nnhydro/diagnosis/constants.py, the second the numbers that single modules of the package hold.
"""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE, PAGE = ROOT / "nnhydro" / "diagnosis", ROOT / "docs" / "diagnosis.md"
SOURCE = PACKAGE / "constants.py"
BEGIN, END = "<!-- constants -->\n", "<!-- end of constants -->"
BEGIN_MODULES, END_MODULES = "<!-- constants of modules -->\n", "<!-- end of constants of modules -->"
Row = tuple[str, str, str]


def _is_number(node: ast.expr) -> bool:
    """Return whether an expression is one number or several, or made from named ones."""
    parts = list(ast.walk(node))
    values = [part.value for part in parts if isinstance(part, ast.Constant)]
    plain = not any(isinstance(part, ast.Call | ast.Subscript) for part in parts)
    return bool(values) and plain and all(isinstance(value, int | float) for value in values)


def constants(path: Path = SOURCE) -> list[Row]:
    """Return name, value and meaning of every number of a module, in the order of the file."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    found = []
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign) and _is_number(node.value):
            name, value = (ast.get_source_segment(text, part) or "" for part in (node.targets[0], node.value))
            if name.isupper():
                found.append((name, value, lines[node.lineno - 1].partition("#")[2].strip()))
    return found


def constants_of_modules() -> list[tuple[str, Row]]:
    """Return the constants of all other modules of the package, each with its module."""
    paths = sorted(path for path in PACKAGE.rglob("*.py") if path != SOURCE)
    return [(path.relative_to(PACKAGE).with_suffix("").as_posix(), row) for path in paths for row in constants(path)]


def table() -> str:
    """Return the first table in Markdown."""
    rows = [f"| `{name}` | {value} | {reason} |" for name, value, reason in constants()]
    return "\n".join(["| constant | value | meaning and reason |", "| --- | --- | --- |", *rows]) + "\n"


def table_of_modules() -> str:
    """Return the second table in Markdown."""
    rows = [f"| {module} | `{name}` | {value} | {meaning} |" for module, (name, value, meaning) in constants_of_modules()]
    return "\n".join(["| module | constant | value | meaning |", "| --- | --- | --- | --- |", *rows]) + "\n"


def page() -> str:
    """Return the page with the tables as they should be."""
    text = PAGE.read_text(encoding="utf-8")
    for begin, made, end in ((BEGIN, table(), END), (BEGIN_MODULES, table_of_modules(), END_MODULES)):
        before, _, rest = text.partition(begin)
        text = before + begin + made + end + rest.partition(end)[2]
    return text


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
