"""docs/glossary.md: terms with references, and words that the package no longer uses."""

import ast
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import torch

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
SOURCES = sorted((ROOT / "nnhydro").rglob("*.py"))
PAGES = sorted(path for path in (*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", *(ROOT / "training").rglob("README.md"),
                                 *(ROOT / "datasets").rglob("*.md"))
               if path.name != "glossary.md" and not {"_build", "effects"} & set(path.parts))
TESTS = sorted(path for path in (ROOT / "tests").rglob("*.py") if path != Path(__file__).resolve())


@cache
def retired():
    """The words of the last table: those kept out of names, and those kept out of sentences too."""
    rows = [line.strip("| ").split(" | ")[0] for line in PAGE.partition("## Words not used")[2].splitlines() if line.startswith("| ")][2:]
    words = [word.strip() for row in rows for word in row.split(",")]
    return {word.strip("*") for word in words}, {word.strip("*") for word in words if word.startswith("**")}


def parts(name):
    """The words of an identifier: snake_case and CamelCase taken apart."""
    return re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower())


def names(tree):
    """Names that the code gives: classes, functions, arguments, fields, attributes, constants and variables."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.id if isinstance(node, ast.Name) else node.attr


def retired_in(name):
    """The retired words of a name; `held_out` is the term for data that no fit has seen."""
    return retired()[0] & set(parts(re.sub(r"(?<![a-z])held_out(?![a-z])", "", name)))


@cache
def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def sentences(tree):
    """Docstrings, messages and whatever else is text with a blank in it."""
    return [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value]


PAST = {"told", "held", "kept", "said", "found", "made", "shown", "drawn", "known", "seen", "given", "taken", "built", "sent", "left",
        "met", "chosen", "hidden", "stuck", "won", "lost", "bound", "fed", "paid", "heard", "borne", "split", "written", "grown", "worn"}
VERBS_AND_NOUNS = {"split", "speed", "need", "feed", "proceed", "exceed", "embed"}
PUBLIC = {"compiled"}  # of nnhydro.Model: scripts of users call it


def called(tree):
    """Functions, methods and classes by name; properties read as fields, and a field may be an adjective."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not any("property" in ast.unparse(mark) for mark in node.decorator_list):
            yield node.name


def bare_participle(name):
    """Whether the one word of a name is a past participle: it says neither what is done nor what is returned."""
    words = parts(name)
    return len(words) == 1 and (words[0].endswith("ed") or words[0] in PAST) and words[0] not in VERBS_AND_NOUNS


LOOPS = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp
OF_VALUES = set().union(*map(dir, (np.ndarray, torch.Tensor, str, dict, list, set, slice, float))) - {"name", "names", "t"}


def nameless(tree):
    """One-letter loop variables that stand for a thing: it has other attributes than numbers, arrays and texts have."""
    for loop in ast.walk(tree):
        parts_of = [loop] if isinstance(loop, ast.For) else loop.generators if isinstance(loop, LOOPS) else []
        targets = [part.target for part in parts_of]
        letters = {node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name) and len(node.id) == 1}
        for node in ast.walk(loop) if letters else ():
            of_letter = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in letters
            if of_letter and node.attr not in OF_VALUES:
                yield f"{node.value.id}.{node.attr} in line {loop.lineno}"


def offences(path):
    """What the words of a file offend against, a line each."""
    from_sentences, tree = retired()[1], parsed(path)
    yield from (f"{path.name}: the name {name}" for name in (path.stem, *names(tree)) if retired_in(name))
    yield from (f"{path.name}: {text[:60]!r}" for text in sentences(tree) if from_sentences & set(re.findall(r"[a-z]+", text.lower())))


@pytest.mark.slow
def test_a_loop_variable_names_the_thing():
    assert {path.name: found for path in SOURCES if (found := sorted(set(nameless(parsed(path)))))} == {}


