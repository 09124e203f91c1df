"""Four campaigns with hidden effects of water around the arm: a tool in it, oil, a current with a seal, waves with a bias."""

import numpy as np
from campaign import Campaign, Effect, Outcome, Scene, Sensors
from curves import hold, speeds
from machines import GRAVITY, Array, arm, tank_arm
from mechanics import STRIPS, at_joint, drag_torques, normal_torques, torques_of_force
from motions import Motion, fourier, slews, tow
from responses import half_derivative


def law_of_ball(scene: Scene) -> Outcome:
    """A sphere at the tip: its mass with half the displaced water, and its drag."""
    machine, last, diameter = scene.machine, scene.machine.links - 1, 0.085
    place, velocity, acceleration = scene.links[last].point(machine.length[last])
    mass = 0.45 + 0.5 * machine.density * np.pi / 6 * diameter**3
    drag = 0.5 * machine.density * 0.47 * np.pi / 4 * diameter * diameter * np.linalg.norm(velocity, axis=1)[:, None] * velocity
    return Outcome({"payload_mass": torques_of_force(scene.links, last, mass * acceleration, place),
                    "tip_drag": torques_of_force(scene.links, last, drag, place)})


def ball_at_tip() -> Campaign:
    """A tool that has mass and drag."""
    rng = np.random.default_rng(14)
    motions = [*(slews(rng, [-1, -2], [1, 2], times=(0.6, 1.3)) for _ in range(8)),
               *(fourier(rng, [0, rng.uniform(-1, 1)], [0.6, 0.9], 0.6) for _ in range(6)),
               *(tow([0.3 * k, -0.5 + 0.4 * k], 0.4 + 0.15 * k) for k in range(4))]
    return Campaign("ball-shaped tool at the tip of a two-link arm", tank_arm(), motions, 100, Sensors(rates=0.005, accelerations=0.08),
                    "plain", [fourier(rng, [0, 0.5], [0.6, 0.8], 0.55)], law_of_ball,
                    [Effect("payload_mass", None, "0.45 kg + half the displaced water of an 8.5 cm sphere (Lamb)"),
                     Effect("tip_drag", None, "sphere C_D 0.47 on the whole velocity vector",
                            ["axial_drag", "drag_form", "reynolds_drag"])],
                    "tip_drag may be told as drag_form (taper): the drag of a ball across the link is that of a longer link")


def law_of_oil(scene: Scene) -> Outcome:
    """Stokes' cylinder: the memory of the boundary layer, and a drag linear in speed."""
    machine, state, cube = scene.machine, scene.state, scene.machine.length[0] ** 3
    memory = 2 * machine.density * machine.diameter[0] * np.sqrt(np.pi * machine.viscosity) * cube / 3
    linear = 4 * np.pi * machine.density * machine.viscosity * cube / 3
    return Outcome({"history_force": at_joint(state, 1, memory * half_derivative(state.dq[:, 0], state.dt)),
                    "drag_form": at_joint(state, 1, linear * state.dq[:, 0])})


def paddle_in_oil() -> Campaign:
    """Quick kicks and rests in oil."""
    rng = np.random.default_rng(19)

    def kick() -> Motion:
        speed = rng.uniform(1.0, 4.0) * rng.choice([-1, 1])
        rise, stay = rng.uniform(0.12, 0.35), rng.uniform(0.1, 0.6)
        there = (0.4, 0), (0.4 + rise, speed), (0.4 + rise + stay, speed), (0.4 + 2 * rise + stay, 0)
        back = (3.2, 0), (3.2 + rise, -speed * 0.8), (3.2 + rise + stay, -speed * 0.8), (3.2 + 2 * rise + stay, 0)
        return Motion("kick", 7.0, [speeds(rng.uniform(-1, 0), *there, *back)])
    machine = arm(0.4, 0.03, 0.45, 0.19, 0.0065, density=965.0, viscosity=1e-4, cm=1.0)
    motions = [*(kick() for _ in range(12)), *(fourier(rng, [0], [0.5], 1.0, 8.0) for _ in range(4))]
    return Campaign("small paddle in silicone oil of 100 cSt", machine, motions, 100, Sensors(0.008, rates=0.003), "plain", [kick()],
                    law_of_oil,
                    [Effect("history_force", None,
                            "Basset kernel of a cylinder, 2 rho D sqrt(pi nu): first term of Stokes (1851) at large beta"),
                     Effect("drag_form", None, "second term of Stokes: 4 pi rho nu w a length; on one link about a fixed hub the same as "
                                               "viscous friction", ["viscous_friction", "reynolds_drag"])],
                    "the linear part may be told as viscous_friction at joint 1, exactly the same here", dt=0.001)


