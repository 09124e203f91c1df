"""Two-dimensional Navier-Stokes flow past circular cylinders that move along a line in still water: many strips at once, in step.

    dw/dt + (psi_theta w_xi - psi_xi w_theta)/r^2 = (1/r^2) [(nu_s w_xi)_xi + nu_s w_theta,theta]         r = exp(xi)/2 diameters
    psi_xi,xi + psi_theta,theta = -r^2 w;  wall: psi = psi_xi = 0;  far away: psi -> -u(t) r sin theta

Frame of the cylinder. w vorticity, psi stream function; lengths in diameters, times in seconds. Fourier in theta (2/3 rule), five-point
differences on a stretched grid in xi; Adams-Bashforth of third order for advection, backward Euler for diffusion (steps are a few
thousandths of the time for one diameter); every step meets no-slip exactly (influence matrix). From NEAR diameters on nu_s grows, so that
the coarse grid far away can carry the wake out. In-line force of the water on the cylinder from the wall's vorticity w and its flux, with
the force of the frame's acceleration:

    F/(rho D^3) = -2 pi Im[ nu (w_xi - w)_1 / 2 ] + pi/4 du/dt                                           [1/s^2 a unit of D]

Sources: Koumoutsakos & Leonard (1995), J. Fluid Mech. 296, 1 (impulsive start, wall vorticity flux); Collins & Dennis (1973),
J. Fluid Mech. 60, 105 (log-polar grid). Imports nothing of nnhydro.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, rfft

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

FAR = 25.0  # diameters: outer radius
NEAR = 5.0  # diameters: beyond it the viscosity grows
COURANT = 0.45  # of the largest eigenvalue of the advection; Adams-Bashforth of third order is stable up to 0.72
WAVER = 0.05  # of the speed: across its way a strip moves WAVER u sin(s), s its travel in diameters; what ends the wake's symmetry
LEVEL = 2.0**0.5  # ratio of neighbouring time steps
FIRST = 12  # level of the first step


def stencil(x: Array, at: float, order: int) -> Array:
    """Weights of the values at the points x for the derivative of `order` at `at` (Fornberg 1988)."""
    powers = np.vander(x - at, increasing=True).T
    wanted = np.zeros(len(x))
    wanted[order] = float(np.prod(np.arange(1, order + 1)))
    return np.linalg.solve(powers, wanted)


def differences(x: Array, order: int, width: int = 5) -> Array:
    """(n, n) matrix of the derivative of `order` from `width` neighbours."""
    n = len(x)
    D = np.zeros((n, n))
    scale = x[-1] / n
    for i in range(n):
        first = min(max(i - width // 2, 0), n - width)
        near = slice(first, first + width)
        D[i, near] = stencil(x[near] / scale, x[i] / scale, order) / scale**order
    return D


@dataclass(frozen=True)
class Grid:
    """`angles` points round the cylinder, `layers` from the wall to FAR; `wall` is the first step in xi."""

    angles: int = 128
    layers: int = 112
    wall: float = 0.010

    @property
    def modes(self) -> int:
        """Fourier modes kept, 0 included: the 2/3 rule."""
        return self.angles // 3 + 1

    def xi(self) -> Array:
        """Points of xi: steps grow smoothly away from the wall."""
        end, s = np.log(2 * FAR), np.linspace(0.0, 1.0, self.layers)
        slope = self.wall * (self.layers - 1) / end  # of xi/end at the wall
        return end * (slope * s + (1 - slope) * s**2 * (1.6 - 0.6 * s))


class Flow:
    """B independent flows of viscosity `nu` (D^2/s), all with the same time step, at rest at first."""

    def __init__(self, batch: int, nu: float, grid: Grid = Grid(), fades: float = np.inf) -> None:
        self.grid, self.nu, self.fades = grid, nu, fades
        self.xi = grid.xi()
        self.r = np.exp(self.xi) / 2
        self.D1, self.D2 = differences(self.xi, 1), differences(self.xi, 2)
        self.k = np.arange(grid.modes)
        n = grid.layers
        self.dr = self.r * np.gradient(self.xi)
        self._poisson()
        self._steppers: dict[float, tuple[Array, Array]] = {}
        self.w = np.zeros((grid.modes, n, batch), dtype=complex)
        self.past: list[tuple[float, Complex]] = []
        self.travel, self.fastest = np.zeros(batch), 0.0

    def _poisson(self) -> None:
        """psi = G (-r^2 w) + b i u; the same for its slope."""
        n, G = self.grid.layers, []
        for k in self.k:
            P = self.D2 - k**2 * np.eye(n)
            P[0] = np.eye(n)[0]
            P[-1] = self.D1[0] if k == 0 else self.D1[-1] + k * np.eye(n)[-1]
            G.append(np.linalg.inv(P))
        inverse = np.stack(G)
        self.far = inverse[1][:, -1] * self.r[-1]  # psi_1 of i u = 1
        inside = -(self.r**2)
        inside[[0, -1]] = 0.0
        self.G = inverse * inside
        self.G_slope = self.D1 @ self.G

    def _stepper(self, dt: float, speed: float) -> tuple[Array, Array]:
        """H (modes, n, n): the new w of the right-hand side; far (n,): what i u adds to mode 1."""
        if dt not in self._steppers:
            n, H, far = self.grid.layers, [], np.zeros(self.grid.layers)
            grown = self.nu + 0.15 * speed * self.dr * np.clip((self.r / NEAR - 1.0), 0.0, 2.0)
            for k in self.k:
                L = (grown[:, None] * self.D2 + (self.D1 @ grown)[:, None] * self.D1 - np.diag(grown * k**2)) / (self.r**2)[:, None]
                A = np.eye(n) - dt * L
                A[0] = self.D1[0] if k == 0 else np.eye(n)[0]
                A[-1] = np.eye(n)[-1]
                inverse = np.linalg.inv(A)
                h = inverse[:, 0].copy()
                inverse[:, [0, -1]] = 0.0
                if k:
                    slope = self.D1[0] @ self.G[k]
                    inverse = inverse - np.outer(h, slope @ inverse) / (slope @ h)
                if k == 1:
                    far = -h * (self.D1[0] @ self.far) / (slope @ h)
                H.append(inverse)
            self._steppers[dt] = np.stack(H), far
        return self._steppers[dt]

    def _apply(self, M: Array, x: Complex) -> Complex:
        """M (modes, n, n) on x (modes, n, B)."""
        return (M @ x.view(float)).view(complex)

    def stream(self, u: Complex) -> tuple[Complex, Complex]:
        """psi and psi_xi (modes, n, B) at speeds u (B,) D/s, across the way in the imaginary part."""
        psi, slope = self._apply(self.G, self.w), self._apply(self.G_slope, self.w)
        drive = 1j * np.conj(u)
        psi[1] += self.far[:, None] * drive
        slope[1] += (self.D1 @ self.far)[:, None] * drive
        return psi, slope

    def advection(self, u: Complex) -> Complex:
        """-(psi_theta w_xi - psi_xi w_theta)/r^2 (modes, n, B); notes how fast the flow crosses the grid."""
        psi, slope = self.stream(u)
        ik = 1j * self.k[:, None, None]
        gradient = (self.D1 @ self.w.view(float)).view(complex)
        angles = self.grid.angles
        across, along, turn, climb = (irfft(x, n=angles, axis=0, norm="forward") for x in (ik * psi, slope, ik * self.w, gradient))
        r2, step = (self.r**2)[:, None], np.gradient(self.xi)[:, None]
        rate = np.abs(along).max(axis=0) * (self.grid.modes - 1) + np.abs(across).max(axis=0) * 1.37 / step
        self.fastest = float((rate / r2).max())
        return rfft(along * turn - across * climb, axis=0, norm="forward")[:self.grid.modes] / r2

    def force(self, du: Array) -> Array:
        """F (B,): force of the water on a unit of span over rho D^3 [1/s^2]; the flow must be at the time of du (B,) D/s^2."""
        one = self.w[1]
        flux = (self.D1[0] @ one.view(float)).view(complex)
        return -np.pi * self.nu * (flux - one[0]).imag + np.pi / 4 * du

    def _wavering(self, u: Array) -> Complex:
        """Speed along and (imaginary) across the way."""
        found: Complex = u * (1 + 1j * WAVER * np.sin(self.travel) * np.exp(-self.travel / self.fades))
        return found

    def step(self, dt: float, before: Array, after: Array, speed: float) -> None:
        """Go on by dt s; the speeds (B,) at its beginning and end in D/s, at most `speed`."""
        H, far = self._stepper(dt, speed)
        drive = self._wavering(before)
        self.travel = self.travel + dt * (np.abs(before) + np.abs(after)) / 2
        self.past = [(dt, self.advection(drive)), *self.past[:2]]
        rhs = self.w.copy()
        for weight, (_, N) in zip(bashforth([h for h, _ in self.past]), self.past, strict=True):
            rhs += weight * N
        self.w = self._apply(H, rhs)
        self.w[1] += far[:, None] * 1j * np.conj(self._wavering(after))


def bashforth(steps: list[float]) -> list[float]:
    """Weights of the rates now and before for the step steps[0]; steps[1:] led from one of the earlier rates to the next."""
    h = steps[0]
    times = -np.concatenate([[0.0], np.cumsum(steps[1:])]) / h
    powers = np.vander(times, increasing=True).T
    return list(h * np.linalg.solve(powers, 1.0 / np.arange(1, len(steps) + 1)))


def forces(t: Array, u: Array, du: Array, nu: float, grid: Grid = Grid(), longest: float = 0.01,
           fades: float = np.inf) -> Array:
    """F (n, B) over rho D^3 [1/s^2] at the times t (n,) s of B strips with speeds u and accelerations du (n, B) in D/s, D/s^2.

    Steps of at most `longest` s, as short as the flow asks for, in levels of LEVEL; the first ones are short, as the wall's layer is thin.
    The strips' wavering fades over `fades` diameters.
    """
    flow, speed = Flow(u.shape[1], nu, grid, fades), float(np.abs(u).max())
    now, level, times, found = float(t[0]), FIRST, [float(t[0])], [-np.pi / 4 * du[0]]

    def at(x: Array, when: float) -> Array:
        i = min(max(int(np.searchsorted(t, when)), 1), len(t) - 1)
        share = (when - t[i - 1]) / (t[i] - t[i - 1])
        mixed: Array = (1 - share) * x[i - 1] + share * x[i]
        return mixed

    while now < t[-1]:
        dt = longest * LEVEL**-level
        flow.step(dt, at(u, now), at(u, now + dt), speed)
        now += dt
        times.append(now)
        found.append(flow.force(at(du, now)))
        asked = np.log(max(longest * flow.fastest / COURANT, 1.0)) / np.log(LEVEL)
        level = int(np.ceil(asked)) if asked > level else max(level - 1, 0) if asked < level - 1.5 else level
    each = np.array(found)
    return np.column_stack([np.interp(t, times, each[:, b]) for b in range(u.shape[1])])
