"""Machines as others have them, each law written here anew: a servo axis, a robot's joint, a motor, a hull, a section in waves.

    F = M a + F_v v + F_c sgn(v) + F_0                          a ball screw (numbers as on the EMPS: Janot, Gautier & Brunot 2019)
    tau = J qdd + F_v qd + F_c sgn(qd)                          a joint that turns in the horizontal plane, both frictions alike
    tau = J qdd + m g c cos(q) + F_c sgn(qd) + T cos(14 q)      a pendulum on a motor with magnets
    0 = J qdd + m g c cos(q) + b qd                             a hull that rolls out
    0 = J qdd + m g c cos(q) + b |qd| qd + k (q - q_0)          a rod on a cable
    0 = J qdd + F_c sgn(qd) + b |qd| qd                         a fan wheel that coasts
    0 = (J + J_r) qdd + m g c cos(q) + F_c sgn(qd)              a servo that falls without power
    tau = C_M rho A L du/dt L/2 + drag                          a section that is held in a wave
"""

import numpy as np
import pandas as pd
import pytest
import yaml

import nnhydro
from nnhydro.diagnosis.diagnose import diagnose

AIR = {"density_kg_m3": 0.0, "kinematic_viscosity_m2_s": 1e-6}
THIN = {"density_kg_m3": 1.2, "kinematic_viscosity_m2_s": 1.5e-5}
WATER = {"density_kg_m3": 1000.0, "kinematic_viscosity_m2_s": 1e-6}


def motion(seed, t, most, slowest):
    """Angle, rate and acceleration of five sines from 1 to 5 times `slowest`, Hz."""
    rng = np.random.default_rng(seed)
    q, qd, qdd = np.zeros((3, len(t)))
    for k in range(1, 6):
        w, phase, size = 2 * np.pi * slowest * k, rng.uniform(0, 2 * np.pi), most * rng.uniform(0.3, 1.0) / k
        q, qd, qdd = q + size * np.sin(w * t + phase), qd + size * w * np.cos(w * t + phase), qdd - size * w**2 * np.sin(w * t + phase)
    return q, qd, qdd


def noise(seed, t, size):
    """White noise."""
    return size * np.random.default_rng([seed, 1]).standard_normal(len(t))


def ball_screw(seed):
    """A linear axis, its place alone recorded."""
    t = np.arange(0, 12, 0.002)
    x, v, a = motion(seed, t, 0.1, 0.15)
    force = 95.1 * a + 203.5 * v + 20.4 * np.sign(v) - 3.2
    return {"t_s": t, "q1_m": np.round(x / 1e-6) * 1e-6, "tau1_N": force + noise(seed, t, 2.0)}


def robot_joint(seed):
    """The first joint of a robot."""
    t = np.arange(0, 16, 0.005)
    q, qd, qdd = motion(seed, t, 0.5, 0.1)
    torque = 10.5 * qdd + 22 * qd + 14.0 * np.sign(qd)
    return {"t_s": t, "q1_rad": np.round(q / 2e-5) * 2e-5, "tau1_Nm": torque + noise(seed, t, 0.5)}


def cogging_motor(seed):
    """A pendulum on a direct drive."""
    t = np.arange(0, 12, 0.005)
    q, qd, qdd = motion(seed, t, 1.0, 0.15)
    q = q - np.pi / 2
    torque = 0.5 * 0.25 * qdd + 0.5 * 9.81 * 0.5 * np.cos(q) + 0.06 * np.sign(qd) + 0.05 * np.cos(14 * q)
    return {"t_s": t, "q1_rad": q + noise(seed, t, 2e-4), "tau1_Nm": torque + noise(seed + 1, t, 0.02)}


def rolling_hull(seed):
    """A roll decay: no torque at all."""
    from scipy.integrate import solve_ivp

    t, start = np.arange(0, 15, 0.02), (0.05 + 0.03 * seed) * (-1) ** seed
    roll = solve_ivp(lambda _, y: [y[1], (-822.0 * np.sin(y[0]) - 9.0 * y[1]) / 134.0], (0, 15), [start, 0.0], t_eval=t, rtol=1e-9)
    return {"t_s": t, "q1_rad": roll.y[0] - np.pi / 2 + noise(seed, t, 1e-4), "tau1_Nm": 0 * t}


