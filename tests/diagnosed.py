"""Campaigns with known answers and what is diagnosed of them, each diagnosed once a session."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from campaigns import angles_only, heavier, planted, recording, sensor_torque, steady_table, with_links
from rigs import arm
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from nnhydro.diagnosis import diagnose as engine
from nnhydro.diagnosis.decision.decide import decide
from nnhydro.diagnosis.problem.problem import problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.recording import Recording, SteadyTable

ARM, TWO = arm(1), arm(2)
FRICTION = 0.5  # N m
BUOYANCY = float(9.81e3 * np.pi / 4 * ARM.D[0] ** 2 * ARM.L[0])  # N
NOISE = 0.003  # of the torque's rms


def coloured(shape, phi, rng):
    """First-order autoregressive noise of unit variance, (n, joints)."""
    return lfilter([np.sqrt(1 - phi**2)], [1, -phi], rng.standard_normal((shape[0] + 500, shape[1])), axis=0)[500:]


def made(a=ARM, count=6, seconds=4.0, rate=100.0, more=lambda r, k: 0.0, noise=lambda k: NOISE, phi=0.0, name="run{:02d}".format):
    """Recordings of strip theory, torques `more(r, k)` beside it, and noise of `noise(k)` of the torque's rms."""
    found = []
    for k in range(count):
        r = recording(a, planted(a), name(k), seed=k + 1, seconds=seconds, rate=rate)
        rms = np.sqrt((r.tau**2).mean(axis=0))
        found.append(replace(r, tau=r.tau + more(r, k) + noise(k) * rms * coloured(r.tau.shape, phi, np.random.default_rng(k + 50))))
    return found


def dry(r, joint=1, level=FRICTION):
    """Dry friction at one joint, (n, joints) N m, by a law of its own."""
    return level * np.tanh(r.qd / 0.02) * (np.arange(r.qd.shape[1]) == joint - 1)


def differences(r):
    """The recording with the rates of a logger: backward differences of an encoder of 65,536 counts, behind a filter of one sample."""
    q = np.round(r.q * 65536 / (2 * np.pi)) * 2 * np.pi / 65536
    rate = np.diff(q, axis=0, prepend=q[:1]) / (r.t[1] - r.t[0])
    return replace(r, q=q, qd=lfilter([1 - np.exp(-1)], [1, -np.exp(-1)], rate, axis=0), qdd=None)


def rubbing(**keys):
    return Campaign.of(ARM, made(more=lambda r, k: dry(r), **keys))


def of_size(factor):
    """The rubbing arm with all forces and masses times `factor`, in water so much denser."""
    a = ARM.model_copy(update={"fluid": ARM.fluid.model_copy(update={"density_kg_m3": factor * ARM.fluid.density_kg_m3}),
                               "links": tuple(link.model_copy(update={"mass_kg": factor * link.mass_kg, "inertia_kg_m2":
                                                                      factor * link.inertia_kg_m2}) for link in ARM.links)})
    return Campaign.of(a, made(a, count=3, more=lambda r, k: dry(r, level=factor * FRICTION)))


def friction_stated(level=0.45):
    """The rubbing arm, whose friction arm.yaml states: a tenth too small, and as a step where the drive's goes smoothly."""
    known = Arm.model_validate(ARM.document() | {"friction": [{"coulomb_Nm": level, "known_to": 0.15}]})
    return Campaign.of(known, list(rubbing(count=8).recordings()))


def upright_under_water():
    """An upright arm whose buoyancy, half way along the link, nobody stated."""
    upright = Arm.model_validate(ARM.document() | {"gravity_m_s2": 9.81})
    return Campaign.of(upright, made(upright, more=lambda r, k: -BUOYANCY * ARM.L[0] / 2 * np.cos(r.q)))


def shuffled():
    """Three recordings of `rubbing` in another order, with other names."""
    names = ("zeta", "beta", "omega")
    runs = [replace(r, name=name) for r, name in zip(made(count=3, more=lambda r, k: dry(r)), names, strict=True)]
    return Campaign.of(ARM, runs[::-1])


def single_precision():
    def short(x):
        return None if x is None else np.asarray(x, dtype=np.float32).astype(float)

    runs = rubbing(count=3).recordings()
    return Campaign.of(ARM, [replace(r, q=short(r.q), qd=short(r.qd), qdd=short(r.qdd), tau=short(r.tau)) for r in runs])


