"""Laws that planted arms have beside truth.py's, each written here anew; numpy only, nothing of the package.

`planted(seed)` gives a campaign, what it hides and how large that is: the rms of the torque it adds over the rms of the torque.
"""

import numpy as np
from truth import campaign, torque

SHARES = (0.05, 0.15, 0.4)  # of the torque's rms


def friction(rng, true, t, motion, j):
    """Coulomb's."""
    return np.tanh(motion[1][:, j] / 0.002)


def stribeck(rng, true, t, motion, j):
    """Coulomb's with a breakaway twice as large below 0.15 rad/s."""
    rate = motion[1][:, j]
    return np.tanh(rate / 0.002) * (1 + np.exp(-((rate / 0.15) ** 2)))


def viscous(rng, true, t, motion, j):
    """In proportion to the rate."""
    return motion[1][:, j]


def rotor(rng, true, t, motion, j):
    """In proportion to the joint's own acceleration."""
    return motion[2][:, j]


def hose(rng, true, t, motion, j):
    """A spring with a rest angle."""
    return motion[0][:, j] - 0.4


def ripple(rng, true, t, motion, j):
    """A wave over the joint's angle."""
    return np.sin(9 * motion[0][:, j] + 0.7)


def product(rng, true, t, motion, j):
    """No law of any card: a product of both joints' angles and a rate."""
    return np.sin(2 * motion[0][:, 0]) * np.sin(2 * motion[0][:, 1]) * motion[1][:, 0]


def current(rng, true, t, motion):
    """Water that flows along X at 0.1 m/s."""
    flow = np.tile([0.1, 0.0], (len(t), 1))
    return torque(true, *motion, water=(flow, 0 * flow))


def wave(rng, true, t, motion):
    """Water that sways along Y at 0.8 Hz, its phase another in every recording."""
    w, phase = 2 * np.pi * 0.8, rng.uniform(0, 2 * np.pi)
    sway = 0.08 * np.stack([0 * t, np.cos(w * t + phase)], axis=1)
    pull = -0.08 * w * np.stack([0 * t, np.sin(w * t + phase)], axis=1)
    return torque(true, *motion, water=(sway, pull))


def reynolds(rng, true, t, motion):
    """C_D that falls with the Reynolds number to the power of -0.3 about 2e4."""
    return torque(true, *motion, drag=lambda w, D: np.clip(np.abs(w) * D / 1e-6 / 2e4, 0.01, 100) ** -0.3)


def payload(rng, true, t, motion):
    """A point mass of 0.3 kg at the tip."""
    heavier = {**true, "links": [true["links"][0], _with_mass(true["links"][1], 0.3)]}
    return torque(heavier, *motion)


def _with_mass(link, extra):
    m, c, L = link["mass_kg"], link["com_m"], link["length_m"]
    com = (m * c + extra * L) / (m + extra)
    inertia = link["inertia_kg_m2"] + m * (c - com) ** 2 + extra * (L - com) ** 2
    return {**link, "mass_kg": m + extra, "com_m": com, "inertia_kg_m2": inertia}


ADDED = {"coulomb_friction": friction, "stribeck_friction": stribeck, "viscous_friction": viscous, "rotor_inertia": rotor,
         "umbilical_stiffness": hose, "torque_ripple": ripple, "unknown": product}
WHOLE = {"ambient_current": current, "wave_orbital": wave, "reynolds_drag": reynolds, "payload_mass": payload}
SENSED = ("torque_gain", "torque_bias", "sensor_timing", "joint_elasticity", "torque_saturation", "torque_crosstalk")
GIVEN = {"ambient_current": 0.1, "wave_orbital": 0.08, "payload_mass": 0.3}
KINDS = (*ADDED, *WHOLE, *SENSED)


def _delayed(t, x, lag):
    return np.stack([np.interp(t - lag, t, x[:, k]) for k in range(x.shape[1])], axis=1)


def _bent(true, t, motion, j, stiffness):
    """Angles of the motor where the link's are `motion`: theta = q + tau / k, rates and accelerations by differences."""
    tau = torque(true, *motion)
    q, qd, qdd = (x.copy() for x in motion[:3])
    q[:, j] += tau[:, j] / stiffness
    qd[:, j] += np.gradient(tau[:, j], t) / stiffness
    qdd[:, j] += np.gradient(np.gradient(tau[:, j], t), t) / stiffness
    return tau, q, qd, qdd


def sensed(name, j, share, true, t, motion, scale):
    """Torques and angles as faulty instruments tell them."""
    tau = torque(true, *motion)
    if name == "torque_gain":
        tau[:, j] *= 1 + share
    elif name == "torque_bias":
        tau[:, j] += share * scale
    elif name == "sensor_timing":
        tau = _delayed(t, tau, 0.1 * share)
    elif name == "joint_elasticity":
        return _bent(true, t, motion, j, scale / (0.1 * share))
    elif name == "torque_saturation":
        tau[:, j] = np.clip(tau[:, j], -2 * scale * (1 - share), 2 * scale * (1 - share))
    else:
        tau[:, j] += share * tau[:, 1 - j]
    return tau, *motion[:3]


def planted(seed):
    """Return (kind, arm document, recordings, hidden): effect, joint (1, 2, None for the arm), share, the law's value where it has one.
    """
    name, share = KINDS[seed % len(KINDS)], SHARES[(seed // len(KINDS)) % 3]
    rng = np.random.default_rng([seed, 1])
    j, size, told, value = int(rng.integers(2)), [], [], [GIVEN.get(name)]

    def plant(true, t, motion):
        dry = torque(true, *motion)
        scale = float(dry[:, j].std())
        if name in SENSED:
            size.append(scale)
            made = sensed(name, j, share, true, t, motion, size[0])
            value[0] = {"torque_bias": share * size[0], "sensor_timing": 0.1 * share, "joint_elasticity": 0.1 * share / size[0]}.get(name)
        elif name in WHOLE:
            made = (WHOLE[name](rng, true, t, motion), *motion[:3])
        else:
            law = ADDED[name](rng, true, t, motion, j)
            if not size:
                size.append(share * scale / float(law.std()))
                value[0] = None if name in ("stribeck_friction", "unknown") else size[0]
            tau = dry.copy()
            tau[:, j] += size[0] * law
            made = (tau, *motion[:3])
        told.append(float(max((made[0] - dry).std(axis=0) / dry.std(axis=0))))
        return made

    kind, arm, recordings = campaign(seed, plant)
    joint = None if name in WHOLE or name == "sensor_timing" else j + 1
    return kind, arm, recordings, {"effect": name, "joint": joint, "share": float(np.mean(told)), "value": value[0]}
