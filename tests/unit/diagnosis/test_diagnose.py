"""What a diagnosis claims: planted effects are named with their values, healthy arms are left alone, whatever the noise, order and rate."""

import json
import math
from inspect import signature
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from diagnosed import FRICTION, campaign, diagnosed, named, value

from nnhydro.diagnosis import diagnose as engine
from nnhydro.diagnosis.constants import FORM, NULL_QUANTILE
from nnhydro.diagnosis.decision.catalogue_probability import LISTED
from nnhydro.diagnosis.diagnose import DiagnosisOptions
from nnhydro.diagnosis.experiment.rig_limits import Limits
from nnhydro.effects.catalogue import catalogue
from nnhydro.errors import ModelError, RecordingError
from nnhydro.fitting.identify import identify
from nnhydro.models.baselines import BASELINES
from nnhydro.models.storage import load_model, save_model
from nnhydro.physics.motion import Motion
from nnhydro.recordings.campaign import Campaign

RUBS = {("coulomb_friction", 1)}
FEW = "rubbing, three recordings"


def finite(x):
    if isinstance(x, dict):
        return all(map(finite, x.values()))
    return all(map(finite, x)) if isinstance(x, list | tuple) else not isinstance(x, float) or math.isfinite(x)


def test_a_claim_is_always_a_mismatch(monkeypatch):
    """Of 30 effects one gains 5 nats: as much as chance in fewer than one of a hundred campaigns that were drawn, or it were no claim."""
    monkeypatch.setattr(engine, "unknown_parts", lambda search, found: ())
    claim = SimpleNamespace(statistic=5.0, claimed=True)
    library = SimpleNamespace(key_counts=dict.fromkeys(range(30), 1))
    found = SimpleNamespace(decided=SimpleNamespace(decisions=(claim,)), null=SimpleNamespace(unknown_nats=0.0),
                            search=SimpleNamespace(view=SimpleNamespace(library=library)))
    nothing = SimpleNamespace(p_value=1.0)
    assert engine._p_value(found, nothing) <= 1 - NULL_QUANTILE
    claim.claimed = False
    assert engine._p_value(found, nothing) == 1.0


def test_each_of_two_findings_has_the_error_without_itself_and_both_that_of_the_corrected_model():
    told = diagnosed("two frictions")
    without = {f.effect: f.error_without for f in told.findings}
    assert without == {effect: told.heldout.without[effect, 1] for effect in ("coulomb_friction", "viscous_friction")}
    assert {f.error_with for f in told.findings} == {told.heldout.after}


@pytest.mark.parametrize("name", [
    "healthy", pytest.param("healthy, two links", marks=pytest.mark.slow), pytest.param("healthy, angles alone", marks=pytest.mark.slow),
    "healthy, rates by differences", pytest.param("noise ratio 3", marks=pytest.mark.slow), "noise ratio 10", "noise AR 0.95"])
def test_a_healthy_arm_is_left_alone_whatever_its_noise(name):
    told = diagnosed(name)
    assert named(told) == set()
    assert not told.detected
    assert told.verdict().startswith("No missing physics was detected")
    assert told.heldout.after == told.heldout.before < 3 * told.noise_floor


def test_a_stated_friction_whose_step_is_smoother_is_no_second_friction():
    """Not where rows are so far apart that the step would be displaced, either."""
    told = diagnosed("friction stated")
    assert named(told) == set()
    assert not told.detected


def test_of_a_friction_that_is_much_larger_than_stated_the_verdict_gives_the_level_and_says_that_it_contradicts_the_arm():
    told = diagnosed("friction stated too small")
    assert not named(told), "the stated friction explains all at another level"
    (line,) = told.checks["against_stated"]
    assert line in told.verdict()
    assert line.startswith("stated_coulomb_friction.level[1] is fitted as 0.499")
    assert "times its stated uncertainty from the 0.2 N m of arm.yaml" in line


def test_the_buoyancy_of_an_upright_arm_is_found_as_the_weight_of_the_displaced_water():
    told = diagnosed("upright under water")
    assert [f.effect for f in told.findings] == ["buoyancy_tilt"]
    assert told.findings[0].parameters["lift"].value == pytest.approx(1.0, rel=0.01)


def test_rates_that_lag_the_angles_are_told():
    assert diagnosed("healthy, rates by differences").verdict().endswith("lag the angles by 10.8 ms, as differences do: "
                                                                         "they were left out.")
    assert "lag" not in diagnosed("healthy").verdict()


@pytest.mark.parametrize("name", [
    "rubbing", "rubbing, noise ratio 10", pytest.param("rubbing, noise AR 0.95", marks=pytest.mark.slow),
    pytest.param("rubbing, three recordings", marks=pytest.mark.slow), pytest.param("under a second", marks=pytest.mark.slow)])
