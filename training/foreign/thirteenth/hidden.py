"""Sixteen campaigns with one hidden effect, six with several, and four with a cause that no catalogue has."""

from dataclasses import replace

import numpy as np
from drives import free_swing, loose_drive, swaying_mount
from effects import Effect, encoder_offset, gear_loss, in_flow, on_joint, on_reading, on_strips, on_tip, payload, sensor_timing, stribeck
from machines import GRAVITY, WATER, Arm, Array, arm, tank_arm
from motions import Motion, move, tank_set
from record import GEARED, LAB, SEED, Case, Sensors
from responses import presliding
from water import (
    axial_rub,
    basset,
    buoyancy,
    drag_crisis,
    left_behind,
    link_wake,
    shedding,
    slow_drag,
    uniform_current,
    wave,
    young_wake,
)

PLAIN = Sensors(0.01, ar=0.5, spread=2)
STIFFER = 62.7 * GRAVITY * 0.5 * 0.055  # N m


def wall_sided(x: Array | float) -> Array | float:
    """What the straight sides of a ship add to its righting moment, at a roll of x rad."""
    return STIFFER * np.tan(x) ** 2 * np.sin(x)


def yielding(twist: float, rate: float) -> float:
    """A spring that stiffens, with some damping."""
    return 600 * twist + 4.0e5 * twist**3 + 1.6 * rate


def gap(twist: float, rate: float) -> float:
    """Gears with a gap of 4 mrad to each side: a spring with damping in contact, oil in the gap."""
    over = twist - 0.004 if twist > 0.004 else twist + 0.004 if twist < -0.004 else 0.0
    return max(300 * over + 1.5 * rate, 0.0) if over > 0 else min(300 * over + 1.5 * rate, 0.0) if over < 0 else 0.02 * rate


def single_cases(rng: np.random.Generator) -> list[Case]:
    """Sixteen campaigns with one hidden effect."""
    motions, shady = first_motions(rng), tank_arm(rng)
    motions |= motions_of_loose_drives(rng)
    return wakes_and_flows(rng, motions, shady) + bodies_and_drives(rng, motions)


def first_motions(rng: np.random.Generator) -> dict[str, list[Motion]]:
    """Motions of the campaigns that have special ones, loose drives apart."""
    slews = [move(rng, "slew", 1, s, 250, 500, (0.0,), (a,), rate=r, rest=1.5, smooth=0.1) for s, a, r in
             [(9, 0.3, 1.5), (9, 0.6, 2), (9, 1.2, 3), (9, 1.2, 2), (9, 0.4, 1.5), (8, 1.6, 3)]]
    pendulum = [move(rng, k, 1, 14, 100, 400, (-1.57,), (1.3,), rate=1.8, base_hz=0.15)
                for k in ("slew", "fourier", "reverse", "fourier", "slew", "slew")]
    oil = [move(rng, k, 1, 12, 200, 400, (0.0,), (a,), rate=2.5, base_hz=b, rest=1.0, smooth=0.05) for k, a, b in
           [("fourier", 0.5, 0.3), ("slew", 0.8, 0.1), ("fourier", 0.3, 0.6), ("slew", 1.2, 0.1),
            ("reverse", 0.6, 0.1), ("fourier", 0.9, 0.15)]]
    robot = tank_set(rng, 250, 9, "srhfrh", 500, rate=0.9, base_hz=0.12, centre=(0.7, 0.4), amp=(1.1, 1.3))
    behind = [move(rng, "locked", 2, 9, 50, 400, (0.2, np.sign(u) * -1.9), (0.9, 0.9), tow=u)
              for u in np.resize([0.5, 0.9, -0.7, 1.1, -0.9], 18)]
    behind += [move(rng, "slew", 2, 14, 50, 400, (0.1, 0.0), (0.8, 2.5), rate=0.7, tow=u) for u in (0.8, -0.8, 1.0, -0.6)]
    return {"slews": slews, "pendulum": pendulum, "oil": oil, "robot": robot, "behind": behind}


