"""docs/common_issues.md quotes messages as the code has them."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "common_issues.md").read_text(encoding="utf-8")
ROWS = [line.strip("| ").split(" | ") for line in PAGE.splitlines() if line.startswith("| ") and "---" not in line]
QUOTED = sorted({quote for row in ROWS for quote in re.findall(r"`([^`]+)`", row[0]) if " " in quote})


def texts():
    """Every text in the package, with {} for what is filled in."""
    for path in sorted((ROOT / "nnhydro").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value
            if isinstance(node, ast.JoinedStr):
                yield "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)


@pytest.fixture(scope="module")
def messages():
    """All texts of the package as one."""
    return "\n".join(texts())


@pytest.mark.parametrize("quote", QUOTED)
def test_a_quoted_message_is_one_of_the_code(quote, messages):
    assert quote in messages


def test_every_row_has_a_symptom_a_cause_and_a_cure():
    assert len(ROWS) > 30
    assert all(len(row) == 3 and all(row) for row in ROWS)
