"""Seals, scores and suites: what `nnhydro conceal` hides stays hidden, and `nnhydro reveal` counts right."""

import ast
import hashlib
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nnhydro.blind_tests.truth as truth
from nnhydro.blind_tests.conceal import conceal, write_concealed
from nnhydro.blind_tests.reveal import reveal, unseen_error
from nnhydro.blind_tests.scoring import score
from nnhydro.blind_tests.scoring_windows import PlacementError
from nnhydro.blind_tests.seal import new_key, open_sealed, read_key, seal, write_key, write_sealed
from nnhydro.blind_tests.summary import summary
from nnhydro.blind_tests.truth.campaign import Wish, draw_campaign
from nnhydro.blind_tests.truth.registry import names
from nnhydro.blind_tests.truth.world import FAMILY
from nnhydro.errors import ConfigError
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.stamp import STAMP

DATASET = Path(__file__).parents[3] / "datasets" / "concealed"
ANSWER = {"schema": "nnhydro/answer/1", "kind": "effect", "strength": "strong", "unseen": {}, "effects": [
    {"effect": "umbilical_stiffness", "family": "restoring", "joint": 2, "shape": "plain", "near": [],
     "parameters": {"stiffness": {"value": 0.5, "unit": "N m/rad"}, "free_angle": {"value": 0.2, "unit": "rad"}}}]}
HEALTHY = {**ANSWER, "kind": "none", "strength": None, "effects": []}
BENT = {**ANSWER, "kind": "base_form", "strength": None, "effects": [
    {"effect": "base_form:span", "family": None, "joint": None, "shape": "base_form", "near": ["drag_form"], "parameters": {}}]}
SMALL = Wish("coulomb_friction", "strong", 1, 1, "small")


def finding(effect, joint=2, alternatives=(), confidence=0.97, family="restoring", parameters=None):
    return {"effect": effect, "family": family, "class": [effect, *alternatives], "joint": joint, "confidence": confidence,
            "parameters": parameters or {}}


def said(*findings, detected=True):
    return {"mismatch": {"detected": detected}, "findings": list(findings), "unexplained": {"detected": False}, "seconds": 3.0}


def of(answer, diagnosis):
    return score("campaign_000", answer, diagnosis, "diagnosis.json")


@pytest.mark.parametrize("path", sorted(Path(truth.__file__).parent.glob("*.py")), ids=lambda p: p.name)
def test_the_truth_imports_numpy_and_scipy_and_nothing_of_the_rest(path):
    nodes = list(ast.walk(ast.parse(path.read_text())))
    modules = [a.name for node in nodes if isinstance(node, ast.Import) for a in node.names]
    modules += [node.module for node in nodes if isinstance(node, ast.ImportFrom)]
    for module in modules:
        assert not module.startswith("nnhydro") or module.startswith("nnhydro.blind_tests.truth"), module
        assert module.split(".")[0] not in ("torch", "pandas", "sklearn", "pydantic"), module


def test_an_effect_that_needs_two_links_is_never_hidden_on_one():
    """Seed 3 draws an arm of one link first."""
    drawn = draw_campaign(3, 0, Wish("link_interference", "strong", None, 1, "small"))
    assert drawn.answer["links"] == 2
    assert drawn.answer["seed"] == [3, 0, 1]


def test_every_effect_of_the_catalogue_can_be_hidden_and_is_of_the_same_family():
    from nnhydro.effects.catalogue import catalogue

    assert set(names()) == set(FAMILY)
    assert set(catalogue()) <= set(FAMILY)
    assert {name: card.family for name, card in catalogue().items()}.items() <= FAMILY.items()


def test_a_sealed_answer_opens_with_its_key_alone(tmp_path):
    key, path = new_key(), tmp_path / "campaign_000.sealed"
    write_sealed(path, seal("campaign_000", ANSWER, key))
    assert open_sealed(path, key) == ANSWER
    assert "umbilical" not in path.read_text()
    assert b"umbilical" not in bytes.fromhex(json.loads(path.read_text())["text"])
    with pytest.raises(ConfigError, match="not its key"):
        open_sealed(path, new_key())


