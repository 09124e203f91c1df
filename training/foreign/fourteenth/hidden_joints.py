"""Five campaigns with hidden effects of seals, hoses, rotors and sensors."""

from dataclasses import replace

import numpy as np
from campaign import Campaign, Effect, Outcome, Scene, Sensors
from curves import speeds
from machines import arm, tank_arm
from mechanics import at_joint, bare_torques, kinematics
from motions import Motion, fourier, slews, tow
from responses import lugre
from scipy.signal import bessel, lfilter


def law_of_sticking_seal(scene: Scene) -> Outcome:
    """LuGre's friction at joint 2."""
    sliding, state = 0.075, scene.state
    friction = lugre(state.dq[:, 1], state.dt, sliding, 2.1 * sliding, 0.09, 2.1 * sliding / 0.006, 0.6)
    return Outcome({"stribeck_friction": at_joint(state, 2, friction)})


def sticking_seal() -> Campaign:
    """A seal that sticks in slow reversals."""
    rng = np.random.default_rng(11)

    def slow() -> Motion:
        return fourier(rng, [rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)], [0.4, 0.35], 0.12, 14.0, terms=2, name="slow", low_hz=0.04)
    motions = [*(slow() for _ in range(7)), *(slews(rng, [-1, -1.2], [1, 1.2]) for _ in range(5))]
    return Campaign("seal of joint 2 sticks: LuGre, slow reversals", tank_arm(), motions, 60, Sensors(tails=3.0, rates=0.004), "heavy",
                    [slow()], law_of_sticking_seal,
                    [Effect("stribeck_friction", 2, "LuGre (Canudas de Wit 1995): bristle 6 mrad, breakaway 2.1 x Coulomb, v_S 0.09 rad/s",
                            ["coulomb_friction", "load_friction"])])


def law_of_hose(scene: Scene) -> Outcome:
    """A hose that stiffens at joint 1; the encoder of joint 2 reads too much."""
    machine, state = scene.machine, scene.state
    bend = state.q[:, 0] - 0.25
    hose = at_joint(state, 1, 0.55 * (bend + 0.6 * bend**3))
    read = replace(state, q=state.q + np.array([0, 0.07]))
    missed = scene.tau - bare_torques(machine, read, kinematics(machine, read))
    return Outcome({"umbilical_stiffness": hose, "encoder_offset": missed}, scene.tau + hose, read.q)


def hose_and_encoder() -> Campaign:
    """A hose, and an angle that is misread."""
    rng = np.random.default_rng(15)
    plan = [(0, 0.6, 0.5), (0.3, -0.8, 0.8), (-0.5, 1.2, 1.0), (0.8, -1.3, 0.7), (-0.9, -0.6, 0.9), (0.2, 1.4, 0.6), (0.6, 0.3, 1.1),
            (-0.3, -1.5, 0.8)]
    motions = [*(tow([a, b], u, 6.0) for a, b, u in plan), *(slews(rng, [-1.2, -1.5], [1.3, 1.5]) for _ in range(6)),
               *(fourier(rng, [0.1, 0], [0.7, 1.0], 0.4) for _ in range(3))]
    return Campaign("stiffening hose at joint 1, elbow encoder 4 degrees off", tank_arm(), motions, 50,
                    Sensors(0.007, loudness=(1, 3)), "hetero3", [tow([0.1, -1.0], 0.75)], law_of_hose,
                    [Effect("umbilical_stiffness", 1, "k (x + 0.6 x^3), x from 0.25 rad: a hose that straightens"),
                     Effect("encoder_offset", 2, "reads 0.07 rad too much")],
                    "offset weak: share is what the model would miss with the angle as read")


def law_of_shaft_seal(scene: Scene) -> Outcome:
    """A torque in proportion to the rate."""
    return Outcome({"viscous_friction": at_joint(scene.state, 1, 0.0032 * scene.state.dq[:, 0])})