def test_dry_friction_is_named_with_its_level_and_nothing_else(name):
    told = diagnosed(name)
    assert named(told) == RUBS
    assert told.detected
    assert told.findings[0].confidence > 0.9
    level, low, high = value(name, "coulomb_friction", "level")
    assert level == pytest.approx(FRICTION, rel=0.05)
    assert low <= FRICTION <= high
    assert told.noise_floor < told.heldout.after  # the arm's step is four times as wide as the card's
    assert told.heldout.after < 0.3 * told.heldout.before
    assert told.heldout.after < 2 * told.noise_floor + 0.02 * told.heldout.before
    (decision,) = [d for d in told.decisions if d.claimed]
    assert (decision.effect, decision.joint) == ("coulomb_friction", 1)
    assert decision.statistic > decision.threshold


@pytest.mark.parametrize(("name", "factor"), [("rubbing, a giant", 1e5), ("rubbing, a dwarf", 1e-5)])
def test_machines_may_be_of_any_size(name, factor):
    usual, other = diagnosed(FEW), diagnosed(name)
    assert named(other) == RUBS
    assert value(name, "coulomb_friction", "level")[0] / factor == pytest.approx(value(FEW, "coulomb_friction", "level")[0], rel=1e-3)
    assert other.heldout.after == pytest.approx(usual.heldout.after, rel=1e-3)


@pytest.mark.slow
def test_the_joint_that_rubs_is_told_from_the_one_that_does_not():
    told = diagnosed("rubbing, two links")
    assert named(told) == {("coulomb_friction", 2)}
    assert told.location[0].joint == 2
    assert value("rubbing, two links", "coulomb_friction", "level")[0] == pytest.approx(0.2, rel=0.05)


@pytest.mark.slow
def test_two_frictions_at_once_are_both_named_with_their_own_share():
    assert named(diagnosed("two frictions")) == {("coulomb_friction", 1), ("viscous_friction", 1)}
    for effect, parameter, true in (("coulomb_friction", "level", 0.3), ("viscous_friction", "coefficient", 0.4)):
        got, low, high = value("two frictions", effect, parameter)
        assert got == pytest.approx(true, rel=0.1)
        assert low <= true <= high


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rubbing, 1 kHz", "rubbing, shuffled and renamed", "rubbing, single precision"])
def test_rate_order_names_and_precision_of_the_files_change_no_name_and_hardly_a_value(name):
    assert named(diagnosed(name)) == named(diagnosed(FEW))
    (usual, low, high), (again, *_) = (value(label, "coulomb_friction", "level") for label in (FEW, name))
    assert abs(again - usual) < 0.1 * (high - low)


def test_the_order_and_the_names_of_files_change_nothing_that_is_decided():
    usual, other = diagnosed(FEW), diagnosed("rubbing, shuffled and renamed")
    assert other.heldout.before == pytest.approx(usual.heldout.before, rel=0.02)
    assert other.heldout.after == pytest.approx(usual.heldout.after, rel=0.1)
    assert [(d.effect, d.joint, d.claimed) for d in other.decisions] == [(d.effect, d.joint, d.claimed) for d in usual.decisions]


def test_of_a_rod_that_swings_freely_no_load_lifts_the_weight_and_its_friction_is_known_as_well_as_its_masses():
    """A load that lifts the weight leaves no torque to explain, and so explains all: it was named in the place of the friction."""
    told = diagnosed("hanging in water")
    assert named(told) == {("coulomb_friction", 1)}
    level, low, high = value("hanging in water", "coulomb_friction", "level")
    assert low < 0.13 < high
    assert high - level > 1.96 * 0.02 * level, "the masses are known to 2 %, and no torque tells more"
    assert told.heldout.after < 0.5 * told.heldout.before


def test_a_cable_of_a_free_pendulum_is_as_stiff_as_it_is_though_the_equation_holds_up_to_a_factor():
    assert named(diagnosed("tethered")) == {("umbilical_stiffness", 1)}
    stiffness, low, high = value("tethered", "umbilical_stiffness", "stiffness")
    assert stiffness == pytest.approx(0.25, rel=0.02), "a tenth of the weight: up to a factor it would be a tenth smaller"
    assert low < 0.25 < high
    assert value("tethered", "umbilical_stiffness", "rest_angle")[0] == pytest.approx(0.3 - np.pi / 2, abs=0.01)


def test_a_spring_may_carry_the_weight_of_a_free_rod_that_swings_about_the_horizontal():
    """There the weight hardly varies, and the inertia sets the scale: with the weight held no spring may carry it, and nothing is named."""
    told = diagnosed("carried by its spring")
    assert named(told) == {("umbilical_stiffness", 1)}
    assert told.heldout.scale == "inertia"
    stiffness, low, high = value("carried by its spring", "umbilical_stiffness", "stiffness")
    assert stiffness == pytest.approx(12.0, rel=0.02)
    assert low < 12.0 < high
    assert told.heldout.after < 0.1 * told.heldout.before