def section_in_waves(seed):
    """A vertical cylinder that is held in a wave of 0.965 Hz."""
    t = np.arange(0, 25, 0.02)
    w, phase = 2 * np.pi * 0.965, 2.0 * seed
    u, rate = 0.12 * np.cos(w * t + phase), -0.12 * w * np.sin(w * t + phase)
    area, length = np.pi / 4 * 0.1**2, 0.6
    torque = (2.0 * 1000 * area * rate + 0.5 * 1000 * 1.1 * 0.1 * u * np.abs(u)) * length**2 / 2
    return {"t_s": t, "q1_rad": noise(seed, t, 1e-5) - np.pi / 2, "tau1_Nm": torque + noise(seed + 1, t, 0.02)}


def screw_in_trapezoids(seed):
    """The same axis to and fro at constant speeds with short accelerations and pauses."""
    t, speed, slope = np.arange(0, 25, 0.002), 0.10 + 0.03 * seed, 0.5 + 0.2 * seed
    once = np.arange(0, 1.5, 0.002)
    way = np.concatenate([np.minimum(1.0, np.minimum(once, 1.5 - once) * slope / speed), np.zeros(200)])
    v = speed * np.resize(np.concatenate([way, -way]), len(t))
    x, a = np.cumsum(v) * 0.002, np.gradient(v, t)
    force = 95.0 * a + 203.0 * v + 20.0 * np.tanh(v / 1e-3)
    return {"t_s": t, "q1_m": np.round(x / 2e-7) * 2e-7, "tau1_N": force + noise(seed, t, 1.5)}


def rubbing_pendulum(seed):
    """A free pendulum in air whose bearing rubs dry, seen by a camera: its friction shows in the third harmonic of its swing."""
    from scipy.integrate import solve_ivp

    t = np.arange(0, 20, 0.01)
    def slope(_, y):
        return [y[1], -(0.8 * 9.81 * 0.3 * np.sin(y[0]) + 0.03 * np.tanh(y[1] / 0.005)) / (0.0195 + 0.8 * 0.3**2)]

    swing = solve_ivp(slope, (0, 20), [0.8 + 0.2 * seed, 0.0], t_eval=t, rtol=1e-8)
    return {"t_s": t, "q1_rad": swing.y[0] - np.pi / 2 + noise(seed, t, 1e-3), "tau1_Nm": 0 * t}


def rolling_in_view_of_a_camera(seed):
    """A roll decay with nothing but quadratic drag, its angle as noisy as a camera's."""
    from scipy.integrate import solve_ivp

    t = np.arange(0, 30, 0.05)
    drag = 1000.0 * 1.1 * 0.12 * 0.35**4 / 8
    def slope(_, y):
        return [y[1], -(70.0 * 9.81 * 0.04 * np.sin(y[0]) + drag * abs(y[1]) * y[1]) / 3.0]

    roll = solve_ivp(slope, (0, 30), [0.3 + 0.05 * seed, 0.0], t_eval=t, rtol=1e-9)
    return {"t_s": t, "q1_rad": roll.y[0] - np.pi / 2 + noise(seed, t, 1.5e-3), "tau1_Nm": 0 * t}


def rod_on_a_cable(seed):
    """A rod that swings in water, an instrument cable across its pivot: a spring that is slack 0.1 rad from hanging."""
    from scipy.integrate import solve_ivp

    t = np.arange(0, 12, 0.01)
    drag, added = 1000.0 * 1.1 * 0.06 * 0.5**4 / 8, 1000.0 * 0.9 * np.pi / 4 * 0.06**2 * 0.5**3 / 3
    def slope(_, y):
        return [y[1], -(3.2 * 9.81 * 0.33 * np.sin(y[0]) + 2.0 * (y[0] - 0.1) + drag * abs(y[1]) * y[1]) / (0.055 + 3.2 * 0.33**2 + added)]

    swing = solve_ivp(slope, (0, 12), [(1.3 - 0.2 * seed) * (-1) ** seed, 0.0], t_eval=t, rtol=1e-9)
    return {"t_s": t, "q1_rad": swing.y[0] - np.pi / 2 + noise(seed, t, 4e-4), "tau1_Nm": 0 * t}