def propeller_shaft() -> Campaign:
    """A spinning shaft with two blades."""
    def spin(first: float, second: float) -> Motion:
        return Motion("spin", 6.0, [speeds(0.0, (0.2, 0), (1.4, first), (2.8, first), (3.6, second), (4.8, second), (5.8, 0))])
    plan = [(3, 6), (5, -5), (8, 12), (-4, -9), (10, -10), (15, 6), (-14, -20), (20, 10), (2, -3), (-6, 7), (18, -12), (-22, -11)]
    return Campaign("two-bladed shaft spun both ways", arm(0.12, 0.03, 0.22, 0.004, 7.0e-4, cd=2.2, cm=1.7, known_to=0.05),
                    [spin(first, second) for first, second in plan], 125, Sensors(0.015, ar=0.0, rates=0.02), "plain", [spin(12, -8)],
                    law_of_shaft_seal,
                    [Effect("viscous_friction", 1,
                            "shaft seal, linear in speed; one link about a fixed hub: a drag linear in speed is the same",
                            ["drag_form", "reynolds_drag"])], "both blades count as one link with twice the drag")


def law_of_drift_and_rotor(scene: Scene) -> Outcome:
    """Sensor 1 warms up over the day; the rotor of joint 2 turns fast."""
    state = scene.state
    drift = 0.75 * (1 - np.exp(-state.clock / state.total / 0.35)) - 0.36
    return Outcome({"torque_drift": at_joint(state, 1, drift), "rotor_inertia": at_joint(state, 2, 0.05 * state.ddq[:, 1])})


def drift_and_rotor() -> Campaign:
    """A sensor that drifts, and a gear whose rotor is not stated."""
    rng = np.random.default_rng(24)
    motions = [*(slews(rng, [-1, -1.5], [1, 1.5], times=(0.5, 1.2), stay=0.25) for _ in range(10)),
               *(fourier(rng, [0, 0], [0.5, 0.8], 0.7) for _ in range(6))]
    return Campaign("shoulder sensor warms up, 80:1 gear at the elbow", tank_arm(), motions, 100, Sensors(rates=0.004), "plain",
                    [fourier(rng, [0, 0.1], [0.5, 0.8], 0.6)], law_of_drift_and_rotor,
                    [Effect("torque_drift", 1, "exponential warm-up, -0.36 to +0.35 N m over the day"),
                     Effect("rotor_inertia", 2, "7.8e-6 kg m^2 x 80^2")])


def law_of_filter(scene: Scene) -> Outcome:
    """The torques pass a Bessel low-pass."""
    b, a = bessel(2, 6.0 * 2 * scene.state.dt, norm="mag")
    start = scene.tau[:1]
    late = lfilter(b, a, scene.tau - start, axis=0) + start
    return Outcome({"sensor_timing": late - scene.tau}, late)


def filtering_amplifier() -> Campaign:
    """Torques that come late."""
    rng = np.random.default_rng(25)
    machine = arm([0.42, 0.36, 0.28], [0.07, 0.06, 0.05], [2.1, 1.3, 0.7], [0.21, 0.18, 0.13], [0.034, 0.016, 0.006],
                  cd=[1.1, 1.0, 0.9], cm=[0.9, 0.85, 0.8], known_to=0.02)
    motions = [*(slews(rng, [-1, -1.4, -1.4], [1, 1.4, 1.4], times=(0.5, 1.2)) for _ in range(9)),
               *(fourier(rng, [0, 0.2, 0.1], [0.5, 0.7, 0.8], 0.8) for _ in range(6))]
    return Campaign("three-link arm, amplifier with a 6 Hz Bessel filter", machine, motions, 100, Sensors(rates=0.005), "plain",
                    [fourier(rng, [0, 0, 0], [0.5, 0.7, 0.8], 0.7)], law_of_filter,
                    [Effect("sensor_timing", None, "second-order Bessel low-pass on the torques alone, 6 Hz (about 36 ms)")])
