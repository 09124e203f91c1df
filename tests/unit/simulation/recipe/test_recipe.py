"""A recipe is understood or refused in one line."""

import copy
import warnings
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tank_recipes import BASE

from nnhydro.errors import NnhydroError
from nnhydro.recordings.campaign import open_campaign
from nnhydro.simulation.campaign_writer import write_campaign
from nnhydro.simulation.recipe.recipe import parse_recipe, read_recipe


def _without(key: str) -> dict[str, Any]:
    return {k: v for k, v in BASE.items() if k != key}


@pytest.mark.parametrize(("document", "message"), [
    ({**BASE, "sead": 1}, "recipe: unknown key 'sead': did you mean 'seed'"),
    (_without("arm"), "key 'arm' is missing"),
    ({**BASE, "terms": {"normal_drg": {"C_D": 1}}}, "terms.normal_drg: 'normal_drg' is not a load term: did you mean 'normal_drag'"),
    ({**BASE, "terms": {"normal_drag": {"C_D": [1, 2, 3]}}}, r"terms.normal_drag.C_D: 3 number\(s\) for this arm: give 2"),
    ({**BASE, "terms": {"normal_drag": {"C_D": float("nan")}}}, "terms.normal_drag.C_D: nan is not a finite number"),
    ({**BASE, "terms": {"normal_drag": {"C_D": -1}}}, "outside what physics allows"),
    ({**BASE, "terms": {"normal_drag": {}}}, "C_D is missing: cross-flow drag coefficient"),
    ({**BASE, "terms": {"normal_drag": {"C_D": 1, "cd": 2}}}, "unknown key 'cd' of normal_drag: did you mean 'C_D'"),
    ({**BASE, "terms": {"added_mass": {"C_M": 1, "reading": "odd"}}}, "terms.added_mass: .*'odd' is not one of document"),
    ({**BASE, "limits": {"q_rad": [[-1, 0.8], [-2, 2]]}}, "motion 'reach': q1_rad = .* at t = .* is outside the limits -1 to 0.8"),
    ({**BASE, "limits": {"u0_m_s": 0.2}}, "motion 'swim': u0_m_s = 0.3"),
    ({**BASE, "motions": [BASE["motions"][0]] * 2, "unseen": []}, "two motions are called 'reach'"),
    ({**BASE, "unseen": ["nobody"]}, "unseen: 'nobody' is not a motion"),
    ({**BASE, "controller": "pid"}, "controller: must be 'none' or a mapping"),
    ({**BASE, "controller": {"kind": "pd", "kp": [1, 2, 3], "kd": 1}}, "controller.kp: 3 numbers for an arm of 2"),
    ({**BASE, "controller": {"kind": "pd", "kp": 1, "kd": 1, "rate_hz": 333}}, "rate_hz must divide"),
    ({**BASE, "sensors": {"jitter_s": 0.005}}, "sensors.jitter_s: .* more than a tenth of a sample"),
    ({**BASE, "sensors": {"torque_low_pass_hz": 600}}, "torque_low_pass_hz: must be below"),
    ({**BASE, "sensors": {"torque_noise_Nm": [1, 2, 3]}}, "sensors.torque_noise_Nm: 3 numbers"),
    ({**BASE, "seed": -1}, "seed"),
    ({**BASE, "arm": "nowhere.yaml"}, "nowhere.yaml: cannot be read"),
    ({**BASE, "sample_rate_hz": 10000, "motions": [{**BASE["motions"][3], "hold_s": 3600}]}, "too many steps"),
])
def test_a_recipe_that_cannot_be_is_refused_in_one_line(document: dict[str, Any], message: str) -> None:
    with pytest.raises(NnhydroError, match=message) as caught:
        parse_recipe(copy.deepcopy(document), "recipe", Path())
    assert "\n" not in str(caught.value)


SCALAR = st.one_of(st.none(), st.booleans(), st.integers(-10**400, 10**400), st.floats(), st.text(max_size=5), st.sampled_from(
    ["start", "arm", "none", "pd", "slew", "tow", "fourier", "file", "steady", "rotation"]))
ANYTHING = st.recursive(
    SCALAR, lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=5), inner, max_size=3)), max_leaves=6)


def _paths(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [path, *(p for key, value in items for p in _paths(value, (*path, key)))]


def _verdict(document: dict[str, Any]) -> str:
    """Empty where the recipe is understood; anything but a NnhydroError passes through."""
    try:
        parse_recipe(document, "recipe", Path("/nonexistent"))
    except NnhydroError as error:
        return str(error)
    return ""


@pytest.mark.slow
@given(st.sampled_from(_paths(BASE)[1:]), ANYTHING, st.text(max_size=6))
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_whatever_stands_in_a_recipe_it_is_understood_or_refused_in_one_line(path: tuple[Any, ...], value: Any, extra: str) -> None:
    document = copy.deepcopy(BASE)
    node: Any = document
    for key in path[:-1]:
        node = node[key]
    if isinstance(node, dict) and len(extra) == 3:
        node[extra] = value
    else:
        node[path[-1]] = value
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "\n" not in _verdict(document)


def test_the_recipe_of_the_manual_works_as_it_stands(tmp_path: Path) -> None:
    path = Path(__file__).parents[4] / "docs/examples/two_link_tank.yaml"
    made = write_campaign(read_recipe(path), tmp_path / "tank")
    assert len(made) == 8
    assert yaml.safe_load((tmp_path / "tank/recipe.yaml").read_text())["seed"] == 1
    assert len(open_campaign(tmp_path / "tank").names) == 6
