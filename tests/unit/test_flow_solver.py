"""The flow solver behind datasets/ns_tank: what theory says of short times and of symmetry. Coarse grids keep it quick."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parents[2] / "datasets" / "ns_tank"
spec = importlib.util.spec_from_file_location("ns_tank_flow", FOLDER / "flow.py")
flow = importlib.util.module_from_spec(spec)
sys.modules[spec.name] = flow
spec.loader.exec_module(flow)

COARSE = flow.Grid(angles=48, layers=64, wall=0.01)


def accelerated(a, t):
    """Speeds and accelerations of a cylinder that accelerates at `a` D/s^2 from rest."""
    u = (a * t)[:, None]
    return u, np.full_like(u, a)


def test_the_added_mass_of_a_cylinder_set_off_is_that_of_its_own_volume():
    t = np.linspace(0.0, 2e-3, 9)
    F = flow.forces(t, *accelerated(1.0, t), nu=1e-5, grid=flow.Grid(48, 96, 0.002), longest=1e-4)
    assert F[-1, 0] == pytest.approx(-np.pi / 4, rel=0.02)


def test_the_history_force_of_a_constant_acceleration_is_bassets():
    """F = -pi/4 a - 4 sqrt(pi nu t) a: the Rayleigh layer of the potential flow, friction and pressure alike (in units of rho D^3)."""
    t, nu = np.linspace(0.0, 0.05, 26), 0.01
    F = flow.forces(t, *accelerated(1.0, t), nu=nu, grid=flow.Grid(48, 96, 0.004), longest=5e-4)[:, 0]
    layer = -F[5:] - np.pi / 4
    assert layer / (4 * np.sqrt(np.pi * nu * t[5:])) == pytest.approx(np.ones(21), rel=0.12)


def test_a_motion_the_other_way_meets_the_opposite_force():
    t = np.linspace(0.0, 1.0, 60)
    u = np.sin(3 * t)[:, None] * np.array([1.0, -1.0])
    F = flow.forces(t, u, np.gradient(u, t, axis=0), nu=0.02, grid=COARSE)
    assert np.abs(F[:, 0] + F[:, 1]).max() < 1e-6 * np.abs(F).max()


def test_strips_that_are_computed_together_know_nothing_of_each_other():
    t = np.linspace(0.0, 0.8, 40)
    u = np.minimum(t, 0.5)[:, None] * np.array([1.0, 0.3])
    du = np.gradient(u, t, axis=0)
    both = flow.forces(t, u, du, nu=0.01, grid=COARSE, longest=0.004)
    alone = flow.forces(t, u[:, :1], du[:, :1], nu=0.01, grid=COARSE, longest=0.004)
    assert both[:, 0] == pytest.approx(alone[:, 0], abs=1e-3 * np.abs(both).max())


def test_drag_takes_energy_from_a_cylinder_that_stops():
    t = np.linspace(0.0, 4.0, 200)
    u = (np.sin(np.pi * np.minimum(t, 2.0) / 2.0) ** 2)[:, None]
    F = flow.forces(t, u, np.gradient(u, t, axis=0), nu=0.02, grid=COARSE)
    assert float(np.trapezoid((F * u)[:, 0], t)) < 0


def test_differences_are_exact_for_quartics():
    x = flow.Grid().xi()
    assert np.abs(flow.differences(x, 1) @ x**4 - 4 * x**3).max() < 1e-7
    assert np.abs(flow.differences(x, 2) @ x**4 - 12 * x**2).max() < 1e-5


def test_weights_of_uneven_steps_integrate_parabolas():
    steps = [0.3, 0.2, 0.5]
    times = -np.concatenate([[0.0], np.cumsum(steps[1:])])
    for power in range(3):
        total = sum(w * t**power for w, t in zip(flow.bashforth(steps), times, strict=True))
        assert total == pytest.approx(0.3 ** (power + 1) / (power + 1))