def motions_of_loose_drives(rng: np.random.Generator) -> dict[str, list[Motion]]:
    """Motions on a grid fine enough for a spring or a gap at joint 2."""
    knocks = [move(rng, k, 2, 9, 250, 2000, (0.2, 0.3), (0.8, 0.9), rate=1.6, base_hz=b, smooth=0.07) for k, b in
              [("fourier", 0.2), ("fourier", 0.4), ("slew", 0.1), ("reverse", 0.1), ("slew", 0.1), ("fourier", 0.25)]]
    rings = [move(rng, k, 2, 9, 250, 2000, (0.2, 0.3), (0.7, a), rate=2.0, base_hz=b, smooth=0.055) for k, a, b in
             [("fourier", 0.3, 0.7), ("fourier", 0.6, 0.4), ("slew", 0.9, 0.1), ("reverse", 0.5, 0.1),
              ("slew", 0.9, 0.1), ("fourier", 0.25, 0.9)]]
    return {"knocks": knocks, "rings": rings}


def wakes_and_flows(rng: np.random.Generator, motions: dict[str, list[Motion]], shady: Arm) -> list[Case]:
    """Seven campaigns in which water acts otherwise than by constant coefficients, `shady` the arm in the wake of its first link."""
    one = arm([0.65], [0.071], [1.9], [0.8], [0.4])
    return [
        Case("single link swinging from rest as McLain & Rock, 250 Hz", one, motions["slews"], LAB,
             [on_strips("wake_development", young_wake)]),
        Case("tow tank, speeds up to 1.7 m/s, rough cylinders", tank_arm(rng), tank_set(rng, 50, 10, "ttttttttttSSFFSF", tow=1.45),
             PLAIN, [on_strips("reynolds_drag", drag_crisis)]),
        Case("tow tank, bent arm, ribbed links", tank_arm(rng), tank_set(rng, 50, 12, "ttttttttSSSSFFr", tow=1.0, amp=(1.5, 1.6)),
             PLAIN, [axial_rub(0.35)]),
        Case("tow tank, folded arm, wake of link 1", shady, motions["behind"], Sensors(0.01, ar=0.3), [link_wake(shady)]),
        Case("two links with a fixed hub in a circulating tank", tank_arm(rng),
             tank_set(rng, 100, 13, "ssrrffsfhr", rate=1.2, amp=(2.2, 1.2)), replace(PLAIN, clock=True),
             [in_flow("ambient_current", uniform_current(0.09, -0.06), since=2500.0)]),
        Case("two links in a wave tank, recordings of 30 s", tank_arm(rng), tank_set(rng, 50, 32, "shrtfSsF", tow=0.5, rate=0.9),
             PLAIN, [wave(0.09, 0.55, 0.7, SEED)]),
        Case("two links, long strokes at steady speed, 200 Hz", tank_arm(rng), tank_set(rng, 200, 9, "ttttrrSr", tow=0.9, rate=1.0),
             Sensors(0.008, rates=0.003), [on_strips("vortex_shedding", shedding(SEED))]),
    ]


def ship_that_rolls() -> Case:
    """Free decays of a wide short section of a ship."""
    ship = arm([0.32], [0.5], [62.7], [1.6], [0.02], gravity=GRAVITY)
    ship.com, ship.inertia, ship.known_to = np.array([0.045]), np.array([2.4]), 0.02
    decays = [free_swing(ship, a, 25, 50, wall_sided) for a in (0.55, 0.35, 0.62, 0.2, -0.5, 0.45)]
    moment = on_joint("righting_moment", 1, lambda mo: wall_sided(mo.q[0] + np.pi / 2), accept=["umbilical_stiffness"])
    return Case("free roll decays of a ship section, torque columns 0", ship, decays, Sensors(angle_noise=3e-4), [moment], free=True)


