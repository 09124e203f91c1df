"""Each planted fault is found under its own name and no other; a healthy campaign and good real recordings raise no alarm."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planted import LINKS, Columns, Fault, campaign, healthy, recording, the_arm

from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.recordings.checks import CHECKS
from nnhydro.recordings.checks.oddity import Oddity
from nnhydro.recordings.checks.quantisation import step_of
from nnhydro.recordings.checks.wrapped_angles import wraps
from nnhydro.recordings.recording import SteadyTable
from nnhydro.recordings.repeats import copied_recordings
from nnhydro.recordings.survey import survey
from nnhydro.report.survey_table import verdict

ROOT = Path(__file__).resolve().parents[4]
SHARED = ROOT.parent / "shared" / "data"


def found(c: Campaign) -> set[str]:
    return {oddity.check for oddity in survey(c).oddities}


def with_value(name: str, rows: object, value: float) -> Fault:
    def fault(c: Columns) -> Mapping[str, np.ndarray]:
        x = c[name].copy()
        x[rows] = value
        return {name: x}

    return fault


def scaled(factor: float, *names: str) -> Fault:
    return lambda c: {name: factor * c[name] for name in names}


def clipped(name: str, share: float) -> Fault:
    return lambda c: {name: np.clip(c[name], share * c[name].min(), share * c[name].max())}


def frozen(name: str, start: int, stop: int) -> Fault:
    def fault(c: Columns) -> Mapping[str, np.ndarray]:
        x = c[name].copy()
        x[start:stop] = x[start]
        return {name: x}

    return fault


def backward(c: Columns) -> Mapping[str, np.ndarray]:
    t = c["t_s"].copy()
    t[500:] -= 1.0
    return {"t_s": t}


def gap(c: Columns) -> Mapping[str, np.ndarray]:
    return {name: np.delete(x, np.s_[400:430]) for name, x in c.items()}


def lost(c: Columns) -> Mapping[str, np.ndarray]:
    kept = np.random.default_rng(2).uniform(size=len(c["t_s"])) > 0.02
    return {name: x[kept] for name, x in c.items()}


def jittery(c: Columns) -> Mapping[str, np.ndarray]:
    t = c["t_s"] + 0.002 * np.random.default_rng(1).uniform(-1, 1, len(c["t_s"]))
    return {name: np.interp(t, c["t_s"], x) if name != "t_s" else t for name, x in c.items()}


def too_slow(c: Columns) -> Mapping[str, np.ndarray]:
    t = c["t_s"][::9]
    w = 2 * np.pi * 2.5
    return {name: x[::9] for name, x in c.items()} | {"q1_rad": 0.5 - 0.5 * np.cos(w * t), "dq1_rad_s": 0.5 * w * np.sin(w * t)}


def glitch(c: Columns) -> Mapping[str, np.ndarray]:
    q = c["q2_rad"].copy()
    q[333] += 0.1
    return {"q2_rad": q}


def differences(c: Columns) -> Mapping[str, np.ndarray]:
    return {f"d{name}_s": np.diff(c[name], prepend=c[name][0]) / np.diff(c["t_s"], prepend=-c["t_s"][1]) for name in ("q1_rad", "q2_rad")}


def coarse(c: Columns) -> Mapping[str, np.ndarray]:
    return {"tau2_Nm": np.round(c["tau2_Nm"] / 0.05) * 0.05}


FAULTS: dict[str, tuple[Fault, str]] = {
    "time repeats": (with_value("t_s", 500, 4.99), "time_order"),
    "time runs backward": (backward, "time_order"),
    "time in ms": (scaled(1e3, "t_s"), "time_unit"),
    "time in us": (scaled(1e6, "t_s"), "time_unit"),
    "empty cells": (with_value("tau1_Nm", slice(300, 310), np.nan), "not_finite"),
    "an infinity": (with_value("q1_rad", 300, np.inf), "not_finite"),
    "a gap": (gap, "gaps"),
    "nothing left": (with_value("tau2_Nm", slice(None, None, 2), np.nan), "not_finite too_short"),
    "jitter": (jittery, "jitter"),
    "single rows lost": (lost, "lost_rows"),
    "angles in degrees, rates too": (scaled(180 / np.pi, "q1_rad", "q2_rad", "dq1_rad_s", "dq2_rad_s"), "degrees"),
    "angles in degrees": (scaled(180 / np.pi, "q1_rad", "q2_rad"), "degrees"),
    "small angles in degrees": (lambda c: {"q1_rad": 18 / np.pi * c["q1_rad"], "dq1_rad_s": 0.1 * c["dq1_rad_s"]}, "rates"),
    "rates in deg/s": (scaled(180 / np.pi, "dq1_rad_s"), "rates"),
    "rates in rpm": (scaled(60 / (2 * np.pi), "dq2_rad_s"), "rates"),
    "rates of the wrong sign": (scaled(-1.0, "dq1_rad_s"), "rates"),
    "rates at the motor": (scaled(6.0, "dq1_rad_s"), "rates"),
    "rates of the other joint": (lambda c: {"dq1_rad_s": c["dq2_rad_s"], "dq2_rad_s": c["dq1_rad_s"]}, "rates"),
    "rates that a logger left at 0": (scaled(0.0, "dq1_rad_s", "dq2_rad_s"), "rates"),
    "rates by differences": (differences, "rates"),
    "torque clipped": (clipped("tau1_Nm", 0.6), "clipped"),
    "angle clipped": (clipped("q1_rad", 0.7), "clipped"),
    "encoder stuck, then jumps": (frozen("q1_rad", 150, 200), "stuck_encoder"),
    "encoder stuck for good": (frozen("q2_rad", 700, 1000), "stuck_encoder"),
    "torque stuck": (frozen("tau1_Nm", 150, 300), "stuck_torque"),
    "dead torque": (scaled(0.0, "tau2_Nm"), "stuck_torque"),
    "one bad row": (glitch, "glitch"),
    "coarse torque": (coarse, "quantisation"),
    "slow sampling": (too_slow, "slow_sampling"),
    "an angle that begins again after a turn": (lambda c: {"q1_rad": (6 * c["q1_rad"]) % (2 * np.pi), "dq1_rad_s": 6 * c["dq1_rad_s"]},
                                                "wrapped"),
    "carriage given but at rest": (lambda c: {"u0_m_s": 0 * c["t_s"]}, "carriage_at_rest"),
    "clock backward": (lambda c: {"clock_s": 5000 - c["t_s"]}, "clock_course clock_order"),
    "clock too fast": (lambda c: {"clock_s": 5000 + 2 * c["t_s"]}, "clock_course clock_order"),
}


def test_every_check_carries_a_complete_card():
    assert len(CHECKS) >= 20
    for name, check in CHECKS.items():
        assert name == check.id
        assert check.looks_for
        assert check.remedy
        assert check.__doc__


def test_a_healthy_campaign_raises_no_alarm():
    assert found(campaign()) == set()


def test_a_healthy_campaign_without_rates_raises_no_alarm():
    runs = [recording({k: x for k, x in healthy(n).items() if not k.startswith("dq")}, f"r{n}") for n in (1, 2)]
    assert found(Campaign.of(the_arm(), runs)) == set()


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_found_under_its_own_name_and_no_other(name: str):
    fault, expected = FAULTS[name]
    assert found(campaign(fault)) == set(expected.split())


@pytest.mark.parametrize("name", ["encoder stuck, then jumps", "encoder stuck for good", "angle clipped", "one bad row"])
def test_angle_faults_are_found_without_rates_too(name: str):
    fault, expected = FAULTS[name]
    columns = {k: x for k, x in {**healthy(1), **fault(healthy(1))}.items() if not k.startswith("dq")}
    assert found(Campaign.of(the_arm(), [recording(columns)])) == {expected}


@pytest.mark.parametrize(("names", "accused"), [(("tau1_Nm", "tau2_Nm"), 2), (("tau1_Nm",), 1)])
def test_torques_of_the_wrong_sign_gain_energy_from_the_water(names: tuple[str, ...], accused: int):
    oddities = survey(campaign(scaled(-1.0, *names), in_all=True)).oddities
    assert [o.check for o in oddities] == ["torque_sign"] * accused
    assert {o.where for o in oddities} == set(names)
    assert "sign: -1" in oddities[0].remedy


def test_a_joint_that_takes_the_work_of_another_has_no_wrong_sign():
    """In a coupled arm, one joint may give energy in every recording: only the sum over the joints says anything of the water."""
    outer_is_driven = campaign(lambda c: {"tau2_Nm": -0.5 * c["dq2_rad_s"]}, in_all=True)
    assert "torque_sign" not in found(outer_is_driven)


def test_a_locked_joint_is_only_worth_a_note():
    def locked(c: Columns) -> Mapping[str, np.ndarray]:
        return {"q2_rad": np.full(len(c["t_s"]), 0.3), "dq2_rad_s": 0 * c["t_s"]}

    oddities = survey(campaign(locked)).oddities
    assert [(o.check, o.severity) for o in oddities] == [("never_moves", "note")]


def test_lost_rows_are_counted_and_no_jitter():
    kept = np.setdiff1d(np.arange(1000), [100, 300, 301, 500])
    one = recording({name: x[kept] for name, x in healthy(1).items()}, "r1")
    oddities = survey(Campaign.of(the_arm(), [one, recording(healthy(2), "r2")]))
    assert [(o.check, o.severity, o.what) for o in oddities.oddities] == [("lost_rows", "note", "4 single row(s) missing, 0.4% of all")]
    assert oddities.entries[0].jitter < 1e-6


def test_a_stated_unit_of_the_time_is_taken_as_given():
    slow = recording({**{name: x[::10] for name, x in healthy(1).items()}, "t_s": np.arange(100.0)})
    stated = replace(slow, origin=replace(slow.origin, stated={"t_s": "s"}))
    found_of = [{o.check for o in survey(Campaign.of(the_arm(), [r])).oddities} for r in (slow, stated)]
    assert "time_unit" in found_of[0]
    assert "time_unit" not in found_of[1]


@pytest.mark.parametrize(("length", "diameter", "mass", "remedy"), [
    (0.6, 8.0, 4.2, "is the diameter in cm? Write diameter_m: 0.08"), (0.6, 8.0, 0.05, "is the diameter in mm? Write diameter_m: 0.008"),
    (0.08, 0.6, 1.0, "are the two exchanged?"), (0.5, 0.6, 140.0, "are the two exchanged, or in cm or mm? Loads on so short a body are ")])
def test_the_mass_of_a_link_says_in_which_unit_its_diameter_is(length: float, diameter: float, mass: float, remedy: str):
    link = {"length_m": length, "diameter_m": diameter, "mass_kg": mass, "com_m": length / 2, "inertia_kg_m2": 0.01}
    found = survey(campaign(arm=the_arm(links=(link, LINKS[1])))).oddities
    assert next(o.remedy for o in found if o.check == "stubby").startswith(remedy)


def test_in_air_a_drum_may_be_shorter_than_it_is_wide():
    short = tuple(link.model_copy(update={"diameter_m": 2 * link.length_m}) for link in the_arm().links)
    drums = [the_arm().model_copy(update={"links": short, "fluid": the_arm().fluid.model_copy(update={"density_kg_m3": density})})
             for density in (0.0, 1000.0)]
    said = [{o.check for o in survey(Campaign.of(drum, [recording(healthy(1))])).oddities} for drum in drums]
    assert "stubby" not in said[0]
    assert "stubby" in said[1]


def test_a_shaft_that_was_read_once_a_turn_does_not_begin_again():
    assert wraps(2 * np.pi * np.arange(20), 2 * np.pi) == []
    assert wraps(np.arange(0, 20, 0.5) % (2 * np.pi), 2 * np.pi) == [12, 25, 37]


def test_a_gap_asks_for_nothing():
    oddities = survey(campaign(gap))
    assert [o.severity for o in oddities.oddities] == ["note"]
    assert verdict(oddities) == "Usable: nothing looks wrong (1 note)."


def test_a_copy_with_fewer_digits_is_one_where_a_torque_cell_is_empty_too():
    c = healthy(1) | {"tau1_Nm": np.where(np.arange(1000) == 500, np.nan, healthy(1)["tau1_Nm"])}
    c["tau2_Nm"] = np.where(np.arange(1000) == 400, np.nan, c["tau2_Nm"])
    runs = [recording(c, "r0"), recording({name: np.round(x, 6) for name, x in c.items()}, "r1")]
    assert copied_recordings(Campaign.of(the_arm(), runs)) == (("r0", "r1"),)


def test_free_swings_from_one_angle_are_no_copies():
    def swing(release: float) -> dict[str, np.ndarray]:
        q = np.round(release * np.cos(3 * np.arange(1000) / 100) / 0.01) * 0.01
        return {"t_s": np.arange(1000) / 100, "q1_rad": q, "q2_rad": 0 * q, "tau1_Nm": 0 * q, "tau2_Nm": 0 * q}

    runs = [recording(swing(release), f"r{i}") for i, release in enumerate((1.0, 1.001, 1.0))]
    assert copied_recordings(Campaign.of(the_arm(), runs)) == (("r0", "r2"),)


def test_a_pause_at_the_largest_angle_is_not_clipped():
    t = np.arange(1000) / 100
    s = np.clip(t / 3, 0, 1) - np.clip((t - 6) / 3, 0, 1)
    q = 10 * s**3 - 15 * s**4 + 6 * s**5
    rate = np.gradient(q, t)
    columns = {"t_s": t, "q1_rad": q, "q2_rad": 0.5 * q, "tau1_Nm": 4 * rate * np.abs(rate) + np.gradient(rate, t),
               "tau2_Nm": rate * np.abs(rate) + 0.2 * np.gradient(rate, t)}
    assert found(Campaign.of(the_arm(), [recording(columns)])) == set()


@pytest.mark.parametrize(("rate", "expected"), [(0.0, False), (1.0, True)])
def test_a_joint_whose_own_rate_says_that_it_stands_still_is_not_clipped(rate: float, expected: bool):
    columns = healthy(1)
    flat = clipped("q1_rad", 0.7)(columns)["q1_rad"]
    held = flat == flat.max()
    columns |= {"q1_rad": flat, "dq1_rad_s": np.where(held, rate, 1.0) * columns["dq1_rad_s"]}
    assert ("clipped" in found(Campaign.of(the_arm(), [recording(columns)]))) == expected


@pytest.mark.parametrize(("speed", "expected"), [(lambda t: 1 + 0.01 * np.sin(40 * t), False), (lambda t: 1 + 0.8 * np.sin(3 * t), True)])
def test_a_joint_at_one_speed_has_no_coarse_encoder(speed, expected):
    t = np.arange(200) / 100
    q = np.cumsum(speed(t)) / 100
    q = q if not expected else np.round(q / 0.01) * 0.01
    reading = recording({**healthy(1, rows=200), "q1_rad": q})
    assert (step_of(reading.q[:, 0]) > 0) == expected


@pytest.mark.parametrize(("key", "value", "expected"), [("length_m", 0.05, "stubby mass_centre inertia"), ("com_m", 0.7, "mass_centre"),
                                                        ("com_m", -0.3, "mass_centre"), ("inertia_kg_m2", 0.2, "inertia")])
def test_an_impossible_arm_is_pointed_out(key: str, value: float, expected: str):
    arm = the_arm(links=({**LINKS[0], key: value}, LINKS[1]))
    assert found(campaign(arm=arm)) == set(expected.split())


@pytest.mark.parametrize(("gravity", "density", "expected"), [(9.81, 1000.0, {"buoyancy"}), (9.81, 1.2, set()), (0.0, 1000.0, set())])
def test_buoyancy_counts_where_an_upright_arm_is_under_water(gravity: float, density: float, expected: set[str]):
    upright = the_arm(gravity_m_s2=gravity, fluid={"density_kg_m3": density})
    oddities = [o for o in survey(campaign(arm=upright)).oddities if o.check == "buoyancy"]
    assert {o.check for o in oddities} == expected
    assert all(o.severity == "note" for o in oddities)


def steady(sign: float, q_factor: float = 1.0) -> Campaign:
    q1, u0 = (x.ravel() for x in np.meshgrid(np.linspace(-1.2, 1.2, 9), [0.3, 0.6, 1.0]))
    q = np.column_stack([q1, 0.3 + 0 * q1])
    w = u0 * np.cos(q.sum(axis=1))
    tau = sign * np.column_stack([3 * w * np.abs(w), w * np.abs(w)])
    table = SteadyTable("tow", tuple(map(str, range(len(q1)))), q * q_factor, 0 * q, u0, tau)
    return Campaign.of(the_arm(), [], (table,))


@pytest.mark.parametrize(("sign", "q_factor", "expected"),
                         [(1, 1, ""), (-1, 1, "torque_sign_in_table"), (1, 180 / np.pi, "degrees_in_table")])
def test_steady_tables_are_looked_over(sign: float, q_factor: float, expected: str):
    assert {o.check for o in survey(steady(sign, q_factor)).oddities} == set(expected.split())


def test_repeats_with_a_random_load_are_reported_as_scatter():
    runs = []
    for number in range(4):
        columns = healthy(1)
        wind = np.random.default_rng(number).uniform(-3, 3)
        columns["tau2_Nm"] = columns["tau2_Nm"] * wind
        runs.append(recording(columns, f"r{number}"))
    oddities = survey(Campaign.of(the_arm(), runs)).oddities
    assert "repeats_scatter" in {o.check for o in oddities}
    assert "do not fit it" in next(o for o in oddities if o.check == "repeats_scatter").remedy


def test_recordings_that_overlap_in_time_of_day_are_reported():
    runs = [recording({**healthy(n), "clock_s": 1000 + 5 * n + healthy(n)["t_s"]}, f"r{n}") for n in (1, 2)]
    assert found(Campaign.of(the_arm(), runs)) == {"clock_order"}


@pytest.mark.parametrize("folder", ["rivera_tank", "mclain_tank"])
def test_the_synthetic_tanks_raise_no_warning(folder: str):
    path = ROOT / "datasets" / folder
    if not path.is_dir():
        pytest.skip(f"{path} is not here: the data sets travel with the source tree, not with the wheel")
    assert [o.message for o in survey(open_campaign(path)).oddities if o.severity != "note"] == []


def real(folder: str) -> tuple[Oddity, ...]:
    path = SHARED / folder
    if not path.is_dir():
        pytest.skip(f"{path} is not here: the real recordings lie beside the repository, not in it")
    return survey(open_campaign(path)).oddities


@pytest.mark.parametrize("folder", ["dfki_double_pendulum_a0", "cfd_cylinder"])
def test_good_recordings_raise_no_warning(folder: str):
    assert [o.message for o in real(folder) if o.severity != "note"] == []


def test_late_samples_and_noisy_drive_rates_of_the_real_arm_are_found():
    oddities = real("dfki_double_pendulum_c0")
    assert {o.check for o in oddities if o.severity == "warning"} == {"glitch"}
    assert {"rates", "jitter", "lost_rows", "quantisation", "mass_centre"} == {o.check for o in oddities if o.severity == "note"}
    assert "20220914_traj01" in {o.recording for o in oddities if o.check == "glitch"}


ROWS = st.integers(4, 60)
KIND = st.sampled_from(["zero", "constant", "ramp", "noise", "huge", "steps", "holes", "nearly empty", "infinite"])


def channel(kind: str, n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(n)
    return {"zero": 0 * x, "constant": 0 * x + 0.3, "ramp": np.linspace(-1, 1, n), "noise": x, "huge": 1e9 * x, "steps": np.round(x),
            "holes": np.where(x > 0, x, np.nan), "nearly empty": np.where(np.arange(n) == n // 2, x, np.nan),
            "infinite": np.where(x > 1, np.inf, x)}[kind]


@settings(max_examples=60, derandomize=True, deadline=None)
@given(ROWS, st.lists(KIND, min_size=10, max_size=10), st.integers(0, 99), st.sampled_from([1e-6, 0.01, 1.0, 1e4]))
def test_any_numbers_can_be_looked_over(n: int, kinds: list[str], seed: int, step: float):
    names = ("q1_rad", "q2_rad", "dq1_rad_s", "dq2_rad_s", "tau1_Nm", "tau2_Nm", "u0_m_s", "clock_s")
    columns = {name: channel(kind, n, seed + i) for i, (name, kind) in enumerate(zip(names, kinds, strict=False))}
    t = channel(kinds[9], n, seed) if kinds[8] == "noise" else step * np.arange(n)
    both = [recording({**columns, "t_s": t}, "a"), recording({**columns, "t_s": t}, "b")]
    for oddity in survey(Campaign.of(the_arm(), both)).oddities:
        assert oddity.message
        assert oddity.severity in ("error", "warning", "note")


def test_torques_of_exactly_0_are_a_note_for_a_machine_that_nothing_drives_and_a_dead_channel_is_a_warning():
    def severities(*names: str) -> set[str]:
        return {o.severity for o in survey(campaign(scaled(0.0, *names), in_all=True)).oddities if o.check == "stuck_torque"}

    assert severities("tau1_Nm", "tau2_Nm") == {"note"}
    assert severities("tau2_Nm") == {"warning"}


def test_a_torque_held_in_a_whole_recording_is_a_command_until_the_user_says_otherwise():
    def held(c: Columns) -> Mapping[str, np.ndarray]:
        return {"tau1_Nm": np.full_like(c["tau1_Nm"], 0.5)}

    oddity = next(o for o in survey(campaign(held, in_all=True)).oddities if o.check == "constant_torque")
    assert oddity.severity == "note"
    assert "command to the drive" in oddity.message


def test_a_torque_held_in_one_recording_and_measured_in_the_others_is_a_dead_channel():
    def held(c: Columns) -> Mapping[str, np.ndarray]:
        return {"tau1_Nm": np.full_like(c["tau1_Nm"], 0.5)}

    (oddity,) = (o for o in survey(campaign(held)).oddities if o.check in ("stuck_torque", "constant_torque"))
    assert (oddity.severity, oddity.recording, oddity.where) == ("warning", "run1", "tau1_Nm")
    assert "changes from row to row in 2 of 2 others" in oddity.what


def test_a_voltage_held_in_one_recording_and_switched_in_the_others_is_a_command():
    runs = []
    for number, rows in ((1, 1000), (2, 200), (3, 100)):
        columns = healthy(number)
        runs.append(recording({**columns, "tau1_Nm": 0.5 + 0.25 * (np.arange(len(columns["t_s"])) // rows % 2)}, f"run{number}"))
    assert {o.severity for o in survey(Campaign.of(the_arm(), runs)).oddities if o.check == "constant_torque"} == {"note"}


@pytest.mark.parametrize(("every", "severity"), [(7, "note"), (1, "warning")], ids=["a switched voltage", "a sensor"])
def test_a_torque_that_switches_between_values_is_a_command_and_one_that_changes_from_row_to_row_is_not(every: int, severity: str):
    def held(c: Columns) -> Mapping[str, np.ndarray]:
        x = np.random.default_rng(1).choice([-0.5, 0.5, 0.25], len(c["t_s"]))[np.arange(len(c["t_s"])) // every]
        x[151:300] = 0.4
        return {"tau1_Nm": x}

    oddity = next(o for o in survey(campaign(held)).oddities if o.check == "stuck_torque")
    assert oddity.severity == severity
    assert ("command to the drive" in oddity.message) is (severity == "note")


@pytest.mark.parametrize(("after", "said"), [(0.25, False), (0.5, True)], ids=["by one of its steps", "by more"])
def test_a_coarse_torque_that_goes_on_by_one_of_its_steps_is_not_stuck(after: float, said: bool):
    def held(c: Columns) -> Mapping[str, np.ndarray]:
        x = 0.25 * (np.arange(len(c["t_s"])) % 5)
        x[151:300], x[300] = x[150], x[150] + after
        return {"tau1_Nm": x}

    assert ("stuck_torque" in found(campaign(held))) is said


def test_torques_that_no_drive_can_feel_are_asked_for_their_unit():
    oddity = next(o for o in survey(campaign(scaled(1e-10, "tau1_Nm", "tau2_Nm"), in_all=True)).oddities if o.check == "tiny_torque")
    assert oddity.severity == "warning"
    assert "N m" in oddity.message
    assert "unit" in oddity.message
    assert "tiny_torque" not in found(campaign())


@pytest.mark.parametrize(("drive", "said"), [({"kind": "remote"}, True), ({"kind": "remote", "angle2": "absolute"}, False),
                                             ("direct", False)])
def test_a_belt_whose_outer_angle_may_be_absolute_gets_a_note(drive, said):
    oddities = [o for o in survey(campaign(arm=the_arm(drive=drive))).oddities if o.check == "belt_angle"]
    assert len(oddities) == int(said)
    assert all(o.severity == "note" and "angle2: absolute" in o.message for o in oddities)
