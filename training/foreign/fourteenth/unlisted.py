"""Three campaigns with a cause that no catalogue has."""

import numpy as np
from campaign import Campaign, Effect, Outcome, Scene, Sensors
from curves import points, speeds
from machines import arm, tank_arm
from mechanics import at_joint
from motions import DEGREE, Motion, fourier, slews, tow


def law_of_munk(scene: Scene) -> Outcome:
    """A share of the Munk moment, by the speeds along and across the link."""
    machine, link = scene.machine, scene.links[0]
    across = machine.cm[0] * machine.density * np.pi * machine.diameter[0] ** 2 / 4
    speed = link.w[:, 0] - link.spin * link.x[0]
    moved = speed * machine.length[0] + link.spin * machine.length[0] ** 2 / 2
    return Outcome({"unknown": at_joint(scene.state, 1, 0.4 * (across - 0.05 * across) * link.axial * moved)})


def stout_link() -> Campaign:
    """Tows and turns at all angles to the tow."""
    rng = np.random.default_rng(31)
    plan = [(0, 0.5), (25, 0.8), (50, 0.9), (70, 1.0), (110, 0.9), (140, 0.8), (165, 0.7), (-30, 0.9), (-55, 1.0), (-80, 0.8),
            (-125, 0.9), (-150, 0.6)]
    motions = [*(tow([a * DEGREE], u, 7.0) for a, u in plan),
               *(Motion("turn", 8.0, [points((0.5, a), (4.0, a + 2.2), (4.6, a + 2.2), (7.6, a - 0.4))],
                        speeds(0, (0.2, 0), (1.2, u), (6.8, u), (7.8, 0))) for a, u in [(-1.0, 0.5), (0.3, 0.7), (2.0, 0.6), (-2.6, 0.8)]),
               *(slews(rng, [-1.2], [1.2]) for _ in range(2))]
    return Campaign("stout link towed at all angles: Munk moment", arm(0.45, 0.12, 5.4, 0.22, 0.1, cd=0.75, cm=0.95, known_to=0.02),
                    motions, 50, Sensors(rates=0.003), "plain", [], law_of_munk,
                    [Effect("unknown", 1, "Munk moment of a finite link, 0.4 of the ideal (m_y - m_x) u_x int w dx (the separated wake "
                                          "takes the rest): not in the document reading of the added mass that the contract names",
                            ["munk_moment"])])


def law_of_eccentric_seal(scene: Scene) -> Outcome:
    """The stated friction, larger at some angles and smaller at others."""
    q, v = scene.state.q[:, 0], scene.state.dq[:, 0]
    coulomb = scene.machine.friction[0][0] if scene.machine.friction else 0.0
    return Outcome({"unknown": at_joint(scene.state, 1, 0.85 * coulomb * np.cos(3 * (q - 0.35)) * np.tanh(v / 0.004))})


def eccentric_seal() -> Campaign:
    """A shaft that is not round."""
    rng = np.random.default_rng(32)
    motions = [*(fourier(rng, [rng.uniform(-0.6, 0.6), 0], [1.0, 0.6], 0.28, 12.0, terms=2) for _ in range(8)),
               *(slews(rng, [-1.8, -1.2], [1.8, 1.2], times=(1.0, 2.0), fastest=1.7) for _ in range(6))]
    return Campaign("out-of-round shaft in its seal: stated friction waxes and wanes with the angle",
                    tank_arm(friction=[(1.1, 0.08), (0.08, 0.01)]), motions, 60, Sensors(ar=0.9, rates=0.004), "ar9", [],
                    law_of_eccentric_seal,
                    [Effect("unknown", 1, "Coulomb friction x 0.85 cos 3 (q - 0.35), zero on average; the mean is in arm.yaml")])


def law_of_radial_pull(scene: Scene) -> Outcome:
    """A share of the centripetal force in the reading."""
    pull = scene.machine.mass[0] * scene.machine.com[0] * scene.state.dq[:, 0] ** 2
    return Outcome({"unknown": at_joint(scene.state, 1, 0.085 * pull)})


def pulled_sensor() -> Campaign:
    """A spinning link whose sensor is not deaf to its pull."""
    rng = np.random.default_rng(33)

    def spin(first: float, second: float) -> Motion:
        knots = (0.3, 0), (1.2, first), (2.6, first), (3.6, second), (5.4, second), (6.4, 0)
        return Motion("spin", 7.0, [speeds(rng.uniform(-2, 2), *knots)])
    plan = [(1.0, 2.0), (-1.5, -2.5), (2.5, -1.0), (1.8, 3.0), (-3.0, 1.5), (-0.8, -1.6), (2.2, -2.2), (3.0, 1.0), (-2.6, -1.2)]
    motions = [*(spin(first, second) for first, second in plan), *(fourier(rng, [0], [0.8], 0.6, 8.0) for _ in range(4))]
    return Campaign("torque sensor that also feels the radial pull at the hub", arm(0.6, 0.05, 3.4, 0.31, 0.11, known_to=0.02), motions, 80,
                    Sensors(0.012, tails=3.0, rates=0.004), "heavy", [], law_of_radial_pull,
                    [Effect("unknown", 1, "reading + 0.085 m x centripetal force: even in speed, whichever way it turns",
                            ["force_crosstalk"])])
