"""A file of a folder is the whole registration of what it declares; whoever asks for a name that nobody declared is told the names."""

import sys

import pytest

from nnhydro.errors import ConfigError
from nnhydro.runtime.registry import Registry, choices, import_files, nearest

PACKAGE = "nnhydro_registry_of_a_test"


@pytest.fixture
def registry(tmp_path, monkeypatch):
    inner = tmp_path / PACKAGE / "inner"
    inner.mkdir(parents=True)
    (inner.parent / "__init__.py").write_text(f"from nnhydro.runtime.registry import Registry\nREGISTRY = Registry({PACKAGE!r})\n")
    (inner / "__init__.py").write_text("")
    for path, name in ((inner.parent / "later.py", "b"), (inner / "first.py", "a")):
        path.write_text(f"from {PACKAGE} import REGISTRY\nREGISTRY.enter({name!r}, {name.upper()!r})\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield __import__(PACKAGE).REGISTRY
    for module in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[module]
    import_files.cache_clear()


def test_members_are_found_in_every_file_and_come_in_the_order_of_names(registry):
    assert registry.members() == {"a": "A", "b": "B"}
    assert list(registry.members()) == ["a", "b"]


def test_what_is_declared_later_is_a_member_too(registry):
    assert "c" not in registry.members()
    registry.enter("c", "C")
    assert registry.members()["c"] == "C"


def test_members_are_chosen_in_the_order_asked_for(registry):
    assert registry.choose(["b", "a", "b"], "letter") == ["B", "A", "B"]
    assert registry.choose([], "letter") == []


def test_an_unknown_name_is_refused_with_the_known_ones(registry):
    with pytest.raises(ConfigError, match="unknown letter 'z': choose one of a, b"):
        registry.choose(["a", "z"], "letter")


def test_an_unknown_name_is_refused_with_the_nearest_one(registry):
    registry.enter("morison", "M")
    with pytest.raises(ConfigError, match=r"unknown letter 'morisson': did you mean 'morison'\?"):
        registry.choose(["morisson"], "letter")


@pytest.mark.parametrize(("name", "near"), [
    ("coulomb", ["coulomb_friction"]), ("coulom_friction", ["coulomb_friction"]), ("Added-Mass", ["added_mass"]), ("work", ["work"]),
    ("friction", ["coulomb_friction", "viscous_friction"]), ("something else", []), ("", [])])
def test_the_nearest_name_is_near_in_spelling_or_has_the_name_for_a_word(name, near):
    assert nearest(name, ["coulomb_friction", "viscous_friction", "added_mass", "work"]) == near


def test_a_long_list_of_names_is_told_only_where_none_is_near():
    many = [f"motion{k}" for k in range(200)]
    assert choices("motion7x", many).startswith("did you mean 'motion7'?")
    assert choices("reach", many).startswith("choose one of motion0, ")
    assert choices("reach", many).endswith(", ...")


def test_registries_of_one_folder_are_apart():
    one, other = Registry("nnhydro.runtime"), Registry("nnhydro.runtime")
    one.enter("a", 1)
    assert (one.members(), other.members()) == ({"a": 1}, {})
