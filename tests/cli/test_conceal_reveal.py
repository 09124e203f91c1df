"""`nnhydro conceal` and `nnhydro reveal` as a person types them."""

import json
from pathlib import Path

import pytest

from nnhydro.cli.main import run
from nnhydro.recordings.campaign import open_campaign

SMALL = ("--links", "1", "--size", "small")


@pytest.fixture(scope="module")
def suite(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tank") / "suite"
    assert run(["conceal", "--out", str(out), "--effect", "torque_bias", *SMALL, "--seed", "4"]) == 0
    return out


def diagnosed(folder: Path, effect: str | None, joint: int | None = 1) -> Path:
    """A hand-made diagnosis of the campaign."""
    findings = [] if effect is None else [{"effect": effect, "family": "torque_sensor", "class": [effect], "joint": joint,
                                           "confidence": 0.95, "parameters": {}}]
    (folder / "campaign_000").mkdir(parents=True)
    (folder / "campaign_000" / "diagnosis.json").write_text(json.dumps({"mismatch": {"detected": True}, "findings": findings}))
    return folder


@pytest.mark.slow
def test_conceal_writes_campaigns_that_open_and_says_what_is_next(suite: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["conceal", "--out", str(tmp_path / "s"), "--effect", "none", *SMALL, "--seed", "1", "--count", "2"]) == 0
    shown = capsys.readouterr().out
    assert "nnhydro reveal" in shown
    for name in ("campaign_000", "campaign_001"):
        assert name in shown
        campaign = open_campaign(tmp_path / "s" / name)
        campaign.verify()
        assert campaign.arm.n_links == 1
    assert (suite / "key.txt").is_file()


def test_reveal_prints_the_score_and_the_confusion(suite: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert run(["reveal", str(suite), "--diagnoses", str(diagnosed(tmp_path, "torque_bias"))]) == 0
    shown = capsys.readouterr().out
    assert "one effect, strong" in shown
    assert "torque_bias (1)" in shown


def test_reveal_gives_json_to_programs(suite: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert run(["reveal", str(suite), "--diagnoses", str(diagnosed(tmp_path, None)), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "nnhydro/score/2"
    assert document["groups"][0]["right"] == 0.0
    assert document["confusion"] == {"torque_bias": {"nothing": 1}}


def test_the_key_can_lie_elsewhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    key, out = tmp_path / "safe.txt", tmp_path / "suite"
    assert run(["conceal", "--out", str(out), "--effect", "none", *SMALL, "--seed", "2", "--key", str(key)]) == 0
    assert key.is_file()
    assert not (out / "key.txt").exists()
    folder = tmp_path / "d" / "campaign_000"
    folder.mkdir(parents=True)
    (folder / "diagnosis.json").write_text(json.dumps({"mismatch": {"detected": False}, "findings": []}))
    assert run(["reveal", str(out), "--diagnoses", str(folder.parent)]) == 2
    assert "no key there" in capsys.readouterr().err
    assert run(["reveal", str(out), "--diagnoses", str(folder.parent), "--key", str(key)]) == 0


@pytest.mark.parametrize(("arguments", "said"), [
    (["--effect", "gremlins"], "--effect gremlins: not known: choose one of none, random"),
    (["--strength", "medium"], "--strength medium: not known: choose one of weak, strong"),
    (["--links", "3"], "--links 3: choose 1 or 2"),
    (["--effect", "torque_crosstalk", "--links", "1"], "needs two links"),
    (["--count", "0"], "--count 0"),
    (["--count-effects", "4"], "--count-effects 4: choose 1 to 3"),
    (["--effect", "none", "--count-effects", "2"], "several at once need"),
    (["--seed", "-1"], "--seed -1"),
    (["--size", "huge"], "--size huge"),
])
def test_what_cannot_be_made_is_refused_in_one_line(arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                                    ) -> None:
    assert run(["conceal", "--out", str(tmp_path / "suite"), *arguments]) == 2
    shown = capsys.readouterr().err
    assert said in shown
    assert shown.count("\n") == 1
    assert not (tmp_path / "suite").exists()


def test_a_folder_of_somebody_s_own_is_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "thesis.txt").write_text("years of work")
    assert run(["conceal", "--out", str(tmp_path), "--effect", "none", "--size", "small"]) == 2
    assert "holds other files" in capsys.readouterr().err


@pytest.mark.parametrize(("folder", "said"), [("nowhere", "is not a suite"), ("suite", "is not a folder")])
def test_reveal_says_what_it_cannot_find(folder: str, said: str, suite: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = suite if folder == "suite" else tmp_path / folder
    assert run(["reveal", str(place), "--diagnoses", str(tmp_path / "none")]) == 2
    assert said in capsys.readouterr().err
