"""A planted effect is named, a healthy arm is left alone; the truth is computed by code that shares nothing with the catalogue."""

import json
from functools import cache
from pathlib import Path

import pytest

from nnhydro.cli.main import run
from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.recordings.campaign import Campaign, open_campaign

pytestmark = pytest.mark.slow(seconds=10)


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """The diagnosis of a concealed campaign, made once, and its folder."""
    @cache
    def of(effect, seed, links):
        place = tmp_path_factory.mktemp(effect)
        wish = ["--effect", effect, "--links", str(links), "--size", "small", "--seed", str(seed)]
        assert run(["conceal", "--out", str(place / "suite"), *wish]) == 0
        assert run(["diagnose", str(place / "suite" / "campaign_000"), "--out", str(place / "out")]) == 0
        return json.loads((place / "out" / "diagnosis.json").read_text()), place / "out"

    return of


SPRING = ("umbilical_stiffness", 3, 2)


@pytest.mark.usefixtures("no_rivals")
@pytest.mark.parametrize(("effect", "seed", "links"), [SPRING, ("torque_bias", 4, 1), ("rotor_inertia", 5, 1)])
def test_a_planted_effect_is_named_and_the_corrected_model_predicts_better(diagnosed, effect, seed, links):
    told, out = diagnosed(effect, seed, links)
    assert told["mismatch"]["detected"]
    assert effect in {name for f in told["findings"] for name in f["class"]}
    assert told["findings"][0]["heldout"]["error_after"] < told["mismatch"]["error"]
    assert {path.stem for path in out.glob("*.svg")} == {"torque_history", "residual_map", "laws"}


def test_a_healthy_arm_is_left_alone(diagnosed):
    told, _ = diagnosed("none", 6, 2)
    assert told["findings"] == []
    assert not told["mismatch"]["detected"]


@pytest.mark.usefixtures("no_rivals")
def test_what_the_unknown_held_is_gone_with_the_finding(diagnosed):
    told = diagnosed(*SPRING)[0]["proof"]
    assert told["explained"] > 0.9
    assert told["unknown_nats"]["after"] < 0.1 * told["unknown_nats"]["before"]


def test_beside_curves_over_the_travel_the_cylinder_of_a_flow_solver_still_differs_and_nothing_but_its_wake_or_drag_may_be_named():
    whole = open_campaign(Path(__file__).parents[2] / "datasets" / "cfd_cylinder")
    found = diagnose(Campaign.of(whole.arm, [whole.load(name) for name in whole.names[::2]], whole.steady), "state")
    assert found.detected  # the wake that is met again after stops and reversals is no law of the travel
    assert {f.law.family for f in found.findings} <= {"wake", "drag_law"}  # at such Reynolds numbers viscous drag is part of it
    assert found.findings or found.remainder.detected