@pytest.mark.parametrize(("text", "found"), [
    ("for r in recordings: print(r.duration)", ["r.duration in line 1"]), ("[k.mass for k in links]", ["k.mass in line 1"]),
    ("for recording in recordings: print(recording.duration)", []), ("[x.sum() / x.size for x in columns]", []),
    ("[i for i in range(3)]", [])])
def test_a_letter_may_stand_for_a_number_or_an_array(text, found):
    assert list(nameless(ast.parse(text))) == found


@pytest.mark.slow
def test_no_retired_word_stands_in_a_name_or_a_sentence():
    found = [line for path in SOURCES for line in offences(path)]
    assert found == [], "docs/glossary.md has the words to write instead"


def test_functions_and_classes_are_called_by_verbs_and_nouns():
    found = {parts(name)[0]: path.relative_to(ROOT) for path in SOURCES for name in called(parsed(path))
             if bare_participle(name)}
    new = {word: str(path) for word, path in found.items() if word not in PUBLIC}
    assert new == {}, "write a verb (prepare) or the noun returned (scores)"


@pytest.mark.parametrize(("name", "bare"), [("moved", True), ("_moved", True), ("Moved", True), ("held", True),
                                            ("moved_rows", False), ("move", False), ("split", False), ("speed", False)])
def test_a_bare_participle_is_recognised(name, bare):
    assert bare_participle(name) is bare


def test_a_class_name_stands_once_in_the_package():
    files = {}
    for path in SOURCES:
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef):
                files.setdefault(node.name, []).append(str(path.relative_to(ROOT)))
    twice = {name: found for name, found in files.items() if len(found) > 1}
    assert twice == {}


def test_no_retired_word_stands_in_a_page_or_a_test():
    for path in (*PAGES, *TESTS):
        text = path.read_text(encoding="utf-8").lower()
        found = retired()[1] & set(re.findall(r"[a-z]+", text))
        assert not found, f"{path.relative_to(ROOT)}: docs/glossary.md has the words to write instead"


def test_the_list_of_retired_words_is_read():
    from_names, from_sentences = retired()
    assert {"told", "kept", "foretold", "held", "own", "beside", "bank"} <= from_names
    assert "foretold" in from_sentences
    assert "told" not in from_sentences


def test_every_term_has_a_textbook_word_and_a_place_for_its_reference():
    before = PAGE.partition("## Words not used")[0]
    rows = [line.strip("| ").split(" | ") for line in before.splitlines() if line.startswith("| ") and "---" not in line]
    assert len(rows) > 50
    assert all(len(row) == 3 and all(row) for row in rows)
    terms = [row[0] for row in rows if row[0] != "here"]
    assert len(terms) == len(set(terms)), "a term stands once"


@pytest.mark.parametrize("name", ["told_once", "ToldOnce", "TOLD", "_told"])
def test_a_word_is_found_in_every_form_of_a_name(name):
    assert "told" in parts(name)


@pytest.mark.parametrize(("name", "words"), [("held_out", set()), ("held_out_error", set()), ("_held_out", set()), ("unknown", set()),
                                             ("held", {"held"}), ("held_outside", {"held"}), ("own_gains", {"own"}), ("BANK", {"bank"})])
def test_held_is_a_word_for_data_that_no_fit_has_seen_alone(name, words):
    assert retired_in(name) == words


def test_variables_and_attributes_are_names_too():
    tree = ast.parse("def f(a):\n    for b, c in a:\n        a.d = b\n    return [e for e in c]")
    assert {"f", "a", "b", "c", "d", "e"} <= set(names(tree))


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_commit_hash_stands_in_a_page(path):
    found = re.findall(r"(?<![\w.])(?=[0-9a-f]*[a-f])(?=[0-9a-f]*\d)[0-9a-f]{7,40}(?![\w.])", path.read_text(encoding="utf-8"))
    assert found == [], "a version says more than a commit, and stays true"