def coasting(seed, rubbing):
    """A fan wheel of 10 kg m^2 that coasts in air, read at every eighth of a turn."""
    from scipy.integrate import solve_ivp

    drag = 1.2 * 1.5 * 0.3 * 0.75**4 / 8
    run = solve_ivp(lambda _, y: [y[1], -(rubbing * np.tanh(y[1] / 1e-3) + drag * abs(y[1]) * y[1]) / 10.0], (0, 50),
                    [0.0, 5.0 + 0.6 * seed], rtol=1e-10, dense_output=True)
    t = np.arange(0, 50, 0.002)
    q = run.sol(t)[0]
    steps = np.arange(0, q[-1], np.pi / 4)
    t = np.interp(steps, q, t)
    return {"t_s": t, "q1_rad": steps + noise(seed, t, 2e-3), "tau1_Nm": 0 * t}


def fan_wheel(seed):
    """The wheel on dry bearings."""
    return coasting(seed, 0.13)


def fan_wheel_on_good_bearings(seed):
    """The wheel with its drag alone: any other law would only share the inertia's torque with it."""
    return coasting(seed, 0.0)


def falling_servo(seed):
    """A bar on a servo without power falls from various heights: the rotor and the friction of its gear hold it up."""
    from scipy.integrate import solve_ivp

    t = np.arange(0, 1.2, 0.005)
    def slope(_, y):
        return [y[1], -(0.6 * 9.81 * 0.125 * np.cos(y[0]) + 0.16 * np.tanh(y[1] / 0.005)) / (0.0036 + 0.6 * 0.125**2 + 0.0078)]

    fall = solve_ivp(slope, (0, 1.2), [(-0.3 + 0.15 * seed) * (-1) ** seed + np.pi * (seed % 2), 0.0], t_eval=t, rtol=1e-8)
    return {"t_s": t, "q1_rad": np.round(fall.y[0] / (2 * np.pi / 4096)) * (2 * np.pi / 4096), "tau1_Nm": 0 * t}


def link(**keys):
    """A link's document."""
    return {"length_m": 0.5, "diameter_m": 0.1} | keys


MACHINES = {
    ball_screw: (AIR, {"joints": [{"type": "prismatic"}]}, link(mass_kg=95.0, known_to=0.1),
                 {"viscous_friction": 203.5, "coulomb_friction": 20.4, "torque_bias": -3.2}),
    screw_in_trapezoids: (AIR, {"joints": [{"type": "prismatic"}]}, link(mass_kg=96.5, known_to=0.05),
                          {"viscous_friction": 203.0, "coulomb_friction": 20.0}),
    rubbing_pendulum: (AIR, {}, link(mass_kg=0.8, com_m=0.3, inertia_kg_m2=0.0195, known_to=0.02), {"coulomb_friction": 0.03}),
    robot_joint: (AIR, {"gravity_m_s2": 0.0}, link(mass_kg=30.0, com_m=0.5, inertia_kg_m2=3.0, known_to=0.1),
                  {"viscous_friction": 22.0, "coulomb_friction": 14.0}),
    cogging_motor: (AIR, {}, link(mass_kg=0.5, com_m=0.5, inertia_kg_m2=5e-4, known_to=0.1),
                    {"coulomb_friction": 0.06, "torque_ripple": 0.05}),
    rolling_hull: (WATER, {}, {"length_m": 0.4265, "diameter_m": 0.306, "mass_kg": 994.34, "com_m": 0.0842647, "inertia_kg_m2": 108.68,
                               "known_to": 0.02}, {"viscous_friction": 9.0}),
    rolling_in_view_of_a_camera: (WATER, {}, {"length_m": 0.35, "diameter_m": 0.12, "mass_kg": 70.0, "com_m": 0.04, "inertia_kg_m2": 2.77,
                                              "known_to": 0.02}, {}),
    rod_on_a_cable: (WATER, {}, link(diameter_m=0.06, mass_kg=3.2, com_m=0.33, inertia_kg_m2=0.055, known_to=0.005),
                     {"umbilical_stiffness": 2.0}),
    fan_wheel: (THIN, {"gravity_m_s2": 0.0}, {"length_m": 0.75, "diameter_m": 0.3, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 10.0,
                                              "known_to": 0.05}, {"coulomb_friction": 0.13}),
    fan_wheel_on_good_bearings: (THIN, {"gravity_m_s2": 0.0}, {"length_m": 0.75, "diameter_m": 0.3, "mass_kg": 0.0, "com_m": 0.0,
                                                               "inertia_kg_m2": 10.0, "known_to": 0.05}, {}),
    falling_servo: (AIR, {}, {"length_m": 0.25, "diameter_m": 0.03, "mass_kg": 0.6, "com_m": 0.125, "inertia_kg_m2": 0.0036,
                              "known_to": 0.03}, {"coulomb_friction": 0.16, "rotor_inertia": 0.0078}),
    section_in_waves: (WATER, {}, {"length_m": 0.6, "diameter_m": 0.1, "mass_kg": 5.0, "com_m": 0.3, "inertia_kg_m2": 0.15},
                       {"wave_orbital": 0.12}),
}


