"""Seals, scores and suites: what `nnhydro conceal` hides stays hidden, and `nnhydro reveal` counts right."""

import ast
import hashlib
import tomllib
from pathlib import Path

import numpy as np
import pytest

import nnhydro.blind_tests.truth as truth
from nnhydro.blind_tests.conceal import conceal, write_concealed
from nnhydro.blind_tests.seal import open_sealed, read_key
from nnhydro.blind_tests.truth.campaign import Wish, draw_campaign
from nnhydro.blind_tests.truth.registry import names
from nnhydro.blind_tests.truth.world import FAMILY
from nnhydro.recordings.campaign import open_campaign
from nnhydro.runtime.stamp import STAMP

DATASET = Path(__file__).parents[3] / "datasets" / "concealed"
SMALL = Wish("coulomb_friction", "strong", 1, 1, "small")


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
    elsewhere = {"munk_moment", "force_crosstalk"}  # tests/recovery and training/foreign/fourteenth hide them
    of_arms = {name: card.family for name, card in catalogue().items() if card.driven and name not in elsewhere}  # a hull is no arm
    assert of_arms.items() <= FAMILY.items()


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
