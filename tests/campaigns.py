"""Campaigns that tests make from known loads: multi-sine motions with exact derivatives, torques from a sum of terms, chosen noise."""

from dataclasses import replace

import numpy as np
import torch
import yaml
from rigs import arm, scaled

from nnhydro.fitting.config import TrainingConfig
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.recording import Recording, SteadyTable

GIVEN = Preparation(None)  # every derivative is given: nothing is filtered
TINY = TrainingConfig(law=("reynolds",), hidden=(8,), members=2, epochs=4, batch=256, patience=100, strip_net=False)
DEFAULT_LAWS = TINY.model_copy(update={"law": TrainingConfig().law})


def multi_sine(t, links, seed=1, highest=1.2):
    """Angles, rates and accelerations (n, links): three sines a joint between 0.2 and `highest` Hz, from rest at random postures."""
    rng = np.random.default_rng(seed)
    w = 2 * np.pi * rng.uniform(0.2, highest, (3, links))
    a = rng.uniform(0.1, 0.3, (3, links)) * rng.choice([-1, 1], (3, links))
    start = rng.uniform(-1.5, 1.5, links)
    phase = w * np.asarray(t)[:, None, None]
    q = start + (a * (1 - np.cos(phase))).sum(1)
    return q, (a * w * np.sin(phase)).sum(1), (a * w**2 * np.cos(phase)).sum(1)


def carriage(t, speed):
    """Carriage speed and acceleration (n,): a slow wave about `speed`."""
    return speed * (1 + 0.3 * np.sin(1.3 * t)), speed * 0.3 * 1.3 * np.cos(1.3 * t)


def planted(a, C_D=(0.9, 1.3, 0.7), C_M=(0.8, 0.6, 1.1)):
    """Strip theory with unlike coefficients on unlike links."""
    n = a.n_links
    return Loads({"rigid_body": RigidBody.of_arm(a), "normal_drag": NormalDrag(C_D[:n]), "added_mass": AddedMass(C_M[:n])})


def with_links(a, **changes):
    """The arm with some keys of every link changed."""
    return a.model_copy(update={"links": tuple(link.model_copy(update=changes) for link in a.links)})


def heavier(a, factor):
    """The arm with every mass multiplied."""
    return a.model_copy(update={"links": tuple(link.model_copy(update={"mass_kg": factor * link.mass_kg}) for link in a.links)})


def dry(a):
    """The arm without water."""
    return Loads({"rigid_body": RigidBody.of_arm(a)})


def sensor_torque(a, loads, motion):
    """What the sensors read (n, joints) N m."""
    return StripTheory(a, GIVEN, {}, "constant", loads).torque(motion).numpy()


def recording(a, loads, name="run", seed=1, seconds=4.0, rate=100.0, speed=0.0, noise=0.0, highest=1.2):
    """One recording with every derivative given; `noise` is relative to the rms of each torque."""
    t = np.arange(round(seconds * rate)) / rate
    q, qd, qdd = multi_sine(t, a.n_links, seed, highest)
    u0, du0 = carriage(t, speed)
    tau = sensor_torque(a, loads, Motion(tensor(t), tensor(q), tensor(qd), tensor(qdd), tensor(u0), tensor(du0)))
    tau = tau + noise * np.sqrt((tau**2).mean(0)) * np.random.default_rng(1000 + seed).standard_normal(tau.shape)
    towed = {"u0": u0, "du0": du0} if speed else {}
    return Recording(name, t, q, tau, qd, qdd, **towed)


def campaign(a, loads, count=4, noise=0.0, seconds=4.0, rate=100.0, **keys):
    """`count` recordings, every other one under tow."""
    return Campaign.of(a, [recording(a, loads, f"run{i}", seed=i + 1, noise=noise, seconds=seconds, rate=rate,
                                     speed=0.4 * (i % 2), **keys) for i in range(count)])


def unlike_arms():
    """Campaigns of three arms of other lengths in the same water, with the same coefficients."""
    return tuple(_with_name(campaign(a, planted(a), 3, seconds=2.0, rate=50.0), f"arm{k}")
                 for k, a in enumerate(scaled(arm(2), factor) for factor in (0.8, 1.0, 1.3)))


def _with_name(whole, name):
    whole.arm = whole.arm.model_copy(update={"name": name})
    return whole


def steady_table(a, loads, rows=40, seed=1, name="tows"):
    """Locked tows at random postures and speeds."""
    rng = np.random.default_rng(seed)
    q, u0 = rng.uniform(-1.5, 1.5, (rows, a.n_links)), rng.uniform(0.3, 1.0, rows)
    tau = sensor_torque(a, loads, Motion.at(q, 0.0, 0.0, u0))
    return SteadyTable(name, tuple(str(i) for i in range(rows)), q, np.zeros_like(q), u0, tau)


def angles_only(r):
    """The recording as most rigs make it: angles and torques alone."""
    return replace(r, qd=None, qdd=None, du0=None)


def with_torque(whole, change):
    """The campaign with the torques tau of each recording replaced by change(name, tau)."""
    return Campaign.of(whole.arm, [replace(r, tau=change(r.name, r.tau)) for r in whole.recordings()], whole.steady)


def same_tensors(one, other):
    """Whether two learned models hold bit for bit the same numbers."""
    return all(torch.equal(x, y) for x, y in zip(one.arrays().values(), other.arrays().values(), strict=True))


def columns_of(r, torque=True):
    """The columns of contract.md of a recording, name to values."""
    found = {"t_s": r.t}
    tau = r.tau if torque else None
    for stem, unit, values in (("q", "rad", r.q), ("dq", "rad_s", r.qd), ("ddq", "rad_s2", r.qdd), ("tau", "Nm", tau)):
        if values is not None:
            found |= {f"{stem}{j + 1}_{unit}": column for j, column in enumerate(values.T)}
    return found | {name: x for name, x in (("u0_m_s", r.u0), ("du0_m_s2", r.du0)) if x is not None}


def write_csv(path, columns):
    """Write columns of numbers to a CSV file, every digit kept."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = (",".join(repr(float(x)) for x in row) for row in zip(*columns.values(), strict=True))
    path.write_text("\n".join([",".join(columns), *rows]) + "\n")
    return path


def write_folder(whole, folder):
    """Write a campaign in memory to a campaign folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.yaml").write_text(yaml.safe_dump(whole.arm.document()))
    for r in whole.recordings():
        write_csv(folder / "recordings" / f"{r.name}.csv", columns_of(r))
    return folder
