"""docs/diagnosis.md says what the code does: its constants, their number and reasons, the sources and files that it names."""

import importlib.util
import re
from pathlib import Path

import nnhydro.diagnosis.constants as constants

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8")


def made():
    spec = importlib.util.spec_from_file_location("constants_table", ROOT / "docs" / "_ext" / "constants_table.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_table_of_constants_is_that_of_the_code():
    assert made().page() == PAGE, "run: python docs/_ext/constants_table.py"


def test_constants_are_few_and_each_has_its_reason():
    found = made().constants()
    assert len(found) <= 20
    assert {name for name, *_ in found} == {name for name in vars(constants) if name.isupper()}
    for name, value, reason in found:
        assert len(reason) > 20, f"{name} = {value} has no reason"


def test_every_number_of_a_module_has_its_meaning():
    found = made().constants_of_modules()
    assert len(found) > 50
    assert not [f"{module} {name}" for module, (name, _, meaning) in found if len(meaning.split()) < 3]


def test_constants_that_the_text_names_are_there():
    named = set(re.findall(r"`([A-Z][A-Z_]{2,})`", PAGE.partition("## Constants")[0]))
    assert named
    assert named <= {name for name in vars(constants) if name.isupper()}


def test_files_that_the_text_names_are_there():
    paths = re.findall(r"`(nnhydro/[\w/]+\.py)`", PAGE)
    assert paths
    assert not [path for path in paths if not (ROOT / path).is_file()]


def test_the_page_has_two_pages_of_method_at_most():
    assert len(PAGE.partition("## Constants")[0].split()) < 1100
