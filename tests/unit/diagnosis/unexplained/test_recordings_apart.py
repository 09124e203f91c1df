"""A few recordings that hold most of what remains take no part where the others are better explained without them."""

from types import SimpleNamespace

import numpy as np
import pytest

from nnhydro.diagnosis import diagnose as diagnosis
from nnhydro.diagnosis.decision.heldout_errors import Residual
from nnhydro.diagnosis.unexplained.recordings_apart import apart_sentence, leaves_less, recordings_apart
from nnhydro.diagnosis.unexplained.residual_location import Location
from nnhydro.errors import RecordingError

NAMES = tuple(f"run{k}" for k in range(8))


def heldout(sizes):
    """What remains in each recording, of one joint and of these rms."""
    return SimpleNamespace(remains=[Residual(name, np.full((50, 1), size), {}, 0.01) for name, size in zip(NAMES, sizes, strict=True)])


def rest(loud, detected=True, differ=False):
    """A remainder that exceeds the noise in the recordings `loud` at joint 1; nowhere where there are none."""
    place = Location(1, 1.0, "", {}, [0.0, 1.0], list(loud)) if loud else None
    return SimpleNamespace(detected=detected, parameters_differ=differ, place=place)


def test_few_recordings_with_most_of_the_remaining_energy_stand_apart():
    loud = heldout([5.0, 1, 1, 1, 1, 1, 1, 1])
    assert recordings_apart(rest(["run0"]), loud, NAMES) == {"run0"}
    assert not recordings_apart(rest(["run0"], detected=False), loud, NAMES), "nothing remains"
    assert not recordings_apart(rest(["run0"], differ=True), loud, NAMES), "a cause that varies between recordings is no fault of a few"
    assert not recordings_apart(rest(["run0"]), heldout([2.0, 1, 1, 1, 1, 1, 1, 1]), NAMES), "less than half of the energy"
    assert not recordings_apart(rest(NAMES[:3]), heldout([5.0, 5, 5, 1, 1, 1, 1, 1]), NAMES), "more than a quarter of the recordings"
    assert not recordings_apart(rest(["run0"]), SimpleNamespace(remains=loud.remains[:3]), NAMES[:3]), "too few others"


def test_where_none_exceeds_the_noise_the_fewest_with_most_of_the_energy_stand_apart():
    assert recordings_apart(rest([]), heldout([1.0, 1, 5, 1, 1, 1, 1, 1]), NAMES) == {"run2"}
    assert recordings_apart(rest([]), heldout([1.0, 4, 1, 1, 4, 1, 1, 1]), NAMES) == {"run1", "run4"}
    assert not recordings_apart(rest([], detected=False), heldout([1.0, 1, 5, 1, 1, 1, 1, 1]), NAMES)
    assert not recordings_apart(rest([]), heldout([5.0, 5, 5, 5, 5, 1, 1, 1]), NAMES), "more than a quarter of the recordings"
    assert not recordings_apart(rest([]), heldout([0.0] * 8), NAMES), "nothing remains"
    two = SimpleNamespace(remains=[Residual(name, np.tile([1.0, 5.0 if name == "run2" else 1.0], (50, 1)), {}, 0.01) for name in NAMES])
    assert recordings_apart(rest([]), two, NAMES) == {"run2"}, "at the joint where most remains"


def test_a_table_never_stands_apart():
    table = Residual("table", np.full((50, 1), 9.0), {}, 0.0)
    assert not recordings_apart(rest([]), SimpleNamespace(remains=[*heldout([1.0] * 8).remains, table]), NAMES)
    assert not recordings_apart(rest([]), SimpleNamespace(remains=[table]), ())
    assert not recordings_apart(rest(["table"]), SimpleNamespace(remains=[table]), ())


def test_only_the_other_recordings_are_compared():
    before = heldout([5.0, 1, 1, 1, 1, 1, 1, 1])
    assert leaves_less(before, heldout([9.0, *[0.5] * 7]), {"run0"})
    assert not leaves_less(before, heldout([0.0, *[0.99] * 7]), {"run0"})


def decided(remains, chosen, detected):
    """What was decided on some recordings: `remains`, and the members `chosen`."""
    return SimpleNamespace(rest=rest(["run0"], detected), heldout=remains,
                           found=SimpleNamespace(decided=SimpleNamespace(claimed=SimpleNamespace(chosen=chosen))))


WHOLE = decided(heldout([5.0, *[1.0] * 7]), (), True)


@pytest.mark.parametrize(("after", "chosen", "better"), [(0.2, (3,), True), (0.2, (), False), (0.99, (3,), False)])
def test_the_others_are_judged_alone_where_that_names_effects_that_leave_less_of_them(monkeypatch, after, chosen, better):
    others, asked = decided(heldout([0.0, *[after] * 7]), chosen, False), []
    monkeypatch.setattr(diagnosis, "_decide_on", lambda campaign, names, *options: asked.append(names) or others)
    found, checks = diagnosis.DiagnosisOptions()._without_few(None, NAMES, WHOLE, lambda line: None)
    assert asked == [NAMES[1:]]
    assert found is (others if better else WHOLE)
    assert checks == ({"left_out": apart_sentence({"run0"})} if better else {})


@pytest.mark.parametrize("cause", [RecordingError("no rows are left"), np.linalg.LinAlgError("no rows are left")])
def test_what_cannot_be_judged_without_them_costs_no_verdict(monkeypatch, cause):
    def fail(*anything):
        raise cause

    monkeypatch.setattr(diagnosis, "_decide_on", fail)
    found, checks = diagnosis.DiagnosisOptions()._without_few(None, NAMES, WHOLE, lambda line: None)
    assert found is WHOLE
    assert checks == {"without_recordings": "not judged without run0: no rows are left"}