def bodies_and_drives(rng: np.random.Generator, motions: dict[str, list[Motion]]) -> list[Case]:
    """Nine campaigns with an effect of weight, a hose, memory of the water, a drive or the mount."""
    heavy = arm([0.7], [0.06], [11.0], [1.1], [0.9], gravity=GRAVITY, known_to=0.005)
    oil = arm([0.5], [0.03], [0.9], [1.4], [1.0], density=872.0, viscosity=1.1e-4)
    robot = arm([0.45, 0.4], [0.09, 0.08], [7.0, 4.5], density=0.0, gravity=GRAVITY)
    return [
        Case("upright steel pendulum driven under water, weight as in air", heavy, motions["pendulum"], LAB, [buoyancy()]),
        ship_that_rolls(),
        Case("two links, hose to the wrist that stiffens", tank_arm(rng), tank_set(rng, 100, 12, "ssrrffShSf"), PLAIN,
             [on_joint("umbilical_stiffness", 2, lambda mo: 0.22 * (mo.q[1] - 0.25) + 0.07 * (mo.q[1] - 0.25) ** 3)]),
        Case("driven pendulum in oil, quick starts and stops", oil, motions["oil"], LAB, [Effect("history_force", None, basset)]),
        Case("upright robot joints with harmonic drives, dry", robot, motions["robot"], GEARED, [
            on_joint("torque_ripple", 2, lambda mo: 0.35 * np.sin(80 * mo.q[1] + 0.4) + 0.1 * np.sin(160 * mo.q[1]))]),
        Case("two links, elastic elbow drive, drive-side angles, 250 Hz", tank_arm(rng), motions["rings"], LAB,
             [loose_drive("joint_elasticity", yielding)]),
        Case("two links, worn gear at the elbow, drive-side angles, 250 Hz", tank_arm(rng), motions["knocks"], LAB,
             [loose_drive("backlash", gap)]),
        Case("two links, reversals, stops and pauses after long strokes", tank_arm(rng),
             tank_set(rng, 100, 14, "rrrrsssssr", rate=1.6, amp=(1.3, 1.2)), PLAIN, [on_strips("wake_reentry", left_behind)]),
        Case("two links on a swaying strut, quick moves", tank_arm(rng),
             tank_set(rng, 200, 10, "ssssffr", 800, rate=2.2, base_hz=0.35, smooth=0.04), LAB, [swaying_mount(3.1, 0.03, 45.0, 1.1)]),
    ]


def several_cases(rng: np.random.Generator) -> list[Case]:
    """Six campaigns with two or three hidden effects."""
    robot = arm([0.55, 0.5], [0.1, 0.08], [10.0, 6.0], density=0.0, gravity=GRAVITY)
    turns = tank_set(rng, 250, 9, "sfrhfr", 500, rate=1.6, base_hz=0.2, centre=(0.8, 0.5), amp=(1.0, 1.2))
    other = arm([0.4, 0.38], [0.08, 0.07], [6.0, 4.0], density=0.0, gravity=GRAVITY)
    plain = Sensors(0.01, ar=0.4, spread=2)
    drifting = tank_set(rng, 60, 11, "ttttttSSSSSFFFrrst", tow=0.9, amp=(1.4, 1.3))
    warm = on_reading("torque_drift", 1, lambda mo, tau: tau[0] + 0.55 * (1 - np.exp(-(mo.clock + mo.t) / 2500.0)) - 0.15)
    body = on_tip("tip_drag", lambda v, _: 0.5 * WATER * 0.0045 * np.hypot(*v) * v)
    return [
        Case("tank, two links, dry seal at the elbow and a tool at the tip", tank_arm(rng), tank_set(rng, 100, 12, "ssrrffhhSf"), plain,
             [payload(0.45), on_joint("coulomb_friction", 2, lambda mo: 0.09 * presliding(mo.q[1], 0.002))]),
        Case("tank, two links, greasy hub, sensor 2 not zeroed, torques late", tank_arm(rng),
             tank_set(rng, 200, 9, "ssrrfffs", 400, rate=1.8, base_hz=0.25, smooth=0.05), plain,
             [on_joint("viscous_friction", 1, lambda mo: 0.9 * mo.dq[0]), sensor_timing(0.02, 0.015),
              on_reading("torque_bias", 2, lambda _, tau: tau[1] + 0.18)]),
        Case("tow tank, angle 2 misread, gripper at the tip, sensor 1 warms up, with a clock", tank_arm(rng), drifting,
             replace(plain, clock=True), [body, encoder_offset(2, 0.09), warm]),
        Case("upright robot, dry, rotor not stated, sticking elbow", robot, turns, GEARED,
             [on_joint("rotor_inertia", 1, lambda mo: 1.3 * mo.ddq[0]), stribeck(2, 0.7, 1.7, 0.12, 1.3)]),
        Case("tank, two links, drag that lags, channel 2 leaks into 1", tank_arm(rng),
             tank_set(rng, 100, 12, "ffffssrrFSff", rate=1.8, base_hz=0.25), plain,
             [on_strips("flow_memory", slow_drag(0.4, 0.25)), on_reading("torque_crosstalk", 1, lambda _, tau: tau[0] - 0.3 * tau[1])]),
        Case("upright robot, dry, lossy gear at the shoulder, elbow amplifier clips", other,
             tank_set(rng, 250, 9, "sfrfsr", 500, rate=1.8, base_hz=0.25, centre=(0.8, 0.4), amp=(1.1, 1.2)),
             GEARED, [gear_loss(1, 0.86), on_reading("torque_saturation", 2, lambda _, tau: np.clip(tau[1], -8.5, 8.5))]),
    ]