@pytest.mark.slow
def test_a_free_pendulum_is_judged_by_its_weight_and_shows_both_its_frictions():
    told = diagnosed("free pendulum")
    assert named(told) == {("viscous_friction", 1), ("coulomb_friction", 1)}
    assert told.heldout.scale == "weight"
    assert value("free pendulum", "viscous_friction", "coefficient")[0] == pytest.approx(0.04, rel=0.05)
    assert value("free pendulum", "coulomb_friction", "level")[0] == pytest.approx(0.03, rel=0.05)
    document = told.document()
    assert finite(document)
    errors = [document["mismatch"]["error"], document["mismatch"]["noise_floor"], document["proof"]["error_after"]]
    assert all(1e-6 < error < 10 for error in errors)


@pytest.mark.parametrize(("name", "found"), [("steady", set()), ("steady, offset", {("torque_bias", 1)})])
def test_steady_tables_alone_are_diagnosed(name, found):
    told = diagnosed(name)
    assert named(told) == found
    assert finite(told.document())
    assert told.detected == bool(found)
    if found:
        assert value(name, "torque_bias", "offset")[0] == pytest.approx(0.4, abs=0.02)


@pytest.mark.parametrize("rows", [8, 12, 30])
def test_a_friction_that_is_all_there_is_is_no_noise_however_few_the_speeds(rows):
    told = diagnosed(f"shaft, {rows} speeds", "rigid")
    assert len(told.findings) == 1
    assert named(told) <= {("torque_bias", 1), ("coulomb_friction", 1)}
    assert told.noise_floor < 0.33
    assert told.heldout.after < 0.05


@pytest.mark.parametrize(("name", "baseline"), [("steady, offset", None), ("shaft, 30 speeds", "rigid")])
def test_the_noise_of_a_table_is_that_of_its_sensor_whatever_the_unknown_could_make_of_it(name, baseline):
    torque = np.concatenate([table.tau for table in campaign(name).steady])
    assert diagnosed(name, baseline).noise_floor == pytest.approx(0.01 * np.sqrt(2 / np.pi) / np.abs(torque).mean(), rel=0.3)


def test_a_curve_that_no_law_draws_leaves_the_noise_of_a_table_as_it_is():
    told, torque = diagnosed("shaft, a curve", "rigid"), campaign("shaft, a curve").steady[0].tau
    assert told.remainder.detected
    assert 0.3 < told.noise_floor / (0.01 * np.sqrt(2 / np.pi) / np.abs(torque).mean()) < 3.0


def test_the_verdict_says_what_else_the_cause_may_be():
    told = diagnosed("shaft, 12 speeds", "rigid")
    (finding,) = told.findings
    assert len(finding.equivalence_set) > 1
    assert "These recordings cannot distinguish this effect from" in told.verdict()


@pytest.mark.slow
@pytest.mark.parametrize("baseline", ["column", "file"])
def test_the_users_own_simulation_may_be_the_baseline_as_a_column_or_as_a_model_file(baseline, tmp_path):
    if baseline == "file":
        healthy = Campaign.of(campaign("healthy").arm, list(campaign("healthy").recordings()))
        baseline = str(save_model(identify(healthy, "constant"), tmp_path / "model"))
    told = diagnosed("column", baseline)
    assert named(told) == RUBS
    assert told.heldout.after < 0.3 * told.heldout.before
    again, motion = load_model(save_model(told.corrected, tmp_path / "corrected")), Motion.at([[0.3]], [[1.0]], [[0.5]])
    assert torch.equal(again.torque(motion), told.corrected.torque(motion))


def test_a_simulation_that_is_not_in_the_recordings_is_no_baseline():
    with pytest.raises(RecordingError, match="tau1_sim_Nm"):
        engine.diagnose(campaign("rubbing, three recordings"), "column")


@pytest.mark.parametrize("name", ["healthy", "rubbing", "steady", "free pendulum"])
def test_what_is_told_is_json_agrees_with_itself_and_holds_every_figure(name):
    told = diagnosed(name)
    document = json.loads(json.dumps(told.document(), allow_nan=False))
    assert document["schema"] == "nnhydro/diagnosis/1"
    assert document["baseline"] in BASELINES
    assert document["mismatch"]["detected"] == told.detected
    assert {f["effect"] for f in document["findings"]} <= set(catalogue())
    assert document["proof"]["error_before"] == document["mismatch"]["error"]
    assert 0 <= document["proof"]["explained"] <= 1
    assert 0 <= document["unexplained"]["weight"] <= 1
    claimed = {(d["effect"], d["joint"]) for d in document["decisions"] if d["claimed"]}
    assert claimed == {(f["effect"], f["joint"]) for f in document["findings"]}
    for finding in document["findings"]:
        assert finding["class"][0] == finding["effect"]
        assert 0 < finding["confidence"] <= LISTED, "the list may be incomplete"
        assert finding["statement"] in told.verdict()
        for parameter in finding["parameters"].values():
            assert parameter["ci95"][0] <= parameter["value"] <= parameter["ci95"][1]


