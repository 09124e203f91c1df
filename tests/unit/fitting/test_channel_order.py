"""Signs and order of all channels together: the likeliest reading is said, and its lines mend the campaign at once."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import campaign, dry, planted, write_folder
from rigs import arm

from nnhydro.fitting.channel_order import channel_order, judged_ways, ways
from nnhydro.fitting.physical_survey import survey_with_physics
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.recordings.campaign import Campaign, open_campaign


def rubbing(a):
    """An arm with friction; its masses are 15 % other than stated."""
    loads = planted(a) if not a.dry else dry(a)
    body = loads.terms["rigid_body"]
    heavier = replace(body, mass=tuple(1.15 * x for x in body.mass), first_moment=tuple(1.15 * x for x in body.first_moment),
                      second_moment=tuple(1.15 * x for x in body.second_moment))
    return Loads({**loads.terms, "rigid_body": heavier, "c": CoulombTerm((0.2, 0.1)[:a.n_links]),
                  "v": ViscousTerm((0.1, 0.05)[:a.n_links])})


def whole(a, noise=0.05):
    return campaign(a, rubbing(a), 4, noise=noise, seconds=4.0, rate=50.0)


def changed(c, **channels):
    """The campaign with channels replaced by what the functions make of them, in all recordings."""
    runs = []
    for r in c.recordings():
        runs.append(replace(r, **{name: change(getattr(r, name)) for name, change in channels.items()}))
    return Campaign.of(c.arm, runs)


def sign(*signs):
    return lambda x: x * np.array(signs, dtype=float)


def swap(x):
    return x[:, ::-1]


ARMS = {"in water": lambda: arm(2), "in air, upright": lambda: arm(2, 0.0, gravity_m_s2=9.81), "in air, level": lambda: arm(2, 0.0),
        "one joint": lambda: arm(1)}
FAULTS = {
    "both torques negated": ({"tau": sign(-1, -1)}, "the torques of joints 1 and 2 have the wrong sign"),
    "the first torque negated": ({"tau": sign(-1, 1)}, "the torque of joint 1 has the wrong sign"),
    "the second torque negated": ({"tau": sign(1, -1)}, "the torque of joint 2 has the wrong sign"),
    "torques swapped": ({"tau": swap}, "the torques of joints 1 and 2 are exchanged"),
    "the second angle negated": ({"q": sign(1, -1), "qd": sign(1, -1), "qdd": sign(1, -1)}, "the angle of joint 2 has the wrong sign"),
    "joints swapped": ({"q": swap, "qd": swap, "qdd": swap, "tau": swap}, "are exchanged"),
    "torques swapped and one negated": ({"tau": lambda x: swap(x) * np.array([1.0, -1.0])}, "are exchanged, and the torque of joint 2"),
}


@pytest.fixture(scope="module")
def healthy():
    return {name: whole(make()) for name, make in ARMS.items()}


@pytest.mark.parametrize("name", ARMS)
def test_healthy_campaigns_are_left_alone(name, healthy):
    assert channel_order(healthy[name], healthy[name].plan()) is None


@pytest.mark.parametrize("name", ["in water", "in air, upright"])
@pytest.mark.parametrize("fault", FAULTS)
def test_the_likeliest_reading_is_said_with_its_odds(name, fault, healthy):
    change, words = FAULTS[fault]
    c = changed(healthy[name], **change)
    found = channel_order(c, c.plan())
    assert found is not None
    assert words in found.what
    assert "to 1)" in found.what


def test_one_joint_with_a_negated_torque(healthy):
    c = changed(healthy["one joint"], tau=sign(-1))
    assert "the torque of joint 1 has the wrong sign" in channel_order(c, c.plan()).what


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_the_lines_of_the_advice_mend_all_of_it_at_once(fault, healthy, tmp_path):
    """Following the advice for two negated torques used to leave one negated, and that passed."""
    change, _ = FAULTS[fault]
    c = changed(healthy["in water"], **change)
    folder = write_folder(c, tmp_path / "c")
    advice = channel_order(open_campaign(folder), c.plan()).remedy.partition("FILE: ")[2]
    mapping = yaml.safe_load("\n".join(advice.split("; ")))
    (folder / "columns.yaml").write_text(yaml.safe_dump({"columns": mapping}))
    mended = open_campaign(folder)
    found = judged_ways(mended, c.plan())[0]
    assert found.way.changes == 0
    assert found.error < 0.2


def test_the_survey_says_one_thing_of_the_signs(healthy):
    c = changed(healthy["in water"], tau=sign(-1, -1))
    checks = [oddity.check for oddity in survey_with_physics(c).oddities]
    assert checks.count("channel_order") == 1
    assert "torque_sign" not in checks


def test_every_reading_of_two_joints_is_tried():
    assert len(list(ways(arm(2)))) == 64
    assert len({way.changes for way in ways(arm(2))}) == 5


def test_torques_that_have_nothing_to_do_with_the_motion_accuse_nobody():
    rng = np.random.default_rng(1)
    c = changed(whole(arm(2)), tau=lambda x: rng.standard_normal(x.shape))
    assert channel_order(c, c.plan()) is None


def test_the_lines_name_the_columns_and_units_of_the_user(tmp_path):
    """They used to name nnhydro's columns, which whoever has a columns.yaml does not have."""
    folder = write_folder(whole(arm(2)), tmp_path / "c")
    for path in (folder / "recordings").glob("*.csv"):
        table = pd.read_csv(path)
        table.assign(tau1_Nm=-100 * table.tau1_Nm, tau2_Nm=-table.tau2_Nm).rename(
            columns={"tau1_Nm": "M [shoulder]", "tau2_Nm": "M_elbow"}).to_csv(path, index=False)
    mapping = {"tau1_Nm": {"from": "M [shoulder]", "unit": "N cm"}, "tau2_Nm": "M_elbow"}
    (folder / "columns.yaml").write_text(yaml.safe_dump({"columns": mapping}))
    (advice,) = (found.remedy for found in survey_with_physics(open_campaign(folder)).oddities if found.check == "channel_order")
    assert "in place of the lines of these names" in advice
    lines = advice.partition("names: ")[2].split("; ")
    assert lines == ['tau1_Nm: {from: "M [shoulder]", unit: N cm, sign: -1}', "tau2_Nm: {from: M_elbow, sign: -1}"]
    (folder / "columns.yaml").write_text("\n".join(lines))
    assert not [oddity for oddity in survey_with_physics(open_campaign(folder)).oddities if oddity.severity != "note"]
