"""Four campaigns with a hidden effect of a wake: the drag crisis, a young wake, shed vortices, and the wake of another link."""

import numpy as np
from campaign import Campaign, Effect, Outcome, Scene, Sensors
from curves import ramps
from machines import arm, tank_arm
from mechanics import drag_torques, normal_torques
from motions import DEGREE, Motion, slews, tow
from responses import CD_OF_LOG_REYNOLDS, CD_OF_TRAVEL, CM_OF_TRAVEL, travel_since_reversal, wake_oscillator


def law_of_drag_crisis(scene: Scene) -> Outcome:
    """C_D of each strip by its Reynolds number."""
    machine, link = scene.machine, scene.links[0]
    reynolds = np.clip(np.abs(link.w) * machine.diameter[0] / machine.viscosity, 1e3, 1e6)
    return Outcome({"reynolds_drag": drag_torques(machine, scene.links, 0, CD_OF_LOG_REYNOLDS(np.log10(reynolds)) - machine.cd[0])})


def big_cylinder() -> Campaign:
    """Tows below, in and above the drag crisis."""
    rng = np.random.default_rng(12)
    plan = [(0.3, 0), (0.5, 0), (0.7, 10), (0.9, 0), (1.1, 0), (1.2, -20), (1.4, 0), (1.6, 15), (1.8, 0), (2.0, 0), (2.2, -10),
            (1.3, 40), (1.9, 45), (0.8, -35)]
    motions = [*(tow([a * DEGREE], u, 7.0, 1.5) for u, a in plan), *(slews(rng, [-1.2], [1.2], times=(0.9, 1.8)) for _ in range(3))]
    return Campaign("big cylinder towed through the drag crisis", arm(0.9, 0.15, 17.0, 0.44, 1.2, cd=0.72, known_to=0.02), motions, 50,
                    Sensors(0.02, ar=0.9), "ar9, tows", [tow([0.1], 1.5, 6.0, 1.5)], law_of_drag_crisis,
                    [Effect("reynolds_drag", None,
                            "C_D(Re) table after Wieselsberger and Achenbach (slightly rough): 1.2 until 1e5, 0.55 at 3e5", ["drag_form"])])


def law_of_young_wake(scene: Scene) -> Outcome:
    """C_D and C_M of each strip by its travel since rest or reversal."""
    machine, link = scene.machine, scene.links[0]
    travel = np.clip(travel_since_reversal(link.w, scene.state.dt, machine.diameter[0]), 0, 8)
    drag = drag_torques(machine, scene.links, 0, CD_OF_TRAVEL(travel) - machine.cd[0])
    load = (CM_OF_TRAVEL(travel) - machine.cm[0]) * machine.density * np.pi * machine.diameter[0] ** 2 / 4 * link.dw
    return Outcome({"wake_development": drag + normal_torques(scene.links, 0, load)})


def paddle_from_rest() -> Campaign:
    """Slews at constant acceleration, some of them back again, as McLain & Rock made them."""
    def slew(start: float, degrees: float, seconds: float, sign: int, back: bool = False) -> Motion:
        speed = 2 * (degrees * DEGREE) / seconds * sign
        knots = [(0.3, 0), (0.3 + seconds / 2, speed), (0.3 + seconds, 0)]
        if back:
            knots += [(0.9 + seconds, 0), (0.9 + 1.5 * seconds, -speed), (0.9 + 2 * seconds, 0)]
        return Motion("slew", knots[-1][0] + 0.7, [ramps(start, *knots)])
    plan = [(30, 0.4, 1, False), (60, 0.6, 1, False), (120, 1.2, 1, False), (30, 0.5, -1, False), (60, 0.8, -1, True),
            (120, 1.4, -1, False), (45, 0.5, 1, True), (90, 1.0, 1, False), (90, 0.9, -1, False), (150, 1.5, 1, True),
            (20, 0.4, -1, False), (100, 1.6, 1, True)]
    motions = [slew(-0.5 * sign, degrees, seconds, sign, back) for degrees, seconds, sign, back in plan]
    return Campaign("paddle started from rest: McLain & Rock curves", arm(0.65, 0.071, 1.3, 0.31, 0.05, cd=0.80, cm=0.45), motions, 250,
                    Sensors(0.012, quantum=2 * np.pi / 4096 / 60), "plain", [slew(-0.4, 75, 0.9, 1, True)], law_of_young_wake,
                    [Effect("wake_development", None, "C_D(s/D), C_M(s/D): splines of McLain & Rock (1998), own travel of every strip, "
                                                      "counted anew at a reversal")], dt=0.001)