def pendulum():
    """A free pendulum in air, integrated here: m g c cos q (q from the horizontal), viscous and dry friction; its torque is exactly 0."""
    mass, com, inertia, viscous, coulomb = 1.0, 0.25, 0.03, 0.04, 0.03
    a = Arm.model_validate({"fluid": {"density_kg_m3": 0.0}, "gravity_m_s2": 9.81, "links": [
        {"length_m": 0.5, "diameter_m": 0.03, "mass_kg": mass, "com_m": com, "inertia_kg_m2": inertia}]})
    whole = inertia + mass * com**2

    def acceleration(q, qd):
        return -(mass * 9.81 * com * np.cos(q) + viscous * qd + coulomb * np.tanh(qd / 0.01)) / whole

    found = []
    for k in range(6):
        t = np.arange(800) / 100.0
        begin = [-np.pi / 2 + 1.0 + 0.25 * k, 0.0]
        way = solve_ivp(lambda t, x: [x[1], acceleration(x[0], x[1])], (0, t[-1]), begin, t_eval=t, rtol=1e-8, atol=1e-10)
        q, qd = way.y[0][:, None], way.y[1][:, None]
        rng = np.random.default_rng(k)
        q, qd = q + 1e-4 * rng.standard_normal(q.shape), qd + 1e-3 * rng.standard_normal(q.shape)
        found.append(Recording(f"swing{k}", t, q, np.zeros_like(q), qd))
    return Campaign.of(a, found)


def hanging():
    """A ballasted rod that swings in water on plain bearings, from six angles, undriven; its friction is a hundredth of its weight."""
    com, inertia, coulomb, wet, drag = 0.34, 0.06, 0.13, 0.095, 1.0  # m, kg m^2, N m, kg m^2 of water, N m s^2/rad^2
    a = Arm.model_validate({"fluid": {"density_kg_m3": 998.0}, "gravity_m_s2": 9.81, "links": [
        {"length_m": 0.5, "diameter_m": 0.06, "mass_kg": 3.5, "com_m": com, "inertia_kg_m2": inertia, "known_to": 0.02}]})
    whole, found = inertia + 3.5 * com**2 + wet, []
    for k, swing in enumerate((1.0, -0.8, 0.6, 0.45, -0.3, 0.2)):
        t = np.arange(1400) / 100.0
        way = solve_ivp(lambda t, x: [x[1], -(3.5 * 9.81 * com * np.cos(x[0]) + coulomb * np.tanh(x[1] / 0.01)
                                              + drag * x[1] * abs(x[1])) / whole],
                        (0, t[-1]), [-np.pi / 2 + swing, 0.0], t_eval=t, max_step=0.01)
        q = way.y[0][:, None] + 5e-4 * np.random.default_rng(k).standard_normal((len(t), 1))
        found.append(Recording(f"swing{k}", t, q, np.zeros_like(q), np.diff(q, axis=0, prepend=q[:1]) / t[1]))
    return Campaign.of(a, found)


def tethered(stiffness=0.25, rest=0.3 - np.pi / 2, starts=-np.pi / 2 + 0.6, further=0.35, seconds=10.0):
    """A free pendulum in air with a spring of `stiffness`, rad from `rest`: as told, a cable that pulls with a tenth of its weight."""
    mass, com, inertia = 1.0, 0.25, 0.03
    a = Arm.model_validate({"fluid": {"density_kg_m3": 0.0}, "gravity_m_s2": 9.81, "links": [
        {"length_m": 0.5, "diameter_m": 0.03, "mass_kg": mass, "com_m": com, "inertia_kg_m2": inertia, "known_to": 0.01}]})
    whole, found = inertia + mass * com**2, []
    for k in range(6):
        t = np.arange(round(seconds * 100)) / 100.0
        way = solve_ivp(lambda t, x: [x[1], -(mass * 9.81 * com * np.cos(x[0]) + stiffness * (x[0] - rest)) / whole],
                        (0, t[-1]), [starts + further * k, 0.0], t_eval=t, rtol=1e-8, atol=1e-10)
        q = way.y[0][:, None] + 2e-4 * np.random.default_rng(k).standard_normal((len(t), 1))
        found.append(Recording(f"swing{k}", t, q, np.zeros_like(q)))
    return Campaign.of(a, found)


