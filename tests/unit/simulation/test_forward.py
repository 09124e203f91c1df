"""Forward dynamics: the loads' own mass matrix, convergence, energy, and inverse dynamics as its opposite."""

from typing import Any

import numpy as np
import pytest
import torch
from scipy.integrate import simpson

from nnhydro.errors import ConfigError
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm, parse_arm
from nnhydro.simulation.controller import Controller
from nnhydro.simulation.forward import run_controlled
from nnhydro.simulation.motions.motion_kind import Reference, Setting, TimedMotion, motion_of
from nnhydro.simulation.plant import Plant
from nnhydro.simulation.recipe.true_loads import true_loads
from nnhydro.simulation.run import Run, run_prescribed

LINK = {"length_m": 0.5, "diameter_m": 0.06, "mass_kg": 1.2, "com_m": 0.25, "inertia_kg_m2": 0.025}
TERMS: dict[str, Any] = {"normal_drag": {"C_D": 1.0}, "added_mass": {"C_M": 0.8}}
RATE = 500.0  # Hz
SLEW = {"kind": "slew", "name": "m", "q_rad": [[0.0, 0.2], [0.8, -0.5]], "duration_s": 0.3, "rest_s": 0.05}


def arm(links: int = 2, **more: Any) -> Arm:
    return parse_arm({"fluid": {"density_kg_m3": 1000.0}, "links": [LINK] * links, **more}, "arm")


def reference(of: Arm, **changes: Any) -> Reference:
    motion = motion_of({**SLEW, **changes}, "recipe")
    assert isinstance(motion, TimedMotion)
    return motion.reference(Setting(of, np.random.default_rng(0), None))  # type: ignore[arg-type]


def run(of: Arm, loads: Loads, rate_hz: float, hold: int, carriage: dict[str, Any] | None = None, **gains: Any) -> Run:
    law = Controller(**{"kind": "pd", "kp": 40.0, "kd": 4.0, **gains}).torque_law(of)
    return run_controlled({"m": reference(of, carriage=carriage or {})}, Plant(of, loads), law, rate_hz, hold)[0]


def motion_of_run(r: Run) -> Motion:
    q, qd, qdd, u0, du0 = (tensor(x) for x in r.state)
    return Motion(tensor(r.t), q, qd, qdd, u0, du0)


@pytest.mark.slow
def test_inverse_dynamics_of_the_differentiated_motion_returns_the_drive_torque() -> None:
    of = arm()
    loads = true_loads(TERMS, of, "r")
    r = run(of, loads, 1000.0, 1000 // 50)
    q, h = r.state.q, 1 / 1000.0
    held = np.flatnonzero((r.tau[1:-1] == r.tau[:-2]).all(axis=1)) + 1  # the differences do not straddle a step of the torque
    rates, bends = (q[2:] - q[:-2]) / (2 * h), (q[2:] - 2 * q[1:-1] + q[:-2]) / h**2
    zero = np.zeros(len(q) - 2)
    tau = loads.torque(Flow(of, Motion(tensor(r.t[1:-1]), *(tensor(x) for x in (q[1:-1], rates, bends, zero, zero))))).numpy()
    np.testing.assert_allclose(tau[held - 1], r.tau[held], atol=5e-5 * np.abs(r.tau).max())  # differences at 1 kHz: 1.8e-5


@pytest.mark.slow
def test_the_integrator_converges_at_fourth_order() -> None:
    """The water's added mass alone, for |w| w of the drag is only once differentiable."""
    of = arm()
    loads = true_loads({"added_mass": {"C_M": 0.8, "reading": "energy"}}, of, "r")
    tow = {"u0_m_s": 0.5, "start_s": 0.04, "ramp_s": 0.1}  # its corners lie on the steps
    coarse, middle, fine = (run(of, loads, 50.0 * k, k, tow).state.q[-1] for k in (1, 2, 8))
    order = np.log2(np.abs(coarse - fine).max() / np.abs(middle - fine).max())
    assert 3.8 < order < 4.2, order


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pd", "computed_torque"])
def test_the_work_of_the_drives_is_kinetic_energy_and_what_the_drag_takes(kind: str) -> None:
    of = arm()
    loads = true_loads({"normal_drag": {"C_D": 1.0}, "added_mass": {"C_M": 0.8, "reading": "energy"},
                        "axial_added_mass": {"C_Mx": 0.1, "reading": "energy"}}, of, "r")
    gains = {"kind": kind, "kp": 400.0, "kd": 40.0} if kind == "computed_torque" else {}
    r = run(of, loads, RATE, 10, **gains)
    work = (r.tau[:-1] * np.diff(r.state.q, axis=0)).sum()  # exact: the torque is held while the arm moves on
    motion = motion_of_run(r)
    drag = (Loads({"drag": loads.terms["normal_drag"]}).torque(Flow(of, motion)).numpy() * r.state.qd).sum(axis=1)
    mass, _ = Plant(of, loads).mass_and_rest(motion.t, motion.q, torch.zeros_like(motion.q), motion.u0, motion.du0)
    kinetic = 0.5 * torch.einsum("nj,njk,nk->n", motion.qd, mass, motion.qd).numpy()
    assert np.abs(kinetic).max() > 0.1
    assert work == pytest.approx(kinetic[-1] - kinetic[0] + simpson(drag, dx=1 / RATE), rel=8e-5)


@pytest.mark.slow
def test_computed_torque_on_a_dry_arm_follows_the_reference_and_needs_its_inverse_dynamics() -> None:
    of = arm(fluid={"density_kg_m3": 0.0})
    loads = true_loads({}, of, "r")
    r = run(of, loads, 1000.0, 1, kind="computed_torque", kp=400.0, kd=40.0)
    exact = run_prescribed("m", reference(of), of, loads, 1000.0)
    np.testing.assert_allclose(r.state.q, exact.state.q, atol=1e-3)
    assert np.abs(r.tau - exact.tau).mean() < 0.02 * np.abs(exact.tau).max()


@pytest.mark.slow
def test_the_controller_holds_its_torque_and_keeps_its_limit() -> None:
    of = arm()
    r = run(of, true_loads(TERMS, of, "r"), RATE, 10, torque_limit_Nm=[3.0, 1.0])
    assert np.abs(r.tau[:, 0]).max() == 3.0
    assert np.abs(r.tau[:, 1]).max() == 1.0
    changes = np.flatnonzero((np.diff(r.tau, axis=0) != 0).any(axis=1)) + 1
    assert (changes % 10 == 0).all()


@pytest.mark.slow
def test_a_run_does_not_depend_on_the_others_in_its_batch() -> None:
    of = arm()
    loads, law = true_loads(TERMS, of, "r"), Controller(kind="pd", kp=(40.0,), kd=(4.0,)).torque_law(of)
    one, other = reference(of), reference(of, duration_s=0.2)
    alone = run_controlled({"one": one}, Plant(of, loads), law, 200.0, 2)[0]
    beside = {r.name: r for r in run_controlled({"other": other, "one": one}, Plant(of, loads), law, 200.0, 2)}
    np.testing.assert_allclose(beside["one"].state.q, alone.state.q, atol=1e-12)
    assert len(beside["other"].tau) < len(alone.tau)


def test_gains_too_high_are_refused_with_the_motion_and_the_time() -> None:
    of = arm()
    with pytest.raises(ConfigError, match=r"motion 'm': the arm runs away at t = .*lower controller\.kp"):
        run(of, true_loads({}, of, "r"), 1000.0, 20, kp=1e5, kd=1e4)