def test_a_changed_or_exchanged_answer_is_noticed(tmp_path):
    key, path = new_key(), tmp_path / "campaign_000.sealed"
    first = seal("campaign_000", ANSWER, key)
    write_sealed(path, first)
    document = json.loads(path.read_text())
    flipped = ("1" if document["text"][9] != "1" else "2").join([document["text"][:9], document["text"][10:]])
    path.write_text(json.dumps({**document, "text": flipped}))
    with pytest.raises(ConfigError, match="was changed"):
        open_sealed(path, key)
    write_sealed(path, seal("campaign_000", HEALTHY, key))
    with pytest.raises(ConfigError, match="committed itself to"):
        open_sealed(path, key, first.commitment)
    write_sealed(path, seal("campaign_001", ANSWER, key))
    with pytest.raises(ConfigError, match="exchanged"):
        open_sealed(path, key)


def test_the_same_answer_gives_the_same_seal_and_another_campaign_another():
    key = bytes(32)
    assert seal("a", ANSWER, key) == seal("a", ANSWER, key)
    assert seal("a", ANSWER, key).text[:40] != seal("b", ANSWER, key).text[:40]


@pytest.mark.parametrize("text", ["", "deadbeef", "x" * 64])
def test_a_file_that_holds_no_key_is_refused(tmp_path, text):
    (tmp_path / "key.txt").write_text(text)
    with pytest.raises(ConfigError, match="64 hexadecimal digits"):
        read_key(tmp_path / "key.txt")


def test_a_key_is_for_its_owner_alone(tmp_path):
    write_key(tmp_path / "key.txt", bytes(range(32)))
    assert (tmp_path / "key.txt").stat().st_mode & 0o077 == 0
    assert read_key(tmp_path / "key.txt") == bytes(range(32))


def test_a_perfect_diagnosis_is_right_in_every_way():
    numbers = {"stiffness": {"value": 0.51, "unit": "N m/rad", "ci95": [0.48, 0.54]},
               "centre": {"value": 0.3, "unit": "rad", "ci95": [0.25, 0.35]}}
    verdict = of(ANSWER, said(finding("umbilical_stiffness", parameters=numbers)))
    assert (verdict.right, verdict.exact, verdict.family, verdict.joint, verdict.false_claims) == (True, True, True, True, 0)
    assert verdict.pairs == (("umbilical_stiffness", "umbilical_stiffness"),)
    stiffness, centre = verdict.parameters
    assert stiffness.error == pytest.approx(0.02)
    assert stiffness.covered
    assert not centre.covered  # matched by its unit: the only rad on either side


def test_a_wrong_name_is_a_false_claim_and_a_line_of_the_confusion_table():
    verdict = of(ANSWER, said(finding("torque_bias", family="torque_sensor")))
    assert (verdict.right, verdict.family, verdict.false_claims) == (False, False, 1)
    assert verdict.pairs == (("umbilical_stiffness", "torque_bias"),)
    assert of(ANSWER, said(finding("buoyancy_tilt"))).family


def test_an_honest_class_counts_and_a_long_one_does_not():
    short = of(ANSWER, said(finding("torque_drift", alternatives=("torque_bias", "umbilical_stiffness"))))
    assert (short.right, short.exact, short.class_sizes) == (True, False, (3,))
    long = of(ANSWER, said(finding("torque_drift", alternatives=("torque_bias", "umbilical_stiffness", "buoyancy_tilt"))))
    assert not long.right


def test_the_wrong_joint_is_seen():
    assert not of(ANSWER, said(finding("umbilical_stiffness", joint=1))).joint


def test_a_further_claim_beside_the_right_one_is_false():
    verdict = of(ANSWER, said(finding("umbilical_stiffness"), finding("sensor_timing", None)))
    assert (verdict.right, verdict.false_claims) == (False, 1)
    assert ("nothing", "sensor_timing") in verdict.pairs


