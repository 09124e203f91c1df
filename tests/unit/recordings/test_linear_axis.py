"""A linear axis reads m and N: from its columns to the units of what is found, and every part of the physics along its travel."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from campaigns import GIVEN, TINY, write_csv
from rigs import assert_close

from nnhydro.cli.main import run
from nnhydro.conventions import column
from nnhydro.errors import ArmError, RecordingError
from nnhydro.fitting.identify import identify
from nnhydro.fitting.network.train import train
from nnhydro.models.prediction import predict
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.coulomb_friction import CoulombTerm
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.loads.viscous_friction import ViscousTerm
from nnhydro.physics.motion import Base, Motion, tensor
from nnhydro.recordings.arm import parse_arm
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.readers.files import read_recording
from nnhydro.recordings.recording import Recording
from nnhydro.recordings.survey import survey

DRY = {"schema": "nnhydro/arm/1", "name": "ball screw", "fluid": {"density_kg_m3": 0.0}, "joints": [{"type": "prismatic"}],
       "links": [{"mass_kg": 12.0, "known_to": 0.05}]}


def axis(**changes):
    return parse_arm({**DRY, **changes}, "arm.yaml")


def moved(seed=1, seconds=6.0, rate=100.0, widest=0.12):
    """Position, speed and acceleration (n,) of a carriage that travels to and fro from rest."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate
    w = 2 * np.pi * rng.uniform(0.3, 1.0, 2)
    a = widest * rng.uniform(0.5, 1.0, 2) * (1, -1)
    phase = w * t[:, None]
    return t, (a * (1 - np.cos(phase))).sum(1), (a * w * np.sin(phase)).sum(1), (a * w**2 * np.cos(phase)).sum(1)


def motion(seed=1, **more):
    t, *state = moved(seed)
    still = torch.zeros(len(t), dtype=torch.float64)
    return Motion(tensor(t), *(tensor(x)[:, None] for x in state), still, still, **more)


def force(arm, term, at):
    return term.torque(Flow(arm, at))[:, 0]


def test_a_moving_mass_resists_its_acceleration_alone():
    at = motion()
    assert_close(force(axis(), RigidBody.of_arm(axis()), at), 12.0 * at.qdd[:, 0])


@pytest.mark.parametrize("direction", [0.0, 0.6, np.pi / 2])
def test_an_inclined_axis_carries_its_share_of_the_weight(direction):
    arm = axis(gravity_m_s2=9.81, joints=[{"type": "prismatic", "direction_rad": direction}])
    at = motion()
    assert_close(force(arm, RigidBody.of_arm(arm), at), 12.0 * (at.qdd[:, 0] + 9.81 * np.sin(direction)))


def test_drag_and_added_mass_are_those_of_a_cylinder_pulled_across():
    arm = axis(fluid={"density_kg_m3": 1000.0}, links=[{"mass_kg": 12.0, "length_m": 0.8, "diameter_m": 0.05}])
    at = motion()
    v, a = at.qd[:, 0], at.qdd[:, 0]
    assert_close(force(arm, NormalDrag((1.1,)), at), 0.5 * 1000 * 1.1 * 0.05 * 0.8 * v.abs() * v)
    assert_close(force(arm, AddedMass((0.9,)), at), 0.9 * 1000 * np.pi / 4 * 0.05**2 * 0.8 * a)


def test_a_base_along_the_travel_moves_the_carriage_as_the_joint_does():
    arm = axis(fluid={"density_kg_m3": 1000.0}, links=[{"mass_kg": 12.0, "length_m": 0.8, "diameter_m": 0.05}])
    at = motion()
    still = torch.zeros_like(at.t)
    carried = replace(at, q=0 * at.q, qd=0 * at.qd, qdd=0 * at.qdd, base=Base(at.qd[:, 0], at.qdd[:, 0], still, still, still))
    for term in (RigidBody.of_arm(arm), NormalDrag((1.1,)), AddedMass((0.9,))):
        assert_close(force(arm, term, carried), force(arm, term, at))
    assert not bool(force(arm, CoulombTerm((5.0,)), carried).any())


