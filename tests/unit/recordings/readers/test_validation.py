"""What pydantic complains about is told in plain words, at the place where it stands in the file."""

import re

import pytest
from rigs import arm

from nnhydro.errors import ConfigError, NnhydroError
from nnhydro.recordings.arm import parse_arm
from nnhydro.recordings.readers.validation import validate
from nnhydro.simulation.motions.motion_kind import motion_of
from nnhydro.simulation.recipe.recipe_file import RecipeFile

SLEW = {"kind": "slew", "name": "a", "q_rad": [[0.0, 0.0], [1.0, 1.0]], "duration_s": 1.0}


@pytest.mark.parametrize(("changes", "line"), [
    ({"duration_s": "long"}, "duration_s: must be a number, got 'long': correct it"),
    ({"duration_s": [1.0, "long"]}, "duration_s[1]: must be a number, got 'long': correct it"),
    ({"duration_s": -1.0}, "duration_s: must be greater than 0, got -1.0: correct it"),
    ({"q_rad": []}, "q_rad: must have at least 2 entries, not 0: correct it"), ({"q_rad": 3}, "q_rad: must be a list, got 3: write [3]"),
    ({"name": "a b"}, "name: becomes the name of a file: use letters, digits, _ . and -, a letter or digit first, got 'a b'"),
])
def test_a_value_that_may_be_one_thing_or_another_is_named_as_it_stands_in_the_file(changes, line):
    with pytest.raises(ConfigError, match=re.escape(f"recipe.yaml (slew): {line}") + "$"):
        motion_of(SLEW | changes, "recipe.yaml")


@pytest.mark.parametrize(("changes", "line"), [
    ({"arm": 3}, "arm: must be a mapping (key: value), got 3: correct it"),
    ({"unseen": "work"}, "unseen: must be a list, got 'work': write [work]"),
    ({"seed": 1.5}, "seed: must be a whole number, got 1.5: correct it"),
    ({"limits": {"dq_rad_s": "fast"}}, "limits.dq_rad_s: must be a number, got 'fast': correct it"),
    ({"limits": {"q_rad": [[1, 2, 3]]}}, "limits.q_rad[0]: must have at most 2 entries, not 3: correct it"),
])
def test_a_recipe_is_corrected_without_words_of_the_validator(changes, line):
    with pytest.raises(ConfigError, match="^" + re.escape(f"recipe.yaml: {line}") + "$"):
        validate(RecipeFile, {"arm": {}, "motions": [SLEW]} | changes, "recipe.yaml", ConfigError)


def changed(joints, **values):
    document = arm(joints).document()
    document["links"][0] |= values
    return document


@pytest.mark.parametrize(("values", "line"), [
    ({"mass_kg": None}, "links[0].mass_kg: must be a number, got nothing: correct it"),
    ({"diameter_m": 70}, "links[0].diameter_m: must be at most 10, got 70: probably in mm: write 0.07"),
    ({"known_to": 5}, "links[0].known_to: must be at most 1, got 5: probably in per cent: write 0.05"),
    ({"gear": {"torque_at": "motr"}}, "links[0].gear.torque_at: must be 'motor' or 'output', got 'motr': did you mean 'motor'?"),
])
def test_a_wrong_entry_is_one_complaint_and_its_likely_unit_is_named(values, line):
    with pytest.raises(NnhydroError, match="^" + re.escape(f"arm.yaml: {line}") + "$"):
        parse_arm(changed(2, **values), "arm.yaml")


@pytest.mark.parametrize(("ratio", "unit"), [(100, "cm"), (1000, "mm")])
def test_a_long_link_that_weighs_next_to_nothing_is_refused_with_the_unit_that_it_is_in(ratio, unit):
    length = {"cm": 0.6, "mm": 0.06}[unit]
    sizes = {"length_m": ratio * length, "diameter_m": ratio * 0.008, "com_m": ratio * 0.02, "mass_kg": 0.05}
    with pytest.raises(NnhydroError, match=f"probably in {unit}: write length_m: {length:g}, diameter_m: 0.008, com_m: 0.02$"):
        parse_arm(changed(2, **sizes), "arm.yaml")


@pytest.mark.parametrize("values", [{"mass_kg": 4000.0}, {"mass_kg": 0.0}])
def test_a_long_link_may_have_the_mass_of_one_or_none(values):
    assert parse_arm(changed(2, length_m=60, diameter_m=0.5, com_m=20, **values), "arm.yaml").L[0] == 60


@pytest.mark.parametrize(("joints", "key"), [(None, "coulomb_Nm"), ([{"type": "prismatic"}], "coulomb_N")])
def test_the_key_that_is_proposed_belongs_to_the_kind_of_joint(joints, key):
    document = arm(1).document() | {"friction": [{"coulomb": 0.1}]} | ({} if joints is None else {"joints": joints})
    with pytest.raises(NnhydroError, match=f"did you mean '{key}'"):
        parse_arm(document, "arm.yaml")
