"""The choices of a diagnosis: what is offered is what `diagnose` takes, with the same defaults, and is passed on as it is."""

from inspect import signature

import pytest

from nnhydro.diagnosis import diagnose as engine
from nnhydro.diagnosis.experiment.rig_limits import Limits
from nnhydro.diagnosis.options import DiagnosisOptions

TAKEN = signature(engine.diagnose).parameters


@pytest.mark.parametrize("name", list(vars(DiagnosisOptions())))
def test_an_option_is_an_argument_of_the_diagnosis_with_the_same_default(name):
    assert TAKEN[name].default == vars(DiagnosisOptions())[name]


def test_every_choice_reaches_the_diagnosis(monkeypatch):
    given = []
    monkeypatch.setattr(engine, "diagnose", lambda campaign, **options: given.append((campaign, options)))
    chosen = {"baseline": "textbook", "seed": 7, "cutoff_hz": 3.0, "without": ("backlash",), "rehearsals": 5, "limits": Limits()}
    DiagnosisOptions(**chosen).diagnose("campaign", print)
    assert given == [("campaign", {**chosen, "progress": print})]