def springy(resonance=6.0):
    """The link moves as told and the encoder sits on the other side of a spring that resonates at `resonance` Hz with the wet link."""
    inertia = float(Loads(planted(ARM).terms).torque(Flow(ARM, Motion.at([[0.0]], [[0.0]], [[1.0]])))[0, 0])
    stiffness = inertia * (2 * np.pi * resonance) ** 2
    found, rng = [], np.random.default_rng(5)
    for k in range(5):
        r = recording(ARM, planted(ARM), f"run{k:02d}", seed=k + 1, seconds=5.0)
        twist = CubicSpline(r.t, r.tau / stiffness)
        found.append(replace(r, q=r.q + twist(r.t), qd=r.qd + twist(r.t, 1), qdd=r.qdd + twist(r.t, 2),
                             tau=r.tau + NOISE * rng.standard_normal(r.q.shape)))
    return Campaign.of(ARM, found)


def drifting():
    """The zero of the torque sensor creeps over 6 hours, by the clock, not by the names."""
    found = []
    for k, r in enumerate(made(count=8)):
        place = (7 - k) / 7
        found.append(replace(r, tau=r.tau + 0.6 * place**3, clock=1e4 + 3000.0 * (7 - k) + r.t))
    return Campaign.of(ARM, found)


def since(first):
    """Recordings an hour apart by the clock that rub from number `first` on."""
    runs = made(count=8, more=lambda r, k: dry(r) * (k >= first))
    return Campaign.of(ARM, [replace(r, clock=1e4 + 3600.0 * k + r.t) for k, r in enumerate(runs)])


OTHER_WAVES = (0.965, 0.61, 0.74, 1.22, 0.88, 0.53)  # Hz


def held_in_a_wave(height=0.12, frequencies=(0.965,) * 6):
    """An arm held at another angle in each recording, in a deep-water wave along +Y: Morison's load at rest, strip by strip."""
    link, found = ARM.links[0], []
    L, D = link.length_m, link.diameter_m
    x = (np.arange(40) + 0.5) * L / 40
    for k, w in enumerate(2 * np.pi * np.array(frequencies)):
        rng = np.random.default_rng(k + 80)
        t = np.arange(1000) / 50.0
        q, phase = rng.uniform(-1.2, 1.2), rng.uniform(0, 6)
        psi = w * t[:, None] + phase - w**2 / 9.81 * np.sin(q) * x
        speed, slope = height * np.cos(q) * np.cos(psi), -height * np.cos(q) * w * np.sin(psi)
        tau = -(500.0 * 1.1 * D * np.abs(speed) * speed + 1000.0 * np.pi / 2 * D**2 * slope) @ x * L / 40
        angle = q + 1e-4 * rng.standard_normal((len(t), 1))
        found.append(Recording(f"held{k}", t, angle, (tau + max(0.03 * tau.std(), 0.01) * rng.standard_normal(len(t)))[:, None]))
    return Campaign.of(ARM, found)


def late(delay=0.02):
    """Torques that stand where those of `delay` s before belong."""
    return Campaign.of(ARM, [replace(r, tau=CubicSpline(r.t, r.tau)(np.maximum(r.t - delay, r.t[0]))) for r in made()])


def simulated(column):
    """A campaign of `rubbing` whose recordings hold somebody's simulation of the healthy arm."""
    runs = []
    for r in rubbing(count=4).recordings():
        motion = Motion(*(tensor(x) for x in (r.t, r.q, r.qd, r.qdd, np.zeros(len(r.t)), np.zeros(len(r.t)))))
        runs.append(replace(r, tau_sim=sensor_torque(ARM, planted(ARM), motion)) if column else r)
    return Campaign.of(ARM, runs)


def table(bias=0.0):
    """Locked tows alone, joint 1 with an offset of the sensor."""
    whole = steady_table(ARM, planted(ARM), rows=60)
    tau = whole.tau + bias + 0.01 * np.random.default_rng(3).standard_normal(whole.tau.shape)
    return Campaign.of(ARM, [], (replace(whole, tau=tau),))


