"""Recorded machines of training/machines: the generator knows nothing of the package, and findings are judged by its cards."""

import ast
import importlib
import sys
from pathlib import Path

import pytest

from nnhydro.effects.catalogue import catalogue

HERE = Path(__file__).parents[2] / "training" / "machines"
PHYSICS = sorted(path for path in HERE.glob("*.py") if path.stem != "run")


@pytest.fixture
def study(monkeypatch):
    """A module of the study by name; tests have modules of these names, too."""
    names = [path.stem for path in HERE.glob("*.py")]
    for name in names:
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(HERE)
    yield importlib.import_module
    for name in names:
        sys.modules.pop(name, None)


def imports(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom):
            yield node.module


def test_the_generator_and_the_judge_import_nothing_of_the_package():
    assert len(PHYSICS) > 15
    assert [(path.name, name) for path in PHYSICS for name in imports(ast.parse(path.read_text())) if name.startswith("nnhydro")] == []


def test_a_machine_hides_what_the_catalogue_names_and_a_seed_gives_the_same_files_again(study, tmp_path):
    study("run")
    cards = study("cards")
    assert sorted(cards.MACHINES) == list(range(72))
    card = cards.write(8, 4100, tmp_path / "one")
    cards.write(8, 4100, tmp_path / "two")
    cards.write(8, 4101, tmp_path / "other")
    one, two, other = ((tmp_path / name / "steady" / "table.csv").read_bytes() for name in ("one", "two", "other"))
    assert one == two != other
    names = {name for a in card["answers"] for name in (a["effect"], *a["accept"])}
    assert {"viscous_friction", "coulomb_friction"} < names <= set(catalogue())


def finding(effect, joint=1, value=0.2, ci95=(0.1, 0.3)):
    return {"effect": effect, "joint": joint, "class": [effect], "parameters": {"level": {"value": value, "unit": "N m", "ci95": ci95}}}


@pytest.mark.parametrize(("said", "verdict"), [
    ([("coulomb_friction", 1), ("backlash", 2)], "right"),
    ([("coulomb_friction", 1)], "half"),
    ([("coulomb_friction", 1), ("joint_elasticity", 2)], "half"),
    ([("coulomb_friction", 2)], "wrong"),
    ([("coulomb_friction", 1), ("backlash", 2), ("viscous_friction", 1)], "wrong"),
    ([("stribeck_friction", 1)], "alarm"),
    ([], "alarm")])
def test_a_machine_with_two_hidden_effects_is_judged_by_what_is_named_at_which_joint(study, said, verdict):
    cards, judge = study("cards"), study("judge")
    answers = [cards.hidden("coulomb_friction", 1), cards.hidden("backlash", 2, partial=["joint_elasticity"])]
    card = cards.card(answers, tolerated=["stribeck_friction"])
    document = {"mismatch": {"detected": True}, "findings": [finding(*each) for each in said]}
    assert judge.verdict(card, document) == verdict


@pytest.mark.parametrize(("said", "detected", "healthy", "nameless"), [
    ([], False, "healthy-ok", "silent"), ([], True, "healthy-detected", "right"), ([finding("backlash")], True, "healthy-named", "wrong")])
def test_silence_is_right_on_a_healthy_machine_and_an_alarm_where_no_name_fits(study, said, detected, healthy, nameless):
    cards, judge = study("cards"), study("judge")
    document = {"mismatch": {"detected": detected}, "findings": said}
    assert judge.verdict(cards.card(), document) == healthy
    assert judge.verdict(cards.card(nameless=True), document) == nameless


def test_a_value_is_held_against_the_truth_of_its_unit(study):
    cards, judge = study("cards"), study("judge")
    card = cards.card([cards.hidden("coulomb_friction", 1, damping=(0.5, "N m s/rad"), coulomb=(0.35, "N m"))])
    (value,) = judge.judged(card, {"findings": [finding("coulomb_friction")]})["values"]
    assert (value["truth"], value["value"], value["holds"]) == (0.35, 0.2, False)