def unlisted_cases(rng: np.random.Generator) -> list[Case]:
    """Four campaigns with a cause that no catalogue has."""
    servo = arm([0.6], [0.06], [3.0], density=0.0, gravity=GRAVITY)
    turns = [move(rng, k, 1, 11, 200, 400, (-1.2,), (1.3,), rate=1.5, base_hz=0.15)
             for k in ("slew", "fourier", "reverse", "slew", "fourier", "reverse")]
    robot = arm([0.5, 0.4], [0.09, 0.08], [8.0, 5.0], density=0.0, gravity=GRAVITY)

    def fin(v: Array, mo: Motion) -> Array:
        phi = mo.phi[-1]
        attack = np.arctan2(v[1], v[0]) - phi
        lift = 0.5 * WATER * 0.010 * 1.1 * np.sin(2 * attack) * np.hypot(*v)
        return lift * np.stack([-v[1], v[0]])

    def rub(v: Array, _: Motion) -> Array:
        return 0.6 * v / np.sqrt((v**2).sum(0) + 0.004**2)
    plain = Sensors(0.01, ar=0.4, spread=2)
    return [
        Case("upright servo, dry, magnetic latch near one angle", servo, turns, GEARED, [
            on_joint("unknown#magnetic latch: a detent about one angle", 1,
                     lambda mo: 24 * (mo.q[0] + 1.0) * np.exp(-(((mo.q[0] + 1.0) / 0.09) ** 2)))]),
        Case("upright robot, dry, eddy-current brake at the shoulder", robot,
             tank_set(rng, 250, 9, "sfrhfr", 500, rate=2.2, base_hz=0.25, centre=(0.8, 0.4), amp=(1.1, 1.2)), GEARED,
             [on_joint("unknown#eddy-current brake: torque peaks at one speed and falls beyond", 1,
                       lambda mo: 2 * 5.0 * (mo.dq[0] / 0.35) / (1 + (mo.dq[0] / 0.35) ** 2))]),
        Case("tow tank, two links, a fin at the tip", tank_arm(rng),
             tank_set(rng, 80, 11, "ttttttSSSFFFrsf", tow=0.8, amp=(1.4, 1.3)), plain,
             [on_tip("unknown#lift of a fin at the tip, across the velocity", fin)]),
        Case("tank, two links, tip drags over the floor", tank_arm(rng), tank_set(rng, 100, 12, "ssrrffhhSf", rate=1.1), plain,
             [on_tip("unknown#tip rubs on the floor: a dry force against the tip's velocity", rub)]),
    ]