# keys that scripts of users read: more may join them, none may go
KEYS = {
    "": "schema baseline seconds mismatch location findings indistinguishable unexplained recalibrated next_experiment versions decisions",
    "mismatch": "detected p_value error noise_floor scale", "location": "joint share where conditions band_hz recordings",
    "findings": "effect family class joint confidence statement parameters heldout rivals level",
    "unexplained": "detected share depends_on weight", "decisions": "effect joint statistic threshold claimed reason",
    "rivals": "effect support", "heldout": "error_before error_after", "versions": "nnhydro campaign_sha256"}


@pytest.mark.parametrize("place", KEYS)
def test_keys_that_scripts_read_are_there(place):
    document = diagnosed("steady, offset").document()
    finding = document["findings"][0]
    there = {"": document, "rivals": finding["rivals"], "heldout": finding["heldout"]}.get(place, document.get(place))
    for entry in there if isinstance(there, list) else [there]:
        assert set(KEYS[place].split()) <= set(entry)
    assert there, "nothing was looked at"


def test_the_same_campaign_and_seed_give_the_same_document_again():
    from nnhydro.diagnosis.diagnose import diagnose

    one, other = diagnosed("steady, offset").document(), diagnose(campaign("steady, offset")).document()
    assert {**one, "seconds": 0} == {**other, "seconds": 0}


def test_what_check_denies_of_the_channels_leads_the_verdict(monkeypatch):
    asked = []

    def denied(campaign, cutoff, explained):
        asked.append(explained)
        return [f"wrong in {len(campaign.names)} recordings"]

    monkeypatch.setattr(engine, "denied_channels", denied)
    told = engine.DiagnosisOptions(cutoff_hz=None).diagnose(campaign("steady"))
    assert told.verdict().startswith("Nothing below can be relied on before this is corrected (`nnhydro check` says how): wrong in 0 rec")
    assert asked == [told.heldout.before < FORM]


def test_a_check_of_the_channels_that_fails_does_not_cost_the_verdict(monkeypatch):
    def fails(*given):
        raise ModelError("no signs here")

    monkeypatch.setattr(engine, "denied_channels", fails)
    told = engine.DiagnosisOptions(cutoff_hz=None).diagnose(campaign("steady"))
    assert told.checks["channels"] == "units and signs not judged: no signs here"
    assert not told.verdict().startswith("Nothing below")


@pytest.mark.slow
def test_of_more_recordings_than_are_studied_the_others_take_no_part():
    told = diagnosed("rubbing", most=4)
    assert told.heldout.recordings == 4
    assert named(told) == RUBS


def test_progress_is_told_step_by_step():
    from nnhydro.diagnosis.diagnose import diagnose

    said = []
    told = diagnose(campaign("steady"), progress=said.append)
    assert told.checks["denied_channels"] == []
    assert said[0] == "estimating noise"
    assert any(line.startswith("computing ") for line in said)
    assert said[-1] == "next experiment"


@pytest.mark.slow
def test_a_cut_off_that_is_given_is_the_edge_of_the_band():
    told = diagnosed("healthy", cutoff_hz=2.0)
    assert told.checks["band_hz"] == 2.0
    assert named(told) == set()
    assert np.isfinite(told.noise_floor)


TAKEN = signature(engine.diagnose).parameters


@pytest.mark.parametrize("name", list(vars(DiagnosisOptions())))
def test_an_option_is_an_argument_of_the_diagnosis_with_the_same_default(name):
    assert TAKEN[name].default == vars(DiagnosisOptions())[name]


def test_every_choice_reaches_the_diagnosis(monkeypatch):
    given = []
    monkeypatch.setattr(DiagnosisOptions, "diagnose", lambda options, *others: given.append((options, *others)))
    chosen = {"baseline": "textbook", "seed": 7, "cutoff_hz": 3.0, "without": ("backlash",), "rehearsals": 5, "limits": Limits(), "most": 9}
    assert set(chosen) == set(vars(DiagnosisOptions()))
    engine.diagnose("campaign", **chosen, progress=print)
    assert given == [(DiagnosisOptions(**chosen), "campaign", print)]
