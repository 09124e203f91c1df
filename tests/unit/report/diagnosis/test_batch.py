"""Many campaigns are diagnosed in order, each to its folder; one that fails says why and stops no other."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from nnhydro.diagnosis.diagnose import DiagnosisOptions
from nnhydro.errors import CampaignError
from nnhydro.report.diagnosis import batch
from nnhydro.report.diagnosis.batch import DiagnosisRequest, diagnose_all


@pytest.fixture
def written(monkeypatch):
    """What was written where, of campaigns that are their own names; `broken` cannot be read, and `faulty` is a fault of ours."""
    found = {}

    def read(path, columns):
        if path.name == "broken":
            raise CampaignError("broken: no recordings")
        if path.name == "faulty":
            raise ZeroDivisionError
        return SimpleNamespace(name=path.name, columns=columns)

    monkeypatch.setattr(batch, "verify_campaign", read)
    monkeypatch.setattr(batch, "write_diagnosis", lambda result, campaign, out: found.update({out: campaign}))
    monkeypatch.setattr(DiagnosisOptions, "diagnose", lambda self, campaign: SimpleNamespace(
        document=lambda: {"of": campaign.name}, verdict=lambda: f"{campaign.name} is whole"))
    return found


def asked(*names, **more):
    return [DiagnosisRequest(Path(name), Path("out") / name, DiagnosisOptions(), **more) for name in names]


def test_one_that_fails_says_why_and_stops_no_other(written):
    outcomes = list(diagnose_all(asked("one", "broken", "two")))
    assert [outcome.asked.campaign.name for outcome in outcomes] == ["one", "broken", "two"]
    assert [outcome.document for outcome in outcomes] == [{"of": "one"}, None, {"of": "two"}]
    assert [outcome.verdict for outcome in outcomes] == ["one is whole", "broken: no recordings", "two is whole"]
    assert list(written) == [Path("out/one"), Path("out/two")]


def test_each_is_written_before_the_next_is_begun(written):
    outcomes = diagnose_all(asked("one", "two"))
    next(outcomes)
    assert list(written) == [Path("out/one")], "so that a finished diagnosis is never lost"


def test_the_user_s_own_columns_and_effects_go_with_the_campaign(written, monkeypatch):
    loaded = []
    monkeypatch.setattr(batch, "load_plugin", loaded.append)
    list(diagnose_all(asked("one", effects=Path("mine.py"), column_map=Path("columns.yaml"))))
    assert written[Path("out/one")].columns == Path("columns.yaml")
    assert loaded == [Path("mine.py")]


def test_a_fault_of_the_package_is_not_taken_for_the_user_s(written):
    with pytest.raises(ZeroDivisionError):
        list(diagnose_all(asked("faulty")))
