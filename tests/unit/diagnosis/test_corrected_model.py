"""What is claimed is in the model that is written, always, and no prediction looks at measured torque."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, planted, recording
from campaigns import campaign as recorded
from diagnosed import ARM as ONE
from diagnosed import FRICTION, campaign, diagnosed, dry, named
from rigs import arm

from nnhydro.diagnosis.corrected_model import _term_name, corrected_model, trained_on, with_record
from nnhydro.diagnosis.problem.activity import ActivityWindow, Sector
from nnhydro.diagnosis.problem.baseline import baseline_of
from nnhydro.diagnosis.problem.hypothesis import enumerate_hypotheses
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.effects.catalogue import catalogue
from nnhydro.effects.in_sector import InSector
from nnhydro.fitting.linear.prior import Prior
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.prediction import predict
from nnhydro.models.seen import seen_names
from nnhydro.models.storage import load_model, save_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.recordings.filtering.preprocessing import Preparation

ARM = arm(2)
BASE = baseline_of("constant", ARM, (), Preparation(None))
Z = np.zeros(BASE.prior.F.shape[1])


def finding(effect, activity=None, offset=0.0, predicted=True):
    """A finding that knows what a corrected model asks of it."""
    persists = activity is None or activity.persists
    return SimpleNamespace(law=effect, effect=effect.id, activity=activity, persists=persists, statement="said", offset=offset,
                           predicted=predicted)


def rubs(joint=2, level=0.3):
    return catalogue()["coulomb_friction"].at_start(ARM, joint=joint).with_linear(torch.tensor([level], dtype=torch.float64))


def change(model, without, r):
    return predict(model, r).tau - predict(without, r).tau


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rubbing", "free pendulum", "steady, offset"])
def test_the_model_holds_every_finding_and_differs_from_the_baseline_by_them(name):
    told = diagnosed(name)
    model = told.corrected
    assert len(model.loads.terms) + len(model.instruments) == len(told.baseline.loads.terms) + len(named(told))
    assert model.fit["findings"] == [f.statement for f in told.findings]


def test_predictions_of_the_corrected_model_are_as_good_as_the_proof_says_on_a_motion_nobody_has_seen(tmp_path):
    told = diagnosed("rubbing")
    r = recording(ONE, planted(ONE), "new", seed=99, seconds=6.0)
    true = r.tau + dry(r)
    saved = load_model(save_model(told.corrected, tmp_path / "model"))
    for model in (told.corrected, saved):
        error = np.abs(predict(model, r.without_torque()).tau - true).sum() / np.abs(true).sum()
        assert error < 0.02 < np.abs(predict(told.baseline, r.without_torque()).tau - true).sum() / np.abs(true).sum()
    assert np.array_equal(predict(saved, r).tau, predict(told.corrected, r).tau)
    level = float(change(told.corrected, replace(told.corrected, loads=replace(told.corrected.loads, terms={
        k: t for k, t in told.corrected.loads.terms.items() if "coulomb" not in k})), r).max())
    assert level == pytest.approx(FRICTION, rel=0.05), "the sentence, the model and what predict does agree"


@pytest.mark.slow
def test_where_nothing_is_found_the_corrected_model_is_the_baseline():
    told, r = diagnosed("healthy"), campaign("healthy").load("run00")
    assert np.array_equal(predict(told.corrected, r).tau, predict(told.baseline, r).tau)


def test_a_finding_called_as_a_term_of_the_baseline_stands_beside_it():
    effect = catalogue()["added_mass"].at_start(ARM)
    model = corrected_model(BASE, Z, Z, [finding(effect)])
    assert [name for name in model.loads.terms if "added_mass" in name] == ["added_mass", "found_added_mass"]
    assert _term_name(effect, model.loads) == "found_found_added_mass"


def test_a_finding_in_a_sector_is_confined_to_it_and_one_that_has_ended_is_no_part():
    r = recording(ARM, planted(ARM), "run", seed=3)
    plain = corrected_model(BASE, Z, Z, [])
    q = r.q[:, 0]
    middle = float(np.median(q))
    there = corrected_model(BASE, Z, Z, [finding(rubs(), ActivityWindow(sector=Sector(1, middle, 10.0)))])
    (term,) = [t for t in there.loads.terms.values() if isinstance(t, InSector)]
    assert (term.joint, term.low) == (1, middle)
    moved = np.abs(change(there, plain, r)[:, 1])
    assert moved[q < middle - 1e-6].max() < 1e-12
    assert moved[q > middle + 1e-6].max() > 0.25
    ended = corrected_model(BASE, Z, Z, [finding(rubs(), ActivityWindow(("run",), until=True))])
    assert not change(ended, plain, r).any()
    lasting = corrected_model(BASE, Z, Z, [finding(rubs(), ActivityWindow(("run",), since=True))])
    assert np.abs(change(lasting, plain, r)).max() == pytest.approx(0.3, rel=0.01)


def test_what_cannot_be_predicted_is_no_part_of_a_prediction():
    gap = catalogue()["backlash"].at_start(ARM, joint=1)
    assert len(corrected_model(BASE, Z, Z, [finding(gap)]).instruments) == 1
    assert corrected_model(BASE, Z, Z, [finding(gap, predicted=False)]).instruments == ()
    phased = next(hypothesis.effect for hypothesis in enumerate_hypotheses(ARM, (5.0, 2.0)) if hypothesis.per_recording)
    model = corrected_model(BASE, Z, Z, [finding(phased, predicted=False)])
    assert set(model.loads.terms) == set(BASE.physics.loads.terms)


def test_a_prediction_holds_the_zero_that_a_drifting_sensor_had_at_the_end():
    drift = catalogue()["torque_drift"].at_start(ARM, joint=2).with_linear(torch.tensor([0.2, 0.1, 0.0], dtype=torch.float64))
    (bias,) = corrected_model(BASE, Z, Z, [finding(drift, offset=0.5)]).instruments
    assert (bias.id, bias.joint) == ("torque_bias", 2)
    assert bias.offset[0] == pytest.approx(0.8)  # its curve at the end, and the constant beside it


@dataclass(frozen=True)
class Given:
    """Another simulation as the baseline, and the physics beside it."""

    physics: StripTheory
    prior: Prior
    is_physics: bool
    name: str = "given"
    simulated: None = None

    def at(self, z):
        return replace(BASE, physics=self.physics, prior=self.prior).at(z)


@pytest.mark.parametrize("ours", [True, False])
def test_the_baseline_is_refitted_beside_findings_and_where_it_stands_beside_another_simulation(ours):
    mean, F, z = np.arange(1.0, 11.0), np.diag(np.arange(0.1, 1.1, 0.1)), np.linspace(-1, 1, 10)
    physics = StripTheory(ARM, Preparation(None), {}, "constant", planted(ARM))
    model = corrected_model(Given(physics, Prior(mean, F, -mean, mean), ours), 0 * z, z, [])
    assert isinstance(model, CorrectedSimulation) != ours
    after = model if ours else model.after
    told = torch.cat([term.linear_values() for term in after.loads.linear().values()]).numpy()
    np.testing.assert_allclose(told, mean + F @ z)


SINGLE = arm(1)
WHOLE = recorded(SINGLE, planted(SINGLE), count=4)


def model(seen=()):
    return StripTheory(SINGLE, GIVEN, {"seen": list(seen), "kind": "calibrated"}, "constant", planted(SINGLE))


def test_a_model_has_seen_the_recordings_that_were_studied_and_no_other():
    record = trained_on(WHOLE, problem_of(WHOLE, ("run0", "run2"), 3.0), model())
    made = with_record(model(), record)
    assert seen_names(made, WHOLE) == ("run0", "run2")
    assert made.fit["kind"] == "calibrated", "what the record said before stays"


def test_what_the_known_model_has_seen_is_seen():
    before = trained_on(WHOLE, problem_of(WHOLE, ("run3",), 3.0), model())["seen"]
    record = trained_on(WHOLE, problem_of(WHOLE, ("run0",), 3.0), model(before))
    assert seen_names(with_record(model(), record), WHOLE) == ("run0", "run3")


def test_of_a_model_of_unknown_origin_nobody_knows_what_it_has_seen():
    record = trained_on(WHOLE, problem_of(WHOLE, ("run0",), 3.0), SimpleNamespace(fit={}))
    assert record["seen"] is None


def test_the_record_says_where_the_model_may_be_used():
    slow, all_ = (trained_on(WHOLE, problem_of(WHOLE, names, 3.0), model())["domain"] for names in (("run0",), WHOLE.names))
    assert slow is not None
    assert slow != all_, "more recordings cover more"