def test_each_hidden_effect_needs_a_claim_of_its_own():
    two = {**ANSWER, "effects": [*ANSWER["effects"], {**ANSWER["effects"][0], "effect": "torque_bias", "family": "torque_sensor"}]}
    shared = finding("umbilical_stiffness", alternatives=("torque_bias",))
    assert not of(two, said(shared)).right
    assert of(two, said(shared, finding("torque_bias"))).right


def test_a_healthy_arm_left_alone_is_right_and_a_false_alarm_is_counted():
    quiet, alarmed, claimed = of(HEALTHY, said(detected=False)), of(HEALTHY, said()), of(HEALTHY, said(finding("backlash")))
    assert quiet.right
    assert not quiet.alarm
    group = summary([quiet, alarmed, claimed], [])["groups"][0]
    assert (group["group"], group["campaigns"], group["false_claims"]) == ("healthy", 3, 1)
    assert group["right"] == pytest.approx(1 / 3)
    assert group["alarm"] == pytest.approx(2 / 3)


def test_a_baseline_wrong_in_form_may_be_called_so_or_left_alone():
    assert of(BENT, said(finding("drag_form", None, family="drag_law"))).right
    assert of(BENT, said()).right
    assert of(BENT, said(finding("sensor_timing", None))).false_claims == 1


def test_confidence_is_held_against_what_was_right():
    document = summary([of(ANSWER, said(finding("umbilical_stiffness"))), of(ANSWER, said(finding("backlash", confidence=0.95))),
                        of(ANSWER, said(finding("backlash", confidence=0.6)))], [])
    assert document["confidence"] == {"threshold": 0.9, "claims": 2, "right": 0.5}
    assert document["confusion"]["umbilical_stiffness"] == {"backlash": 2, "umbilical_stiffness": 1}


def test_a_moment_is_told_within_half_a_second_and_a_part_from_six_tenths_of_overlap_on():
    right = of(ANSWER, said(finding("umbilical_stiffness")))
    placed = [PlacementError("onset", 0.9, 0.4), PlacementError("onset", 0.6, 0.6), PlacementError("onset", 0.59, 0.3), None]
    told = summary([right, *(replace(right, part="onset", placed=place) for place in placed), replace(right, confined=True)], [])["placed"]
    assert told == {"campaigns": 4, "overlap": pytest.approx(0.595), "overlapping": 0.5, "moments": 4, "moment_error_s": pytest.approx(0.4),
                    "moment_told": 0.5, "confined_wrongly": 1}


@pytest.mark.parametrize("broken", [{}, {"findings": 3}, {"findings": [{"class": []}]}, {"findings": ["bias"]}])
def test_what_is_no_diagnosis_is_refused_with_its_file(broken):
    with pytest.raises(ConfigError, match=r"diagnosis\.json: is no diagnosis"):
        of(ANSWER, broken)


def test_the_error_of_unseen_motions_is_pooled():
    unseen = {"a": {"tau_Nm": [[1.0], [-1.0]]}, "b": {"tau_Nm": [[2.0]]}}
    assert unseen_error(unseen, lambda name: np.array(unseen[name]["tau_Nm"]) * 1.1) == pytest.approx(0.1)
    with pytest.raises(ConfigError, match="one for each row"):
        unseen_error(unseen, lambda name: np.zeros((5, 1)))


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    folder = tmp_path_factory.mktemp("suite")
    write_key(folder / "key.txt", bytes(range(32)))
    conceal(folder / "suite", [SMALL, Wish("none", "strong", 2, 1, "small")], 11, folder / "key.txt")
    return folder


@pytest.mark.slow
def test_the_same_seed_and_key_give_the_same_bytes(suite, tmp_path):
    conceal(tmp_path / "again", [SMALL], 11, suite / "key.txt")
    files = sorted(p.relative_to(tmp_path / "again") for p in (tmp_path / "again").rglob("*")
                   if p.is_file() and p.name not in ("suite.json", STAMP))
    assert len(files) > 10
    for file in files:
        assert (tmp_path / "again" / file).read_bytes() == (suite / "suite" / file).read_bytes(), file