def law_of_current(scene: Scene) -> Outcome:
    """A uniform current that swings a little; dry friction of a seal at joint 2."""
    machine, state, heading, added = scene.machine, scene.state, 2.3, np.zeros_like(scene.tau)
    swing = 1 + 0.05 * np.sin(2 * np.pi * state.clock / 900)

    def onto(axis: Array) -> Array:
        return np.cos(heading) * axis[:, 0] + np.sin(heading) * axis[:, 1]
    for i, link in enumerate(scene.links):
        across, along = 0.085 * swing * onto(link.across), 0.085 * onto(link.along)
        added = added + drag_torques(machine, scene.links, i, machine.cd[i], link.w - across[:, None])
        added = added - drag_torques(machine, scene.links, i, machine.cd[i])
        load = machine.cm[i] * machine.density * np.pi * machine.diameter[i] ** 2 / 4 * (link.spin * along)[:, None] * np.ones(STRIPS)
        added = added + normal_torques(scene.links, i, load)
    return Outcome({"ambient_current": added, "coulomb_friction": at_joint(state, 2, 0.15 * np.tanh(state.dq[:, 1] / 0.002))})


def tank_with_pump() -> Campaign:
    """A current in the tank, and a seal that rubs."""
    rng = np.random.default_rng(20)
    motions = [*(slews(rng, [-3, -1.4], [3, 1.4], times=(0.9, 2.0)) for _ in range(8)),
               *(fourier(rng, [a, 0], [0.6, 0.9], 0.4) for a in (-2, -0.7, 0.6, 1.9, 3.0)),
               *(Motion("still", 5.0, [hold(a), hold(0.4)]) for a in (-1.0, 0.8, 2.4))]
    return Campaign("tank with a pump running, lip seal at the elbow", tank_arm(), motions, 60, Sensors(rates=0.004), "plain",
                    [fourier(rng, [1.2, 0], [0.6, 0.9], 0.4)], law_of_current,
                    [Effect("ambient_current", None, "uniform 0.085 m/s towards 132 degrees, 5 % swing in 15 min; drag and added mass on "
                                                     "the relative velocity"),
                     Effect("coulomb_friction", 2, "double lip: 2 x 2 pi f R_L R_s^2, pressed on by the depth, constant (Rivera 3-2-3)",
                            ["stribeck_friction", "load_friction"])])


def law_of_waves(scene: Scene) -> Outcome:
    """Airy's wave by Morison on each strip, small convective part left out; sensor 1 is not zeroed."""
    machine, state, added = scene.machine, scene.state, np.zeros_like(scene.tau)
    omega, amplitude, depth, way = 2 * np.pi / 1.7, 0.045, 0.5, np.array([np.cos(0.6), np.sin(0.6)])
    number, carried = omega**2 / GRAVITY, np.cumsum(state.u0) * state.dt
    for i, link in enumerate(scene.links):
        place = link.place[:, None, :] + link.x[None, :, None] * link.along[:, None, :]
        phase = number * (place @ way + (carried * way[1])[:, None]) - omega * state.clock[:, None]
        speed = amplitude * omega * np.exp(-number * depth) * np.cos(phase)
        acceleration = amplitude * omega * omega * np.exp(-number * depth) * np.sin(phase)
        across, along = (link.across @ way)[:, None], (link.along @ way)[:, None]
        w, area = link.w - speed * across, machine.density * np.pi * machine.diameter[i] ** 2 / 4
        load = 0.5 * machine.density * machine.diameter[i] * machine.cd[i] * (np.abs(w) * w - np.abs(link.w) * link.w)
        load = load - area * (1 + machine.cm[i]) * (acceleration * across)
        load = load + area * machine.cm[i] * link.spin[:, None] * speed * along
        added = added + normal_torques(scene.links, i, load)
    return Outcome({"wave_orbital": added, "torque_bias": at_joint(state, 1, 0.09)})


def waves_overhead() -> Campaign:
    """Regular waves, and a constant in torque 1."""
    rng = np.random.default_rng(21)
    motions = [*(slews(rng, [-1, -1.4], [1, 1.4], 6, times=(0.9, 2.0)) for _ in range(6)),
               *(fourier(rng, [0, 0], [0.6, 0.8], 0.4) for _ in range(4)),
               *(Motion("still", 10.0, [hold(a), hold(b)]) for a, b in ((0, 0), (0.7, 0.5), (-0.6, 1.0)))]
    return Campaign("regular waves overhead, shoulder sensor not zeroed", tank_arm(), motions, 50, Sensors(rates=0.004), "plain",
                    [fourier(rng, [0.1, 0], [0.6, 0.8], 0.4)], law_of_waves,
                    [Effect("wave_orbital", None, "Airy, 1.7 s, 45 mm high (amplitude), 0.5 m deep, phase runs on with the clock; "
                                                  "Froude-Krylov and (1 + C_M) added mass, phase over the arm"),
                     Effect("torque_bias", 1, "constant")], pause_s=15.0)
