"""A campaign: its folder, its files, and what is refused with one line."""

import pickle
from pathlib import Path

import pytest
import yaml
from campaigns import campaign, planted, write_folder
from planted import healthy, write_campaign, write_csv
from rigs import arm

from nnhydro.cli.main import run
from nnhydro.errors import CampaignError, RecordingError
from nnhydro.recordings.arm import read_arm
from nnhydro.recordings.campaign import Campaign, folders_without_arm, open_campaign, open_campaigns
from nnhydro.recordings.readers import files as readers
from nnhydro.recordings.readers.files import read_recording

A = arm(1)


@pytest.fixture
def folder(tmp_path):
    return write_folder(campaign(A, planted(A), 3, seconds=2.0, rate=50.0), tmp_path / "c")


def test_arm_yml_is_arm_yaml(folder, tmp_path):
    (folder / "arm.yaml").rename(folder / "arm.yml")
    assert open_campaign(folder).arm == A
    assert len(open_campaigns(tmp_path)) == 1
    (folder / "arm.yaml").write_text(yaml.safe_dump(A.document()))
    with pytest.raises(CampaignError, match=r"has both arm\.yaml and arm\.yml"):
        open_campaign(folder)


@pytest.mark.parametrize("name", ["Thumbs.db", "desktop.ini", "._run0.csv", ".DS_Store", "~$run0.csv", ".~lock.run0.csv#",
                                  "__MACOSX/x.csv"])
def test_files_of_the_system_are_passed_over(folder, name):
    path = folder / "recordings" / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(b"\0\1")
    assert open_campaign(folder).names == ("run0", "run1", "run2")


@pytest.mark.parametrize("command", ["check", "identify", "benchmark"])
def test_all_broken_files_are_listed_at_once(folder, command, tmp_path, capsys):
    (folder / "recordings" / "run0.csv").write_text("nonsense\n")
    (folder / "recordings" / "run2.csv").write_text("t_s,q1_rad,tau1_Nm\n0,zero,1\n")
    assert run([command, str(folder), *([] if command == "check" else ["--out", str(tmp_path / "o")])]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "run0.csv" in err
    assert "run2.csv" in err
    assert "1 more of 3 files" in err


def test_one_complaint_of_many_files_is_said_once(folder, capsys):
    table = (folder / "recordings" / "run0.csv").read_text().replace("t_s", "Time")
    for number in range(8):
        (folder / "recordings" / f"run{number}.csv").write_text(table)
    (folder / "recordings" / "run8.csv").write_text("nonsense\n")
    assert run(["check", str(folder)]) == 2
    err = capsys.readouterr().err
    assert err.count("is missing") == 1
    assert "(and 8 more of 9 files: the same in run1.csv, run2.csv, run3.csv and 4 more; run8.csv: " in err


def test_verify_reads_every_recording_once_and_names_the_first_bad_one(tmp_path: Path):
    root = write_campaign(tmp_path / "c")
    open_campaign(root).verify()
    (root / "recordings" / "run2.csv").write_text("nonsense\n")
    campaign = open_campaign(root)
    with pytest.raises(RecordingError, match=r"run2\.csv"):
        campaign.verify()


def test_a_folder_of_campaigns_is_opened_as_several(tmp_path: Path):
    for name in ("b", "a"):
        write_campaign(tmp_path / name)
    (tmp_path / "notes").mkdir()
    assert [c.root.name for c in open_campaigns(tmp_path) if c.root] == ["a", "b"]
    assert len(open_campaigns(tmp_path / "a")) == 1
    assert folders_without_arm(tmp_path) == ("notes",)
    assert folders_without_arm(tmp_path / "a") == ()


def test_hidden_files_are_passed_over_and_links_are_harmless(tmp_path: Path):
    root = write_campaign(tmp_path / "c")
    (root / "recordings" / ".DS_Store").write_bytes(b"\0")
    (root / "recordings" / "linked.csv").symlink_to("../recordings/run1.csv")
    assert open_campaign(root).names == ("linked", "run1", "run2")
    (root / "recordings" / "broken.csv").symlink_to("../../nowhere.csv")
    with pytest.raises(RecordingError, match="does not exist"):
        open_campaign(root).verify()


def changing(monkeypatch, change):
    """Let `change` happen between the reading of a file and the reckoning of its sha256."""
    real = readers.sha256_of
    monkeypatch.setattr(readers, "sha256_of", lambda path: (change(path), real(path))[1])


@pytest.mark.parametrize("change", [lambda path: path.write_bytes(path.read_bytes() + b"9,0,0,0,0,0,0\n"), lambda path: path.unlink(),
                                    lambda path: (path.rename(path.with_suffix(".old")), write_csv(path, healthy(9, 300)))],
                         ids=["grows", "vanishes", "is replaced"])
def test_a_recording_that_changes_while_it_is_read_is_refused(change, tmp_path, monkeypatch):
    root = write_campaign(tmp_path / "c")
    changing(monkeypatch, change)
    with pytest.raises(RecordingError, match=r"run1\.csv: (changed while it was read|cannot be read|.*does not exist)"):
        read_recording(root / "recordings" / "run1.csv", read_arm(root / "arm.yaml"))


def test_a_recording_that_changes_between_two_readings_is_refused(tmp_path):
    campaign = open_campaign(write_campaign(tmp_path / "c"))
    campaign.load("run1")
    campaign._cache.clear()  # as happens in a campaign larger than the memory, and in every worker
    campaign.load("run1")
    campaign._cache.clear()
    write_csv(tmp_path / "c" / "recordings" / "run1.csv", healthy(7, 300))
    with pytest.raises(RecordingError, match=r"run1\.csv: changed since this run first read it"):
        campaign.load("run1")


def test_two_recordings_of_one_name_are_refused():
    r = campaign(A, planted(A), 1, seconds=1.0).load("run0")
    with pytest.raises(CampaignError, match="two recordings have the same name"):
        Campaign.of(A, [r, r])


def test_the_sha256_changes_with_the_arm_and_with_every_file(folder):
    before = open_campaign(folder).sha256()
    assert open_campaign(folder).sha256() == before
    path = folder / "recordings" / "run1.csv"
    path.write_text(path.read_text().replace("0.0,", "0.00,", 1))
    changed = open_campaign(folder).sha256()
    assert changed != before
    (folder / "arm.yaml").write_text(yaml.safe_dump({**A.document(), "gravity_m_s2": 9.8}))
    assert open_campaign(folder).sha256() not in (before, changed)


def test_another_process_reads_the_recordings_anew(folder):
    whole = open_campaign(folder)
    whole.verify()
    again = pickle.loads(pickle.dumps(whole))
    assert whole._cache
    assert not again._cache
    assert again.content("run0") == whole.content("run0")


def test_a_folder_inside_a_campaign_is_not_taken_for_it(folder):
    with pytest.raises(CampaignError, match="is the folder recordings/ of the campaign"):
        open_campaign(folder / "recordings")
