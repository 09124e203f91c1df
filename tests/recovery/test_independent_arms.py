"""Arms of training/independent_arms, a program of its own: what is hidden is named alone; without its card no other name is told."""

import importlib
import sys
from pathlib import Path

import pandas as pd
import pytest
import yaml

import nnhydro
from nnhydro.diagnosis.diagnose import diagnose
from nnhydro.effects.catalogue import catalogue

HERE = Path(__file__).parents[2] / "training" / "independent_arms"


@pytest.fixture
def told(tmp_path, monkeypatch):
    """The names told of the arm `seed`, the family of what it hides left out or not."""
    for name in ("planted", "truth"):  # tests have modules of these names, too
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.syspath_prepend(HERE)
    planted = importlib.import_module("planted").planted
    for name in ("planted", "truth"):
        monkeypatch.delitem(sys.modules, name, raising=False)

    def names(seed, out=False):
        _, arm, recordings, hidden = planted(seed)
        (tmp_path / "recordings").mkdir()
        (tmp_path / "arm.yaml").write_text(yaml.safe_dump(arm))
        for name, columns in recordings:
            pd.DataFrame(columns).to_parquet(tmp_path / "recordings" / f"{name}.parquet")
        family = catalogue()[hidden["effect"]].family
        without = tuple(name for name, effect in catalogue().items() if effect.family == family) if out else ()
        found = diagnose(nnhydro.load(tmp_path), without=without)
        assert found.detected
        return hidden["effect"], [f.effect for f in found.findings]

    return names


@pytest.mark.slow
def test_a_delay_of_a_tenth_of_the_band_s_period_leaves_nothing_for_other_laws_although_its_first_order_does(told):
    hidden, names = told(200)
    assert names == [hidden] == ["sensor_timing"]


@pytest.mark.slow
def test_a_drag_that_falls_with_the_reynolds_number_is_no_wake_and_no_delay_where_its_family_is_not_known(told):
    hidden, names = told(145, out=True)
    assert (hidden, names) == ("reynolds_drag", [])