def shaft(rows, waves=0.0):
    """A shaft that turns at steady speeds against the same friction of 0.9 N m, which may rise and fall with the speed as no law does."""
    qd = np.linspace(0.4, 8.0, rows)[:, None]
    tau = 0.9 + waves * np.cos(qd) + 0.01 * np.random.default_rng(rows).standard_normal(qd.shape)
    light = {"mass_kg": 0.0, "com_m": 0.0, "inertia_kg_m2": 0.0}
    bare = with_links(ARM, **light).model_copy(update={"fluid": ARM.fluid.model_copy(update={"density_kg_m3": 0.0})})
    return Campaign.of(bare, [], (SteadyTable("shaft", tuple(map(str, range(rows))), np.zeros_like(qd), qd, np.zeros(rows), tau),))


def resting(level=4.0, viscous=3.0, bending=3e-4, rate=500.0, seconds=25.0, pause=0.5):
    """A link in air that goes to and fro in trapezoids of speed and rests between; its joint sticks by bristles (Dahl) and drags."""
    a = Arm.model_validate({"fluid": {"density_kg_m3": 0.0}, "gravity_m_s2": 9.81, "links": [
        {"length_m": 0.5, "diameter_m": 0.08, "mass_kg": 6.0, "com_m": 0.25, "inertia_kg_m2": 0.14, "known_to": 0.03}]})
    found = []
    for k in range(3):
        t, low, high, speed, ramp = np.arange(round(seconds * rate)) / rate, -1.9 + 0.2 * k, -0.4, 1.0 + 0.4 * k, 4.0 + k
        whole = (high - low) / speed + speed / ramp
        way, since = np.divmod(np.maximum(t - pause, 0.0), whole + pause)
        qd = np.where(way % 2 == 0, 1.0, -1.0) * np.clip(np.minimum(since, whole - since) * ramp, 0.0, speed)
        for _ in range(3):  # no drive has corners
            qd = lfilter([1 - np.exp(-2 * np.pi * 8 / rate)], [1, -np.exp(-2 * np.pi * 8 / rate)], qd)
        q, qdd = low + np.cumsum(qd) / rate, np.gradient(qd, t)
        z, stuck = 0.0, np.zeros_like(q)
        for i, v in enumerate(qd):
            z = np.sign(v) + (z - np.sign(v)) * np.exp(-abs(v) / rate / bending) if v else z
            stuck[i] = z
        rng = np.random.default_rng(k)
        rigid = (0.14 + 6.0 * 0.25**2) * qdd + 6.0 * 9.81 * 0.25 * np.cos(q)
        tau = rigid + level * stuck + viscous * qd + 0.3 * rng.standard_normal(len(t))
        found.append(Recording(f"run{k}", t, np.round(q / 2.4e-5)[:, None] * 2.4e-5, tau[:, None]))
    return Campaign.of(a, found)