def test_concealed_campaigns_open_and_give_nothing_away(suite):
    for name in ("campaign_000", "campaign_001"):
        campaign = open_campaign(suite / "suite" / name)
        campaign.verify()
        assert 8 <= len(campaign.names) <= 20
        assert all("tau" not in p.read_text().partition("\n")[0] for p in (suite / "suite" / name / "unseen").iterdir())
    visible = [p for p in (suite / "suite").rglob("*") if p.is_file() and p.suffix in (".json", ".yaml", ".sealed")]
    assert not [p for p in visible if "coulomb" in p.read_text()]


def test_reveal_scores_predicted_torques_and_lists_what_is_missing(suite, tmp_path):
    answer = open_sealed(suite / "suite/answers/campaign_000.sealed", bytes(range(32)))
    place = tmp_path / "campaign_000"
    (place / "torques").mkdir(parents=True)
    (place / "diagnosis.json").write_text(json.dumps(said(finding("coulomb_friction", 1, family="dry_friction"))))
    for name, motion in answer["unseen"].items():
        table = np.column_stack([motion["t_s"], np.array(motion["tau_Nm"]) * 1.05])
        np.savetxt(place / "torques" / f"{name}.csv", table, delimiter=",", header="t_s,tau1_Nm", comments="")
    document = reveal(suite / "suite", tmp_path, suite / "key.txt")
    assert document["missing"] == ["campaign_001"]
    (verdict,) = document["campaigns"]
    assert verdict["right"]
    assert verdict["error_after"] == pytest.approx(0.05)
    assert verdict["error_before"] is None
    truth = unseen_error(answer["unseen"], lambda name: np.array(answer["unseen"][name]["true_model_Nm"]))
    assert verdict["error_true"] == pytest.approx(truth)
    assert 0 < truth < 0.05


def test_the_data_set_is_what_its_card_says():
    card = tomllib.loads((DATASET / "card.toml").read_text())
    there = {p.relative_to(DATASET).as_posix() for p in DATASET.rglob("*") if p.suffix in (".csv", ".yaml", ".sealed", ".json")}
    assert there == set(card["sha256"])
    assert card["synthetic"]
    wrong = [f for f, s in card["sha256"].items() if hashlib.sha256((DATASET / f).read_bytes()).hexdigest() != s]
    assert not wrong, f"remake the set: {wrong}"
    assert sum((DATASET / f).stat().st_size for f in there) < 6e6


def test_the_data_set_hides_every_family_once_and_nothing_in_three():
    answers = [open_sealed(path, read_key(DATASET / "key.txt")) for path in sorted((DATASET / "answers").iterdir())]
    hidden = [entry["family"] for answer in answers for entry in answer["effects"]]
    assert sorted(hidden) == sorted(set(FAMILY.values()))
    assert [answer["kind"] for answer in answers].count("none") == 3
    for answer in answers:
        assert open_campaign(DATASET / answer["campaign"]).arm.n_links == answer["links"]


@pytest.mark.slow
def test_the_data_set_can_be_remade(tmp_path):
    from nnhydro.blind_tests.truth.campaign import draw_campaign

    answer = open_sealed(DATASET / "answers/campaign_004.sealed", read_key(DATASET / "key.txt"))
    effect = answer["effects"][0]["effect"] if answer["effects"] else "none"
    made = draw_campaign(answer["seed"][0], 4, Wish(effect, "strong", None, 1, "small"))
    write_concealed(tmp_path, made)
    for file in made.files:
        there, again = (np.loadtxt(folder / file, delimiter=",", skiprows=1) for folder in (DATASET / "campaign_004", tmp_path))
        np.testing.assert_allclose(again, there, atol=2e-5, err_msg=file)  # other processors may round the last digit otherwise
