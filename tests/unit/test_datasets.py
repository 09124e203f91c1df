"""The data sets are what their cards say, can be remade, and rest on physics of their own."""

import ast
import hashlib
import importlib.util
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "golden"
CARDS = sorted(p for p in (ROOT / "datasets").glob("*/card.toml") if (p.parent / "arm.yaml").is_file())  # suites: test_conceal.py
SMALL = {"rivera_tank": "slew_jerk_both", "mclain_tank": "slew_30_a4", "ns_tank": "oscillate_kc3", "vortex_tank": "oscillate_kc3"}
STRIP_SUM = 1e-4  # 60 midpoint strips per link against the integral, relative to the larger of the torque and 1 N m


def load(name):
    """truth.py of a set, under a name of its own: both sets call theirs `truth`."""
    spec = importlib.util.spec_from_file_location(f"{name}_truth", ROOT / "datasets" / name / "truth.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


rivera, mclain = load("rivera_tank"), load("mclain_tank")
CONSTANT = rivera.Effects(wake=False, shadow=False, tip=False, friction=False)
SEALS = [rivera.Seal(0.045, 0.012, 0.008), rivera.Seal(0.030, 0.010, 0.006)]


def arm(**coefficients):
    return [
        rivera.Link(0.4, 0.06, 1.9, 0.21, 0.026, **coefficients),
        rivera.Link(0.35, 0.05, 1.4, 0.165, 0.0145, **coefficients),
    ]


def instant(state):
    """One state of a golden file as a motion of one sample; the files have relative angles, the truth absolute."""
    relative = np.array([[state[f"{d}theta1"], state[f"{d}theta2"]] for d in ("", "d", "dd")])
    phi, dphi, ddphi = np.cumsum(relative, axis=1)[:, None]
    return rivera.Motion(np.zeros(1), phi, dphi, ddphi, np.array([state["u0"]]), np.array([state["du0"]]), True)


def golden(name):
    file = json.loads((GOLDEN / f"{name}.json").read_text())
    return file, file["random_cases"] + file["edge_cases"]


def swim(mirrored=False):
    """Four seconds of both links swinging, towed from rest; mirrored about the plane of tow."""
    t = np.arange(0.0, 4.0, 0.005)
    f = np.array([0.5, 0.8])
    phi = np.array([-0.6, -1.8]) + 0.7 * np.sin(2 * np.pi * f * t[:, None])
    dphi = 0.7 * 2 * np.pi * f * np.cos(2 * np.pi * f * t[:, None])
    ddphi = -0.7 * (2 * np.pi * f) ** 2 * np.sin(2 * np.pi * f * t[:, None])
    if mirrored:
        phi, dphi, ddphi = np.pi - phi, -dphi, -ddphi
    u0 = 0.4 * (1 - np.exp(-t))
    return rivera.Motion(t, phi, dphi, ddphi, u0, 0.4 * np.exp(-t))


@pytest.mark.parametrize("card", CARDS, ids=lambda p: p.parent.name)
class TestCard:
    def test_lists_every_data_file_with_its_sum(self, card):
        sums = tomllib.loads(card.read_text())["sha256"]
        there = {p.relative_to(card.parent).as_posix() for d in ("recordings", "steady", "unseen", "answers")
                 for p in (card.parent / d).glob("*") if p.is_file()}
        assert there | {"arm.yaml"} <= set(sums)
        wrong = [f for f, s in sums.items() if hashlib.sha256((card.parent / f).read_bytes()).hexdigest() != s]
        assert not wrong, f"remake the set or its card: {wrong}"

    def test_says_plainly_that_the_data_are_synthetic(self, card):
        facts = tomllib.loads(card.read_text())
        assert facts["synthetic"]
        assert facts["licence"] == "BSD-3-Clause"
        assert "Synthetic" in facts["source"]
        assert "Synthetic" in (card.parent / "card.md").read_text()

    def test_held_out_recordings_exist(self, card):
        assert all((card.parent / f).is_file() for f in tomllib.loads(card.read_text())["role"]["held_out"])

    def test_its_programs_import_nothing_of_the_package(self, card):
        for script in card.parent.glob("*.py"):
            nodes = list(ast.walk(ast.parse(script.read_text())))
            names = [a.name for n in nodes if isinstance(n, ast.Import) for a in n.names]
            names += [n.module or "." for n in nodes if isinstance(n, ast.ImportFrom)]
            assert not [n for n in names if n.split(".")[0] in ("nnhydro", "")], script

    def test_one_recording_can_be_remade_byte_for_byte(self, card, tmp_path):
        if not (card.parent / "make.py").is_file():
            pytest.skip("the solver that made this set is not in the repository")
        name = SMALL[card.parent.name]
        make = [sys.executable, str(card.parent / "make.py"), "--out", str(tmp_path), "--only", name]
        subprocess.run(make, check=True, capture_output=True)
        again = (tmp_path / "recordings" / f"{name}.csv").read_bytes()
        assert again == (card.parent / "recordings" / f"{name}.csv").read_bytes()


@pytest.mark.parametrize(("name", "reading"), [("drag", None), ("inertia", "document")])
def test_constant_coefficients_give_the_golden_motor_torque(name, reading):
    file, cases = golden(name)
    par = file["parameters"]
    links = [
        rivera.Link(par[f"L{i}"], par[f"D{i}"], 1.0, 0.1, 0.1, C_D=par.get(f"C_Dy{i}", 0.0), C_M=par.get(f"C_My{i}", 0.0),
                    C_D_axial=par.get(f"C_Dx{i}", 0.0), C_M_axial=par.get(f"C_Mx{i}", 0.0))
        for i in (1, 2)
    ]
    for case in cases:
        torque = sum(rivera.link_water_torque(instant(case["state"]), links, i, par["rho"], CONSTANT) for i in (0, 1))[0]
        wanted = np.array((case[reading] if reading else case)["base_motor_torque_belt_1to1"])
        assert np.abs(torque - wanted).max() < STRIP_SUM * max(1.0, np.abs(wanted).max()), case["state"]


def test_two_point_masses_a_link_give_the_golden_rigid_body_torque():
    file, cases = golden("rigid_body")
    par, inertia = file["parameters"], file["derived"]
    links = [
        rivera.Link(par[f"L{i}"], par[f"D{i}"], par[f"m{i}"], par[f"Lc{i}"], inertia[f"I{i}_centroid_transverse"]) for i in (1, 2)
    ]
    for case in cases:
        torque = rivera.rigid_torque(instant(case["state"]), links)[0]
        np.testing.assert_allclose(torque, case["base_motor_torque_belt_1to1"], rtol=1e-12, atol=1e-12)


def test_the_swinging_cylinder_gives_the_golden_slews():
    for slew in json.loads((GOLDEN / "mclain_slews.json").read_text())["slews"]:
        theta, omega, alpha = (np.array(slew[k]) for k in ("theta", "omega", "alpha_t"))
        water_on_arm = np.array(slew["T_hyd_continuum"])
        torque = mclain.hydrodynamic_torque(mclain.Arm(), theta, omega, alpha)
        assert np.abs(torque + water_on_arm).max() < 2e-5 * np.abs(water_on_arm).max()  # 200 midpoint strips


def test_friction_only_ever_takes_energy():
    motion = swim()
    power = (rivera.friction_torque(motion, SEALS) * motion.dphi).sum(axis=1)
    assert (power >= 0).all()
    assert power.max() > 0


def test_the_mirrored_motion_gives_the_mirrored_torque():
    links = arm(C_D=1.1, C_D_axial=0.012)
    torque, other = (rivera.motor_torque(swim(m), links, SEALS, 1000.0) for m in (False, True))
    np.testing.assert_allclose(other, -torque, atol=1e-11)


@pytest.mark.parametrize("effect", ["wake", "shadow", "tip", "friction"])
def test_each_planted_effect_loads_the_arm(effect):
    links, motion = arm(C_D=1.1), swim()
    full = rivera.motor_torque(motion, links, SEALS, 1000.0)
    without = rivera.motor_torque(motion, links, SEALS, 1000.0, rivera.Effects(**{effect: False}))
    assert np.abs(full - without).sum() > 0.003 * np.abs(full).sum()


def test_the_wake_of_a_link_set_off_from_rest_depends_on_travel_alone():
    t = np.arange(0.0, 3.0, 0.001)
    travel, link = np.linspace(0.5, 20.0, 40), arm(C_D=1.0, C_M_wake=0.38)[0]
    curves = []
    for acceleration in (1.0, 3.0):
        w = (acceleration * t)[:, None]
        still = rivera.Motion(t, *[np.zeros((len(t), 2))] * 3, 0 * t, 0 * t)
        C_D_w, C_M = rivera.wake_coefficients(link, w, *rivera.wake_speeds(w, still, link.diameter))
        s = acceleration * t**2 / 2 / link.diameter
        curves.append([np.interp(travel, s[1:], (C_D_w[1:] / w[1:])[:, 0]), np.interp(travel, s, C_M[:, 0])])
    np.testing.assert_allclose(curves[0], curves[1], atol=0.01)  # the speed below which a strip has no direction
    drag = curves[0][0]
    assert 3.0 < travel[drag.argmax()] < 5.0
    assert 1.2 < drag.max() < 1.5
    assert drag[-1] < 1.12


def test_a_larger_campaign_of_a_tank_has_the_listed_recordings_and_motions_no_faster(tmp_path):
    """The flows of drawn motions that lie in strips/ are of the motions that are drawn: their lengths agree, or nothing is written."""
    folder = ROOT / "datasets" / "vortex_tank"
    program = [sys.executable, str(folder.parent / "strip_more.py"), "vortex_tank", "40", str(tmp_path / "more")]
    more = subprocess.run(program, capture_output=True, text=True, check=False)
    assert more.returncode == 0, more.stderr
    listed = {path.name: path.read_bytes() for path in (folder / "recordings").iterdir()}
    made = {path.name: path.read_bytes() for path in (tmp_path / "more" / "recordings").iterdir()}
    assert len(made) == 60
    assert made.items() >= listed.items()
    assert (tmp_path / "more" / "arm.yaml").read_bytes() == (folder / "arm.yaml").read_bytes()
    kinds = [name.partition("_")[0] for name in listed]
    assert sorted(name.partition("_")[0] for name in made) == sorted(3 * kinds)


@pytest.mark.parametrize("name", ["ns_tank", "vortex_tank"])
def test_drawn_motions_are_no_faster_than_the_listed_ones(name):
    program = f"""import sys; sys.path[:0] = [{str(ROOT / "datasets" / name)!r}, {str(ROOT / "datasets")!r}]
import make
from strip_more import drawn_runs, speed
fastest = max(speed(make.TANK, run) for run in make.TANK.runs)
drawn = drawn_runs(make.TANK, 20)
assert 0 < max(speed(make.TANK, run) for run in drawn) <= fastest
assert drawn_runs(make.TANK, 3) == drawn[:3]"""
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, check=False).returncode == 0