def law_of_shedding(scene: Scene) -> Outcome:
    """An in-line force by a wake oscillator."""
    machine, w = scene.machine, scene.links[0].w
    y = wake_oscillator(w, machine.diameter[0], 0.195, scene.state.dt, scene.rng)
    load = 0.5 * machine.density * machine.diameter[0] * 0.22 * np.abs(w) * w * y
    return Outcome({"vortex_shedding": normal_torques(scene.links, 0, load)})


def shedding_cylinder() -> Campaign:
    """Long tows at steady speed."""
    rng = np.random.default_rng(23)
    plan = [(0.3, 0), (0.4, 0), (0.5, 0), (0.6, 0), (0.7, 10), (0.8, 0), (0.9, -15), (0.45, 30), (0.65, -40), (0.55, 50), (0.75, 25),
            (0.35, -20)]
    motions = [*(tow([a * DEGREE], u, 10.0) for u, a in plan), *(slews(rng, [-1.2], [1.2]) for _ in range(3))]
    return Campaign("towed cylinder that sheds vortices", arm(0.7, 0.06, 2.8, 0.34, 0.12, cd=1.15, known_to=0.02), motions, 80,
                    Sensors(0.008, rates=0.004), "plain", [], law_of_shedding,
                    [Effect("vortex_shedding", None,
                            "eight coupled van der Pol cells (Facchinetti 2004) at twice St = 0.195, wandering phase")])


def law_of_shaded_link(scene: Scene) -> Outcome:
    """Strips of link 2 behind link 1, as seen along the tow (+Y), are in Blevins' wake; the planes of the links lie apart."""
    machine, first, second, planes = scene.machine, scene.links[0], scene.links[1], 0.045
    place = second.place[:, None, :] + second.x[None, :, None] * second.along[:, None, :]
    on_first = place[..., 0] / np.where(np.abs(first.along[:, 0]) < 1e-3, 1e-3, first.along[:, 0])[:, None]
    ahead = on_first * first.along[:, 1][:, None] - place[..., 1]
    edge = np.minimum(on_first, machine.length[0] - on_first) / (0.1 * machine.diameter[0])
    behind = 1 / (1 + np.exp(-np.clip(edge, -50, 50))) * (ahead > 0) * (scene.state.u0 > 0.02)[:, None]
    cd, diameter = machine.cd[0], machine.diameter[0]
    distance = np.maximum(ahead, 0) + 4 * cd * diameter
    width = 0.23 * np.sqrt(cd * diameter * distance)
    deficit = np.clip(1.02 * np.sqrt(cd * diameter / distance) * np.exp(-0.69 * (planes / width) ** 2), 0, 0.9) * behind
    w = second.w - (scene.state.u0[:, None] * second.across[:, 1:2]) * deficit
    added = drag_torques(machine, scene.links, 1, machine.cd[1], w) - drag_torques(machine, scene.links, 1, machine.cd[1])
    return Outcome({"link_interference": added})


def folded_arm() -> Campaign:
    """Tows with the forearm folded behind the upper arm."""
    rng = np.random.default_rng(28)
    plan = [(0, -170, 0.6), (0, -150, 0.9), (15, -160, 0.8), (-15, -140, 1.0), (10, -120, 0.7), (0, -100, 0.9), (20, -175, 1.1),
            (-20, -155, 0.5), (0, 0, 0.6), (0, 30, 0.9), (-20, 50, 0.8), (20, -30, 1.0), (0, -60, 0.7), (30, -90, 0.9)]
    motions = [*(tow([a * DEGREE, b * DEGREE], u, 7.0) for a, b, u in plan),
               *(slews(rng, [-0.8, -1.2], [0.8, 1.2]) for _ in range(5))]
    return Campaign("folded arm towed, forearm in the wake of the upper arm", tank_arm(), motions, 50, Sensors(uneven=0.1), "uneven",
                    [tow([0.1, -2.5], 0.85)], law_of_shaded_link,
                    [Effect("link_interference", 2,
                            "velocity deficit of a cylinder wake (Blevins 1990), link planes 45 mm apart, only behind link 1")])
