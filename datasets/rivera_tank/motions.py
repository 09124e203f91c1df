"""Commanded motions of the two motors and what the arm makes of them. Absolute link angles, rad; SI."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from truth import Motion

Array = NDArray[np.float64]

RATE = 500.0  # Hz of the simulation, five times the recorder's
REST = 0.5  # s at rest before and after each motion
SERVO_HZ, SERVO_DAMPING = 5.0, 0.8  # closed loop of the position servos: rounds the corners of a bang-bang command
WANDER = 4e-4  # rad rms, how far two runs of one command differ
RANGE = np.radians((75.0, 150.0))  # phi_1, theta_2: either way
FOLDED = np.radians((-75.0, -150.0)), np.radians((0.0, -40.0))  # phi_1, theta_2
PEAK = {"bang": 2.0, "jerk": 1.875}  # peak speed over mean speed of a slew


def slew(kind: str, s: Array) -> Array:
    """Share of the way at the share s of the time: constant acceleration and deceleration, or minimum jerk."""
    s = np.clip(s, 0.0, 1.0)
    if kind == "bang":
        return np.where(s < 0.5, 2.0 * s**2, 1.0 - 2.0 * (1.0 - s) ** 2)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def tour(kind: str, stops: Array, rates: list[float], dwell: float) -> Array:
    """(n, 2) rad: slews from stop to stop, the faster joint peaking at the given rate; `dwell` s rest after each."""
    pieces = [np.repeat(stops[:1], int(REST * RATE), axis=0)]
    for start, stop, rate in zip(stops[:-1], stops[1:], rates, strict=True):
        duration = PEAK[kind] * np.abs(stop - start).max() / rate
        share = slew(kind, np.arange(int((duration + dwell) * RATE)) / RATE / duration)
        pieces.append(start + share[:, None] * (stop - start))
    pieces.append(np.repeat(stops[-1:], int(REST * RATE), axis=0))
    return np.concatenate(pieces)


def random_tour(rng: np.random.Generator, kind: str, moving: str, moves: int, fastest: float, folded: bool) -> Array:
    """A tour over drawn stops: 20 to 110 degrees a move, 0.5 rad/s up to `fastest`, within the arm's range.

    `folded`: link 2 stays where, in a tow, it crosses the wake of link 1.
    """
    low, high = FOLDED if folded else (-RANGE, RANGE)
    step = {"link1": np.array([1.0, 0.0]), "link2": np.array([0.0, 1.0]), "one": np.array([1.0, 1.0])}.get(moving)
    stops = [np.cumsum(np.mean([low, high], axis=0)) + np.radians(rng.uniform(-20.0, 20.0, 2))]
    while len(stops) <= moves:
        way = step if step is not None else rng.uniform(-1.0, 1.0, 2)
        target = stops[-1] + rng.choice([-1, 1]) * np.radians(rng.uniform(20.0, 110.0)) * way / np.abs(way).max()
        theta = np.array([target[0], target[1] - target[0]])
        if (theta > low).all() and (theta < high).all():
            stops.append(target)
    return tour(kind, np.array(stops), list(rng.uniform(0.5, fastest, moves)), dwell=0.25)


def fourier(rng: np.random.Generator, seconds: float, fastest: float, folded: bool) -> Array:
    """(n, 2) rad: five sines a joint, 0.1 to 1.1 Hz, faded in and out, scaled to the peak rate or the range."""
    middle, reach = (np.mean(FOLDED, axis=0), np.ptp(FOLDED, axis=0) / 2) if folded else (np.zeros(2), RANGE)
    t = np.arange(int(seconds * RATE)) / RATE
    fade = slew("jerk", t / 1.0) * slew("jerk", (seconds - t) / 1.0)
    joint = np.zeros((len(t), 2))
    for j in range(2):  # theta_1, theta_2
        f = rng.uniform(0.1, 1.1, 5)
        wave = rng.uniform(0.3, 1.0, 5) / f @ np.sin(2 * np.pi * f[:, None] * t + rng.uniform(0, 2 * np.pi, (5, 1)))
        wave = (wave - wave.mean()) * fade
        limit = reach[j] / np.abs(wave).max()
        joint[:, j] = wave * min(fastest / (np.abs(np.gradient(wave, t)).max()), limit)
    theta = middle + np.pad(joint, ((int(REST * RATE),) * 2, (0, 0)))
    return np.cumsum(theta, axis=1)


def carriage(n: int, speed: float, ramps: bool) -> tuple[Array, Array]:
    """(n,) m/s, m/s2: constant speed, or started and stopped within the recording (1.5 s each, minimum jerk)."""
    t = np.arange(n) / RATE
    if not ramps:
        return np.full(n, speed), np.zeros(n)
    up, down = (t - 0.2) / 1.5, (t[-1] - 0.2 - t) / 1.5
    u0 = speed * slew("jerk", up) * slew("jerk", down)
    return u0, np.gradient(u0, t)


def follow(rng: np.random.Generator, command: Array, speed: float = 0.0, ramps: bool = False) -> Motion:
    """What the arm does: each servo is a damped second-order follower and wanders a little from run to run."""
    n = len(command)
    t = np.arange(n) / RATE
    slow = signal.sosfilt(signal.butter(2, 1.0, fs=RATE, output="sos"), rng.standard_normal((n, 2)), axis=0)
    heard = command + WANDER * slow / slow.std()
    omega = 2 * np.pi * SERVO_HZ
    servo = ([[0.0, 1.0], [-(omega**2), -2 * SERVO_DAMPING * omega]], [[0.0], [omega**2]], np.eye(2), np.zeros((2, 1)))
    states = [signal.lsim(servo, heard[:, j], t, X0=[heard[0, j], 0.0])[1] for j in range(2)]
    phi, dphi = np.stack([s[:, 0] for s in states], 1), np.stack([s[:, 1] for s in states], 1)
    ddphi = omega**2 * (heard - phi) - 2 * SERVO_DAMPING * omega * dphi
    u0, du0 = carriage(n, speed, ramps)
    return Motion(t, phi, dphi, ddphi, u0, du0, developed=speed > 0 and not ramps)
