"""Curves of one joint or of the carriage: functions of time that give the value and its first two derivatives."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from machines import Array

Values = tuple[Array, Array, Array]  # value, first and second derivative
Curve = Callable[[Array], Values]
Knot = tuple[float, float]  # time and value


def smooth_step(share: Array) -> Values:
    """The minimum-jerk step from 0 to 1, with its derivatives."""
    share = np.clip(share, 0, 1)
    return (share**3 * (10 - 15 * share + 6 * share * share), 30 * share**2 * (1 - share) ** 2,
            60 * share * (1 - share) * (1 - 2 * share))


def hold(value: float) -> Curve:
    """One value for ever."""
    return lambda t: (value + 0 * t, 0 * t, 0 * t)


def points(*knots: Knot) -> Curve:
    """Minimum-jerk moves between places."""
    def curve(t: Array) -> Values:
        place, speed, acceleration = np.full_like(t, knots[0][1]), 0 * t, 0 * t
        for (t0, q0), (t1, q1) in pairwise(knots):
            lasting = t1 - t0
            step, dstep, ddstep = smooth_step((t - t0) / lasting)
            place = place + (q1 - q0) * step
            speed = speed + (q1 - q0) * dstep / lasting
            acceleration = acceleration + (q1 - q0) * ddstep / lasting**2
        return place, speed, acceleration
    return curve


def speeds(start: float, *knots: Knot) -> Curve:
    """From `start` at speeds that change smoothly from knot to knot."""
    def curve(t: Array) -> Values:
        place, speed, acceleration = start + knots[0][1] * t, np.full_like(t, knots[0][1]), 0 * t
        for (t0, v0), (t1, v1) in pairwise(knots):
            lasting = t1 - t0
            share = np.clip((t - t0) / lasting, 0, 1)
            step, dstep, _ = smooth_step(share)
            place = place + (v1 - v0) * (lasting * (share**6 - 3 * share**5 + 2.5 * share**4) + np.maximum(t - t1, 0))
            speed = speed + (v1 - v0) * step
            acceleration = acceleration + (v1 - v0) * dstep / lasting
        return place, speed, acceleration
    return curve


def ramps(start: float, *knots: Knot) -> Curve:
    """From `start` at constant accelerations between the speeds of the knots."""
    def curve(t: Array) -> Values:
        place, speed, acceleration = start + knots[0][1] * t, np.full_like(t, knots[0][1]), 0 * t
        for (t0, v0), (t1, v1) in pairwise(knots):
            lasting = t1 - t0
            share = np.clip((t - t0) / lasting, 0, 1)
            place = place + (v1 - v0) * (lasting * share * share / 2 + np.maximum(t - t1, 0))
            speed = speed + (v1 - v0) * share
            acceleration = acceleration + (v1 - v0) / lasting * ((t >= t0) & (t < t1))
        return place, speed, acceleration
    return curve


def waves(middle: float, terms: list[tuple[float, float, float]], rise: float = 1.0) -> Curve:
    """A sum of sines of given amplitude, frequency in Hz and phase, faded in over `rise` s."""
    def curve(t: Array) -> Values:
        fade, dfade, ddfade = smooth_step(t / rise)
        dfade, ddfade = dfade / rise, ddfade / rise**2
        y = dy = ddy = 0 * t
        for amplitude, hz, phase in terms:
            w = 2 * np.pi * hz
            y = y + amplitude * np.sin(w * t + phase)
            dy = dy + amplitude * w * np.cos(w * t + phase)
            ddy = ddy - amplitude * w * w * np.sin(w * t + phase)
        return middle + fade * y, dfade * y + fade * dy, ddfade * y + 2 * dfade * dy + fade * ddy
    return curve
