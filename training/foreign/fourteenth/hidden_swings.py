"""Two campaigns of arms that swing freely: a pendulum with buoyancy, and a hull that rolls."""

import numpy as np
from campaign import Campaign, Effect, Outcome, Scene, Sensors
from curves import points
from machines import GRAVITY, Array, arm, rod_inertia
from mechanics import at_joint
from motions import FreeSwing, Motion

LENGTH, DIAMETER, PENDULUM_MASS, HULL_MASS = 0.6, 0.05, 9.2, 20.0
DOWN = -np.pi / 2


def lift(q: Array) -> Array:
    """Archimedes: the torque of the water that the pendulum displaces, at mid-length."""
    return -(1000.0 * np.pi * DIAMETER**2 / 4 * LENGTH * GRAVITY * LENGTH / 2) * np.cos(q)


def law_of_buoyancy(scene: Scene) -> Outcome:
    """The weight that the water takes."""
    lifted = at_joint(scene.state, 1, lift(scene.state.q[:, 0]))
    return Outcome({"buoyancy_tilt": lifted}, 0 * scene.tau if scene.state.free else scene.tau + lifted)


def steel_pendulum() -> Campaign:
    """Free decays, and slow turns with the torque read."""
    machine = arm(LENGTH, DIAMETER, PENDULUM_MASS, 0.30, rod_inertia(LENGTH, DIAMETER, PENDULUM_MASS), gravity=GRAVITY, cd=1.15, cm=0.95,
                  friction=[(0.06, 0.0)], friction_known_to=0.2)
    motions: list[Motion | FreeSwing] = [
        *(FreeSwing("decay", 10.0, DOWN + a, machine, lift) for a in (0.35, -0.6, 0.9, -1.2, 1.4, 0.75)),
        *(Motion("cranked", 10.0, [points((0.3, DOWN + a), (4.8, DOWN + b), (5.2, DOWN + b), (9.7, DOWN + a))])
          for a, b in ((-0.9, 1.1), (0.0, 1.3), (-1.3, 0.2)))]
    return Campaign("free steel pendulum in water, torque 0, and three runs cranked slowly with the torque read", machine, motions, 100,
                    Sensors(quantum=2 * np.pi / 8192), "free decay", [], law_of_buoyancy,
                    [Effect("buoyancy_tilt", None, "Archimedes: weight of the displaced water at mid-length, against the weight in air of "
                                                   "arm.yaml", ["torque_gain"])],
                    "share of the weight torque; the stated friction is true. Free decays alone fix nothing but ratios; with the cranked "
                    "runs, a torque scale 13 % low with C_M 2.2 would read the same: only the plausible C_M speaks against it", free=True)


def wall_sided(q: Array) -> Array:
    """What the straight sides of the hull add to its righting moment."""
    return HULL_MASS * 9.81 * 0.5 * 0.058 * np.tan(q + np.pi / 2) ** 2 * np.sin(q + np.pi / 2)


def law_of_hull(scene: Scene) -> Outcome:
    """The righting moment beyond that of a pendulum; torques are zero."""
    return Outcome({"righting_moment": at_joint(scene.state, 1, wall_sided(scene.state.q[:, 0]))}, 0 * scene.tau)


def rolling_hull() -> Campaign:
    """Free roll decays."""
    hull = arm(0.3, 0.05, HULL_MASS, 0.055, 0.42, gravity=GRAVITY, cd=1.6, cm=1.0, known_to=0.02)
    return Campaign("hull that rolls freely: wall-sided formula", hull,
                    [FreeSwing("roll", 14.0, DOWN + a, hull, wall_sided) for a in (0.25, -0.45, 0.6, -0.75, 0.85, -0.35, 0.7)], 50,
                    Sensors(0.0), "free decay", [], law_of_hull,
                    [Effect("righting_moment", 1, "GZ = (GM + BM tan^2(x) / 2) sin x (Scribanti); GM is the com_m of arm.yaml, bilge "
                                                  "keel = the link", ["umbilical_stiffness"])],
                    "share of the weight torque. The linear part is within known_to; buoyancy is inside GM", free=True)
