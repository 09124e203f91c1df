"""Eight campaigns with nothing hidden."""

import numpy as np
from campaign import Campaign, Sensors
from curves import Curve, waves
from machines import GRAVITY, arm, tank_arm
from motions import DEGREE, fourier, slews, tow


def plain_tank_arm() -> Campaign:
    """Angles alone, masses off within 5 %."""
    rng = np.random.default_rng(1)
    motions = [*(slews(rng, [-1, -1.6], [1, 1.6]) for _ in range(7)), *(fourier(rng, [0.2, 0.1], [0.6, 0.9], 0.5) for _ in range(5)),
               *(tow([a, b], u) for a, b, u in [(0, 0, 0.4), (0.5, 0.5, 0.7), (-0.5, 1.0, 0.9), (0.8, -1.2, 0.6)])]
    return Campaign("two-link tank arm, direct drive, angles alone", tank_arm(known_to=0.05), motions, 80, Sensors(), "healthy",
                    [fourier(rng, [0, 0], [0.5, 0.8], 0.45)], note="masses off within 5 %")


def geared_paddle() -> Campaign:
    """A sensor at the motor, before a gear with losses."""
    rng = np.random.default_rng(2)
    paddle = arm(0.6, 0.08, 2.6, 0.28, 0.09, cd=1.15, cm=0.9, known_to=0.02, gear=(25.0, 0.92))
    motions = [*(slews(rng, [-1.4], [1.4], 5, times=(0.6, 1.5)) for _ in range(6)),
               *(fourier(rng, [0], [0.9], 0.7, 8.0) for _ in range(4))]
    return Campaign("geared paddle, sensor at the motor (25:1, efficiency 0.92)", paddle, motions, 100,
                    Sensors(0.015, ar=0.0, quantum=2 * np.pi / 4096), "healthy, motor-side sensor",
                    [fourier(rng, [0.1], [0.8], 0.6, 8.0)], note="the loss in the gear follows the sign of torque x speed at the joint")


def three_links() -> Campaign:
    """Coarse torques with heavy-tailed noise."""
    rng = np.random.default_rng(3)
    machine = arm([0.4, 0.35, 0.3], [0.07, 0.06, 0.05], [2.0, 1.3, 0.8], [0.2, 0.17, 0.14], [0.03, 0.015, 0.007],
                  cd=[1.1, 1.0, 0.9], cm=[0.9, 0.85, 0.8], known_to=0.03)
    motions = [*(slews(rng, [-1, -1.4, -1.4], [1, 1.4, 1.4]) for _ in range(8)),
               *(fourier(rng, [0, 0.3, -0.2], [0.5, 0.7, 0.9], 0.5) for _ in range(6))]
    return Campaign("three-link arm, 12-bit torque, heavy-tailed noise", machine, motions, 50,
                    Sensors(0.015, tails=3.0, torque_quantum=0.004), "healthy, heavy", [fourier(rng, [0, 0, 0], [0.5, 0.6, 0.8], 0.45)])


def belt_driven() -> Campaign:
    """A belt to joint 2; noisy rates."""
    rng = np.random.default_rng(4)
    motions = [*(slews(rng, [-1, -1.3], [1, 1.3]) for _ in range(8)), *(fourier(rng, [0.1, -0.2], [0.5, 0.9], 0.5) for _ in range(4)),
               *(tow([a, b], u) for a, b, u in [(0.2, 0.5, 0.5), (-0.4, -0.8, 0.8), (0.6, 0.9, 1.0)])]
    return Campaign("belt-driven two-link arm (remote), noisy rates", tank_arm(remote=True, known_to=0.03), motions, 100,
                    Sensors(ar=0.9, rates=0.02), "healthy, ar9, noisy rates", [fourier(rng, [0, 0], [0.5, 0.8], 0.45)])


def steady_tows() -> Campaign:
    """A slow logger with uneven times."""
    rng = np.random.default_rng(5)
    plan = [(0, 0, 0.3), (0, 0, 0.6), (0, 0, 1.0), (30, 0, 0.5), (30, 45, 0.8), (-45, 30, 0.9), (45, -60, 0.7), (60, -30, 1.1),
            (-30, -45, 0.4), (15, 75, 0.55), (-60, 75, 1.2), (0, -90, 0.8)]
    motions = [*(tow([a * DEGREE, b * DEGREE], u, 9.0) for a, b, u in plan), *(slews(rng, [-0.8, -1], [0.8, 1], 6) for _ in range(3))]
    return Campaign("steady tows of a locked arm, uneven sampling at 25 Hz", tank_arm(), motions, 25,
                    Sensors(0.02, ar=0.0, uneven=0.08), "healthy, slow25, uneven")


def industrial_joints() -> Campaign:
    """A robot in air with stated friction."""
    rng = np.random.default_rng(6)
    machine = arm([0.6, 0.5], [0.15, 0.12], [14.0, 6.0], [0.27, 0.22], [0.5, 0.16], density=0.0, gravity=GRAVITY, known_to=0.02,
                  friction=[(3.2, 4.1), (1.4, 1.6)])
    motions = [*(slews(rng, [-2.2, -1.6], [0.4, 1.6], times=(0.5, 1.1), rests=(0.1, 0.4)) for _ in range(8)),
               *(fourier(rng, [-0.8, 0.2], [0.7, 0.9], 0.6, 8.0) for _ in range(5))]
    return Campaign("industrial joints in air, upright, friction stated (3 % more one way)", machine, motions, 125,
                    Sensors(0.008, ar=0.0, loudness=(0.5, 1, 2, 1), rates=0.004), "healthy, dry, per-recording noise",
                    [fourier(rng, [-0.8, 0.1], [0.6, 0.8], 0.6, 6.0)])


def oscillating_carriage() -> Campaign:
    """A carriage that runs to and fro; noise differs between recordings."""
    rng = np.random.default_rng(7)

    def ride() -> Curve:
        return waves(0, [(rng.uniform(0.15, 0.35), rng.uniform(0.15, 0.35), 0)])
    motions = [*(fourier(rng, [rng.uniform(-0.7, 0.7), rng.uniform(-1, 1)], [0.5, 0.8], 0.45, name="ride", carriage=ride())
                 for _ in range(8)), *(slews(rng, [-1, -1.3], [1, 1.3]) for _ in range(4))]
    return Campaign("arm on an oscillating carriage, noise differs fivefold between recordings", tank_arm(known_to=0.04), motions, 100,
                    Sensors(0.008, loudness=(0.5, 1, 2.5), rates=0.01), "healthy, hetero5",
                    [fourier(rng, [0, 0.2], [0.5, 0.7], 0.45, 8.0, name="ride", carriage=ride())])


def three_recordings() -> Campaign:
    """Few recordings, of smoothed torques and coarse angles."""
    rng = np.random.default_rng(8)
    motions = [*(fourier(rng, [0.2, 0.1], [0.7, 0.9], 0.5, 20.0, terms=5, name="long") for _ in range(2)),
               slews(rng, [-1, -1.5], [1, 1.5], 10, times=(0.8, 1.6), name="slews")]
    return Campaign("three recordings, torque smoothed to and fro at 8 Hz, coarse encoder", tank_arm(), motions, 60,
                    Sensors(0.02, ar=0.0, quantum=2 * np.pi / 2048, smooth_hz=8.0, clock=False), "healthy, few3, filtered, coarse")