CAMPAIGNS = {
    "healthy": lambda: Campaign.of(ARM, made()),
    "healthy, two links": lambda: Campaign.of(TWO, made(TWO, count=5)),
    "healthy, angles alone": lambda: Campaign.of(ARM, [angles_only(r) for r in made(noise=lambda k: 0.01)]),
    "healthy, rates by differences": lambda: Campaign.of(ARM, [differences(r) for r in made(noise=lambda k: 0.01)]),
    "noise ratio 3": lambda: Campaign.of(ARM, made(noise=lambda k: (0.01, 0.03)[k % 2])),
    "noise ratio 10": lambda: Campaign.of(ARM, made(noise=lambda k: (0.01, 0.1)[k % 2])),
    "noise AR 0.95": lambda: Campaign.of(ARM, made(noise=lambda k: 0.02, phi=0.95)),
    "rubbing": rubbing,
    "rubbing, 1 kHz": lambda: rubbing(rate=1000.0, count=3),
    "rubbing, shuffled and renamed": shuffled,
    "rubbing, single precision": single_precision,
    "rubbing, noise ratio 10": lambda: rubbing(noise=lambda k: (0.01, 0.1)[k % 2]),
    "rubbing, noise AR 0.95": lambda: rubbing(noise=lambda k: 0.02, phi=0.95),
    "rubbing, three recordings": lambda: rubbing(count=3),
    "friction stated": friction_stated,
    "friction stated too small": lambda: friction_stated(0.2),
    "upright under water": upright_under_water,
    "two frictions": lambda: Campaign.of(ARM, made(more=lambda r, k: dry(r, level=0.3) + 0.4 * r.qd)),
    "rubbing, two links": lambda: Campaign.of(TWO, made(TWO, count=5, more=lambda r, k: dry(r, 2, 0.2))),
    "rubbing since the fourth": lambda: since(3),
    "held in a wave": held_in_a_wave,
    "held in other waves": lambda: held_in_a_wave(frequencies=OTHER_WAVES),
    "held in still water": lambda: held_in_a_wave(height=1e-6, frequencies=OTHER_WAVES[:4]),
    "an unlisted law": lambda: Campaign.of(ARM, made(more=lambda r, k: 0.6 * np.sin(3.0 * r.q) * np.cos(2.0 * r.qd), count=5)),
    "free pendulum": pendulum,
    "hanging in water": hanging,
    "tethered": tethered,
    "carried by its spring": partial(tethered, 12.0, 0.25, 0.25, 0.05, 3.0),
    "soft drive": springy,
    "drift": drifting,
    "late": late,
    "a stop in one run": lambda: Campaign.of(ARM, made(count=6, more=lambda r, k: 40.0 * (k == 2) * np.maximum(
        r.q - np.percentile(r.q, 80), 0.0))),
    "not zeroed once": lambda: Campaign.of(ARM, made(count=6, more=lambda r, k: 0.5 * (k == 3))),
    "filling": lambda: Campaign.of(ARM, [
        replace(r, tau=r.tau + k / 7 * (heavy.tau - light.tau)) for k, (r, light, heavy) in enumerate(zip(
            made(count=8), *(made(a, count=8, noise=lambda k: 0.0) for a in (ARM, heavier(ARM, 1.3))), strict=True))]),
    "two slow ones": lambda: Campaign.of(ARM, [replace(angles_only(r), q=np.round(r.q * 4096 / (2 * np.pi)) * 2 * np.pi / 4096) for r in (
        recording(ARM, planted(ARM), f"run{k}", seed=25 + k, rate=50.0, highest=0.22 * (1 + 2 * k), noise=0.01) for k in range(2))]),
    "sticking at rest": resting,
    "column": lambda: simulated(True),
    "rubbing, a giant": partial(of_size, 1e5),
    "rubbing, a dwarf": partial(of_size, 1e-5),
    "steady": table,
    "steady, offset": lambda: table(0.4),
    **{f"shaft, {rows} speeds": partial(shaft, rows) for rows in (8, 12, 30)},
    "shaft, a curve": partial(shaft, 30, 0.6),
    "under a second": lambda: Campaign.of(ARM, made(count=8, seconds=0.9, more=lambda r, k: dry(r))),
}


SEARCHED = ("held in a wave",)  # a quarter of a minute is not spent twice
_explored = {}


@cache
def campaign(name):
    """The campaign called so."""
    return CAMPAIGNS[name]()


@cache
def diagnosed(name, baseline=None, **keys):
    """What is diagnosed of it; of the campaigns in SEARCHED, the search is kept."""
    real = engine._explore

    def explore(design, *others):
        made = real(design, *others)
        if name in SEARCHED and baseline is None and not keys:
            _explored.setdefault(name, (design, *made))
        return made

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "_explore", explore)
        return engine.diagnose(campaign(name), baseline, **keys)


@cache
def searched(name):
    """What a search finds in it: the search of its diagnosis where that was kept."""
    if name not in _explored:
        return engine.search_design(design_on(problem_of(campaign(name)), None), 0)
    design, noise, search, best, model = _explored[name]
    return engine.SearchedCampaign(design, noise, search, decide(search, best, 0), model, search.score(()))


def named(diagnosis):
    """Effects and joints that were found."""
    return {(f.effect, f.law.joint) for f in diagnosis.findings}


def value(name, effect, parameter):
    """(value, low, high) of a parameter of a finding."""
    (finding,) = [f for f in diagnosed(name).findings if f.effect == effect]
    told = finding.parameters[parameter]
    return told.value, *told.ci95
