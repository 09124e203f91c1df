"""Decisions are numbered, dated records with context, decision and evidence; the index lists them all."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
RECORDS = sorted((DOCS / "decisions").glob("*.md"))
INDEX = (DOCS / "decisions.md").read_text(encoding="utf-8")
LONGEST = 2500  # characters: a longer record holds two decisions


def test_numbers_are_consecutive():
    assert [int(path.stem[:4]) for path in RECORDS] == list(range(1, len(RECORDS) + 1))


@pytest.mark.parametrize("path", RECORDS, ids=lambda path: path.stem)
def test_a_record_is_dated_and_complete(path):
    text = path.read_text(encoding="utf-8")
    heading = re.match(r"# (\d{4})\. (.+)\n\n\d{4}-\d\d-\d\d, (in force|replaced by \d{4})\.\n", text)
    assert heading, f"{path.name}: begin with '# NNNN. Title', a blank line, and 'YYYY-MM-DD, in force.'"
    assert "**Context.**" in text
    assert "**Decision.**" in text
    assert len(text) < LONGEST
    assert f"| {heading[1]} | [{heading[2]}](decisions/{path.name}) |" in INDEX
    assert f"\ndecisions/{path.stem}\n" in INDEX
    assert not re.search(r"\b(?=[0-9a-f]*[a-f])(?=[0-9a-f]*\d)[0-9a-f]{7,40}\b", text), f"{path.name}: no commit hashes in prose"