def test_the_columns_of_a_linear_axis_end_in_metres_and_newtons():
    assert [column(c, 1, sliding=True) for c in ("q", "qd", "qdd", "tau", "tau_sim", "tau_std")] == [
        "q1_m", "dq1_m_s", "ddq1_m_s2", "tau1_N", "tau1_sim_N", "tau1_std_N"]
    assert column("u0", sliding=True) == "u0_m_s"


def loads_of(arm, mass=12.6, level=8.0, viscous=25.0):
    return Loads({"rigid_body": RigidBody((mass,), (0.0,), (0.0,)), "dry": CoulombTerm((level,), 0.005),
                  "oil": ViscousTerm((viscous,))})


def recorded(arm, count=4, noise=0.2):
    """Recordings of an axis with friction, all derivatives given."""
    runs = []
    for k in range(count):
        t, q, qd, qdd = moved(k + 1)
        at = motion(k + 1)
        tau = StripTheory(arm, GIVEN, {}, "truth", loads_of(arm)).torque(at).numpy()
        tau = tau + noise * np.random.default_rng(k).standard_normal(tau.shape)
        runs.append(Recording(f"run{k}", t, q[:, None], tau, qd[:, None], qdd[:, None]))
    return runs


def columns(r, names=("q1_m", "dq1_m_s", "ddq1_m_s2", "tau1_N")):
    return {"t_s": r.t, **dict(zip(names, (r.q[:, 0], r.qd[:, 0], r.qdd[:, 0], r.tau[:, 0]), strict=True))}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A campaign of a ball screw, its friction stated beforehand."""
    import yaml

    root = tmp_path_factory.mktemp("axis")
    stated = [{"coulomb_N": 7.0, "viscous_N_s_m": 22.0, "known_to": 0.3}]
    (root / "arm.yaml").write_text(yaml.safe_dump({**DRY, "friction": stated}))
    for r in recorded(axis()):
        write_csv(root / "recordings" / f"{r.name}.csv", columns(r))
    return root


def test_mass_and_friction_of_a_ball_screw_are_found_in_its_units(folder):
    found = identify(open_campaign(folder), "rigid").fit["parameters"]
    for name, value, unit in (("rigid_body.mass[1]", 12.6, "kg"), ("stated_coulomb_friction.level[1]", 8.0, "N"),
                              ("stated_viscous_friction.coefficient[1]", 25.0, "N s/m")):
        assert found[name]["value"] == pytest.approx(value, rel=0.03)
        assert found[name]["unit"] == unit
        assert found[name]["ci95"][0] <= value <= found[name]["ci95"][1]


@pytest.mark.slow
def test_a_linear_axis_goes_from_folder_to_prediction_by_commands(folder, tmp_path, capsys):
    assert run(["check", str(folder)]) == 0
    assert run(["identify", str(folder), "--model", "rigid", "--out", str(tmp_path / "m")]) == 0
    out = capsys.readouterr().out
    assert "N s/m" in out
    assert " N m" not in out
    assert "rad" not in out.replace("tau", "")
    assert run(["predict", str(tmp_path / "m"), str(folder / "recordings" / "run0.csv"), "--out", str(tmp_path / "t"), "--json"]) == 0
    capsys.readouterr()
    assert (tmp_path / "t" / "run0.csv").read_text().startswith("t_s,tau1_N,outside\n")
    assert run(["benchmark", str(folder), "--models", "rigid", "--folds", "2", "--out", str(tmp_path / "b"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["models"]["rigid"]["error"] < 0.1
    page = (tmp_path / "b" / "report.html").read_text()
    assert "force 1 [N]" in page
    assert "[N m]" not in page
    assert run(["gains", str(tmp_path / "m"), "--out", str(tmp_path / "g")]) == 0
    told = capsys.readouterr().out + (tmp_path / "g" / "gains.csv").read_text()
    assert "N s/m" in told
    assert "rad" not in told


def test_columns_in_radians_are_not_taken_for_metres(tmp_path):
    (r,) = recorded(axis(), 1)
    path = write_csv(tmp_path / "run.csv", columns(r, ("q1_rad", "dq1_rad_s", "ddq1_rad_s2", "tau1_Nm")))
    with pytest.raises(RecordingError, match=r"'q1_m', 'tau1_N' are missing"):
        read_recording(path, axis())


def test_a_mapping_knows_millimetres_and_kilonewtons(tmp_path):
    (r,) = recorded(axis(), 1)
    write_csv(tmp_path / "recordings" / "run.csv", {"t_s": r.t, "x": 1e3 * r.q[:, 0], "F": 1e-3 * r.tau[:, 0]})
    (tmp_path / "columns.yaml").write_text("columns: {q1_m: {from: x, unit: mm}, tau1_N: {from: F, unit: kN}}\n")
    got = read_recording(tmp_path / "recordings" / "run.csv", axis())
    np.testing.assert_allclose(got.q, r.q, atol=1e-12)
    np.testing.assert_allclose(got.tau, r.tau, atol=1e-9)


def test_a_long_axis_is_not_taken_for_degrees():
    arm = axis()
    runs = [replace(r, q=200 * r.q, qd=200 * r.qd, qdd=200 * r.qdd) for r in recorded(arm, 2)]
    assert not [x for x in survey(Campaign.of(arm, runs)).oddities if x.check == "degrees"]


def test_a_prediction_for_a_linear_axis_is_the_force():
    arm = axis()
    runs = recorded(arm)
    model = StripTheory(arm, GIVEN, {}, "truth", loads_of(arm))
    assert np.abs(predict(model, runs[0]).tau - runs[0].tau).mean() < 0.3


@pytest.mark.slow
@pytest.mark.parametrize("wet", [False, True])
def test_a_hybrid_learns_a_linear_axis(wet):
    shape = {"fluid": {"density_kg_m3": 1000.0}, "links": [{"mass_kg": 12.0, "length_m": 0.8, "diameter_m": 0.05}]} if wet else {}
    arm = axis(**shape)
    whole = Campaign.of(arm, recorded(arm))
    model = train(whole, TINY.model_copy(update={"model": "hybrid"}))
    at = motion(9)
    truth = StripTheory(arm, GIVEN, {}, "truth", loads_of(arm)).torque(at)
    base = model.baseline.torque(at)
    assert bool(model.torque(at).isfinite().all())
    assert float((model.torque(at) - truth).abs().mean()) < 1.1 * float((base - truth).abs().mean())


def test_of_a_linear_axis_the_mass_alone_counts_wherever_its_centre_lies():
    plain, stated = (axis(links=[{"mass_kg": 1.0, **more}]) for more in ({}, {"com_m": 0.3, "inertia_kg_m2": 0.5}))
    assert plain == stated


@pytest.mark.parametrize(("changes", "words"), [
    ({"links": [{"mass_kg": 1.0}, {"mass_kg": 1.0}], "joints": [{"type": "prismatic"}, {}]}, "describe each axis as an arm of its own"),
    ({"joints": [{"type": "prismatic"}, {"type": "prismatic"}]}, "joints has 2 entries for 1 joint:"),
    ({"links": [{"mass_kg": 1.0, "com_m": "far"}]}, "com_m"),
    ({"friction": [{"coulomb_Nm": 1.0}]}, "friction of a linear axis is coulomb_N"),
    ({"fluid": {"density_kg_m3": 1000.0}}, "length_m"),
    ({"joints": [{"type": "slide"}]}, "joints")])
def test_what_is_no_linear_axis_is_refused_with_the_remedy(changes, words):
    with pytest.raises(ArmError, match=words):
        axis(**changes)