@pytest.fixture(params=MACHINES, ids=lambda recorded: recorded.__name__)
def machine(request, tmp_path):
    """A campaign of four or five recordings as a user would have it, and what is hidden."""
    fluid, keys, part, hidden = MACHINES[request.param]
    (tmp_path / "recordings").mkdir()
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump({"schema": "nnhydro/arm/1", "name": "a machine", "fluid": fluid, "links": [part],
                                                       "gravity_m_s2": 9.81, **keys}))
    for seed in range(5 if request.param is ball_screw else 4):  # whose offset is but one standard deviation of its noise
        pd.DataFrame(request.param(seed)).to_csv(tmp_path / "recordings" / f"r{seed}.csv", index=False)
    return tmp_path, hidden


@pytest.mark.slow
def test_what_loads_a_machine_is_named_with_its_size_and_nothing_else(machine):
    folder, hidden = machine
    found = {f.effect: next(iter(f.parameters.values())) for f in diagnose(nnhydro.load(folder)).findings}
    assert set(found) == set(hidden)
    for name, value in hidden.items():
        low, high = found[name].ci95
        assert low <= value <= high, name
        # of a wave that a held link meets only the part across it is known; of a spring on a free rod, what the weight does not imitate
        known = name not in ("wave_orbital", "umbilical_stiffness")
        assert high - low < 0.3 * abs(value) or not known, name


@pytest.mark.slow
def test_dry_friction_of_a_shaft_is_named_although_its_run_downs_repeat_each_other(tmp_path):
    """A shaft of 1e-3 kg m^2 runs down eight times alike: a smooth law learned from seven predicts the eighth as well as friction."""
    rng, dt = np.random.default_rng(1), 0.0125
    (tmp_path / "recordings").mkdir()
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump({"schema": "nnhydro/arm/1", "name": "a shaft", "fluid": AIR, "links": [
        {"length_m": 0.1, "diameter_m": 0.02, "mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 1e-3, "known_to": 0.2}]}))
    for run in range(8):
        w = [150.0 * (1 + 0.02 * rng.standard_normal())]
        while w[-1] > 20:  # 0.2 N m at rest, less at speed, and uneven
            w.append(w[-1] - dt / 20 * 0.2 * (1 + 0.1 * np.cos(w[-1] / 12) - 0.25 * w[-1] / 150) / 1e-3)
        speed = np.array(w[:-1:20])
        speed += rng.standard_normal(len(speed))
        q = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * dt)])
        pd.DataFrame({"t_s": np.arange(len(q)) * dt, "q1_rad": q, "dq1_rad_s": speed, "tau1_Nm": 0 * q}).to_csv(
            tmp_path / "recordings" / f"run{run}.csv", index=False)
    (friction,) = diagnose(nnhydro.load(tmp_path), "rigid").findings
    assert friction.effect == "coulomb_friction"


@pytest.mark.slow
def test_on_a_linear_axis_that_is_held_the_direction_of_a_wave_is_an_angle(tmp_path):
    """The section again, on a force gauge: its length and its force are in m and N, the direction of the wave in rad."""
    (tmp_path / "recordings").mkdir()
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump({
        "schema": "nnhydro/arm/1", "name": "a section", "fluid": WATER, "joints": [{"type": "prismatic"}],
        "links": [{"length_m": 0.6, "diameter_m": 0.1, "mass_kg": 5.0, "com_m": 0.3, "inertia_kg_m2": 0.15}]}))
    for seed in range(2):
        turning = section_in_waves(seed)
        held = {"t_s": turning["t_s"], "q1_m": noise(seed, turning["t_s"], 1e-5), "tau1_N": turning["tau1_Nm"] / 0.3}
        pd.DataFrame(held).to_csv(tmp_path / "recordings" / f"r{seed}.csv", index=False)
    (wave,) = diagnose(nnhydro.load(tmp_path)).findings
    assert wave.effect == "wave_orbital"
    assert wave.parameters["direction"].unit == "rad"
    assert "rad" in wave.statement
    assert " m from +X" not in wave.statement
