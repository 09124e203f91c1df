"""What the user knows beforehand is used: friction and rotor inertia in arm.yaml, the model of a run in air, units that are stated."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from campaigns import GIVEN, campaign, planted, recording, sensor_torque, write_csv, write_folder
from rigs import arm

from nnhydro.cli.main import run
from nnhydro.errors import ArmError, ModelError
from nnhydro.fitting.dry_model import identify_in_water, in_water
from nnhydro.fitting.identify import identify
from nnhydro.models.seen import marks_seen_by
from nnhydro.models.storage import load_model, save_model
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import parse_arm
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.content_hash import exact
from nnhydro.recordings.filtering.preprocessing import prepare
from nnhydro.recordings.survey import survey

FRICTION = [{"coulomb_Nm": 0.3, "viscous_Nm_s": 0.2, "known_to": 0.2}, {"coulomb_Nm": 0.1, "known_to": 0.2}]


def stated(links=2, **keys):
    return arm(links, friction=FRICTION[:links], **keys)


def rubbing(a, level=(0.33, 0.09), b=(0.17, 0.0)):
    return planted(a).plus("c", CoulombTerm(level[:a.n_links], 0.005)).plus("v", ViscousTerm(b[:a.n_links]))


def test_a_stated_friction_is_calibrated_within_what_is_known_of_it():
    a = stated()
    whole = campaign(a, rubbing(a), 4, noise=0.01)
    found = identify(whole, "constant").fit["parameters"]
    assert found["stated_coulomb_friction.level[1]"]["value"] == pytest.approx(0.33, abs=0.02)
    assert found["stated_viscous_friction.coefficient[1]"]["value"] == pytest.approx(0.17, abs=0.02)
    assert found["stated_viscous_friction.coefficient[2]"]["note"] == "known exactly beforehand"
    exact = stated().model_copy(update={"friction": tuple(f.model_copy(update={"known_to": 0.0}) for f in a.friction)})
    held = identify(Campaign.of(exact, list(whole.recordings())), "constant").fit["parameters"]
    assert held["stated_coulomb_friction.level[1]"]["value"] == 0.3


def test_recordings_that_say_nothing_of_friction_leave_it_as_stated():
    a = stated(1)
    r = recording(a, rubbing(a), seconds=3.0)
    still = replace(r, q=0 * r.q + 0.3, qd=0 * r.qd, qdd=0 * r.qdd, u0=0.4 + 0.1 * np.sin(r.t), du0=0.1 * np.cos(r.t))
    (segment,) = prepare(still, GIVEN)
    still = replace(still, tau=sensor_torque(a, planted(a), Motion.of(segment)))
    found = identify(Campaign.of(a, [still, replace(still, name="b")]), "constant").fit["parameters"]
    assert found["stated_coulomb_friction.level[1]"]["value"] == pytest.approx(0.3)


@pytest.mark.parametrize(("keys", "words"), [
    ({"friction": [{"coulomb_Nm": 0.1}]}, "friction has 1 entry for 2 joints"),
    ({"friction": [{"coulomb": 0.1}, {}]}, "unknown key 'friction\\[0\\].coulomb': did you mean 'coulomb_N"),
    ({"friction": [{"coulomb_N": 0.1}, {}]}, "rename coulomb_N"),
    ({"drive": {"kind": "direct", "rotor_inertia_kg_m2": [0.1]}}, "rotor_inertia_kg_m2 has 1 entry"),
    ({"friction": [{"coulomb_Nm": -0.1}, {}]}, "friction\\[0\\]")])
def test_a_statement_that_does_not_fit_is_refused(keys, words):
    with pytest.raises(ArmError, match=words):
        parse_arm({**arm(2).document(), **keys}, "arm.yaml")


def test_a_statement_survives_the_model_file(tmp_path):
    a = stated()
    model = identify(campaign(a, rubbing(a), 2, noise=0.01), "constant")
    assert load_model(save_model(model, tmp_path / "m")).arm == a


# a run in air as the baseline of one in water
@pytest.fixture(scope="module")
def dry_model():
    a = arm(2, friction=[{"coulomb_Nm": 0.25, "viscous_Nm_s": 0.2, "known_to": 0.5}, {"coulomb_Nm": 0.12, "known_to": 0.5}])
    dry = a.model_copy(update={"fluid": a.fluid.model_copy(update={"density_kg_m3": 0.0})})
    return a, identify(campaign(dry, rubbing(dry), 6, noise=0.005), "rigid")


def slow_and_wet(a):
    """Slow tows: they say little of friction."""
    return campaign(a, rubbing(a), 3, noise=0.02, highest=0.25)


def test_friction_found_in_air_is_held_in_water_where_the_recordings_say_little(dry_model):
    _, dry = dry_model
    whole = slow_and_wet(arm(2))
    model = identify_in_water(whole, dry, "constant")
    found = model.fit["parameters"]
    for key, value in (("stated_coulomb_friction.level[1]", 0.33), ("stated_viscous_friction.coefficient[1]", 0.17)):
        assert found[key]["value"] == pytest.approx(value, rel=0.06)
    assert found["normal_drag.C_D[2]"]["value"] == pytest.approx(1.3, rel=0.1)
    alone = identify(whole, "constant").fit["parameters"]
    assert abs(alone["normal_drag.C_D[2]"]["value"] - 1.3) > abs(found["normal_drag.C_D[2]"]["value"] - 1.3)


def test_a_model_on_a_dry_one_has_seen_the_recordings_of_both(dry_model):
    _, dry = dry_model
    whole = slow_and_wet(arm(2))
    model = identify_in_water(whole, dry)
    assert exact(marks_seen_by(model)) == exact(marks_seen_by(dry)) | {whole.content(name) for name in whole.names}
    assert {"rigid_body", "normal_drag", "added_mass", "stated_coulomb_friction"} <= set(model.loads.terms)


def test_what_is_no_dry_model_of_this_arm_is_refused(dry_model):
    wet, dry = dry_model
    for model, where, words in ((replace(dry, arm=wet), arm(2), "was made in water"), (dry, dry.arm, "itself is without water"),
                                (dry, arm(1), "is of 2 joint")):
        with pytest.raises(ModelError, match=words):
            in_water(model, where, [])


def test_the_command_takes_a_dry_model(dry_model, tmp_path, capsys):
    _, dry = dry_model
    save_model(dry, tmp_path / "dry")
    folder = write_folder(slow_and_wet(arm(2)), tmp_path / "wet")
    assert run(["identify", str(folder), "--dry", str(tmp_path / "dry"), "--out", str(tmp_path / "m")]) == 0
    assert "constant on rigid" in capsys.readouterr().out
    assert "stated_coulomb_friction" in load_model(tmp_path / "m").loads.terms


# units that are stated are trusted
def spinning(tmp_path, mapping):
    a = arm(1, 0.0)
    t = np.arange(400) / 100
    write_csv(tmp_path / "recordings" / "spin.csv", {"t_s": t, "theta": 40 * t, "tau1_Nm": 0.1 + 0.01 * np.sin(t)})
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(a.document()))
    (tmp_path / "columns.yaml").write_text(f"columns: {{q1_rad: {mapping}}}\n")
    return [x.check for x in survey(open_campaign(tmp_path)).oddities]


def test_a_shaft_that_spins_is_not_in_degrees_where_its_unit_is_stated(tmp_path):
    assert "degrees" in spinning(tmp_path / "guessed", "theta")
    assert "degrees" not in spinning(tmp_path / "stated", "{from: theta, unit: rad}")
