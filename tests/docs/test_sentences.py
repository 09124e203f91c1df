"""Sentences for users are short: the manual, decisions, studies, cards of data sets, messages, and what `nnhydro --help` says."""

import ast
import re
from pathlib import Path

import pytest

from nnhydro.cli.main import run

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted({ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs").glob("guide/*.md"),
                *(ROOT / "docs").glob("contributing/*.md"), *(ROOT / "docs").glob("decisions/*.md"), *(ROOT / "datasets").rglob("*.md"),
                *(ROOT / "nnhydro").rglob("*.md"), *(ROOT / "training").rglob("README.md")})
MOST = 25  # words, between full stops, colons and semicolons


def sentences(text):
    """The sentences of a page, without code, formulas and tables; a link counts as its words, code as one word."""
    text = re.sub(r"```.*?```|\$\$.*?\$\$", "\n\n", text, flags=re.DOTALL)
    for part in re.split(r"\n\s*\n|\n(?=\s*[-*] |\s*\d+\. |#|\||<!--)", text):
        if not part.lstrip().startswith("|"):
            plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`[^`]*`|\$[^$]*\$", "code", " ".join(part.split())))
            yield from re.split(r"(?<=[.!?:;])\s+|(?<=[.!?]\))\s+", plain)


def cells(text):
    """The sentences in the cells of the tables of a page."""
    rows = [line for line in re.sub(r"```.*?```", "", text, flags=re.DOTALL).splitlines() if line.startswith("| ")]
    return [sentence for row in rows for cell in re.split(r"(?<!\\)\|", row.strip("| ")) for sentence in sentences(cell)]


def words(sentence):
    return sum(bool(re.search(r"\w", word)) for word in sentence.split())


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_sentence_has_25_words_at_most(path):
    text = path.read_text(encoding="utf-8")
    assert [s for s in (*sentences(text), *cells(text)) if words(s) > MOST] == []


def messages(path):
    """What a module may say to its user, docstrings and equations apart; a value counts as one word."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    described = [node for node in ast.walk(tree) if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)]
    docstrings = {id(node.body[0].value) for node in described if node.body and isinstance(node.body[0], ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield node.value
        if isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "value" for part in node.values)


@pytest.mark.slow
def test_a_message_has_25_words_a_sentence_at_most():
    found = [s for path in sorted((ROOT / "nnhydro").rglob("*.py")) for text in messages(path) if "= " not in text and "->" not in text
             for s in sentences(text) if words(s) > MOST]
    assert found == []


def test_sentences_are_counted():
    text = "One two\nthree. [Four five](six.md), `seven eight`!\n\n| a | table |\n- A, b\n- c: d"
    assert [words(sentence) for sentence in sentences(text)] == [3, 3, 2, 1, 1]
    assert [words(cell) for cell in cells(text)] == [1, 1]


def test_every_command_is_summed_up_in_a_line(capsys):
    assert run(["--help"]) == 0
    commands = capsys.readouterr().out.partition("Commands:")[2]
    assert len(commands.splitlines()) > 15
    assert "..." not in commands, "the first sentence of a command's docstring is its line here: shorten it"
