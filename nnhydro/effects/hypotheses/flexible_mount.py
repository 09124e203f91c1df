"""Hypothesis: the mount is compliant, so that the hub sways under the forces of the arm."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from typing import final

import torch
from torch import Tensor

from nnhydro.effects.compliance import oscillator
from nnhydro.effects.effect import ANY_SIZE, InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.effects.sensor_view import SensorView, unit_vector
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Base, tensor

LIGHTEST = 1e-9  # 1/kg: below, the mount stands still
Sway = tuple[Tensor, Tensor]  # velocity and acceleration (n,) of the hub: m/s, m/s^2


@effect
@final
@dataclass(frozen=True)
class FlexibleMount(InstrumentEffect):
    """A damped spring under the hub, loaded by the force that the arm exerts on it and by its own inertia as the carriage accelerates.

    F is the force of an arm whose hub does not sway: M counts what sways with the mount of arm and water. The share s is that of the mount
    alone in M.
    """

    id = "flexible_mount"
    family = "transmission"
    name = "mount that sways"
    mechanism = "Strut, carriage or frame bend under the forces of the arm: the hub moves, and no sensor measures it."
    equation = ("reading = tau(hub moves with y d),  y'' + 4 pi f zeta y' + (2 pi f)^2 y = -F.d / M - s a.d;  F: force that the hub "
                "supplies, a: acceleration of the carriage")
    source = ("one mode under a force: Irvine (2013), The Time-Domain Response of a Single-Degree-of-Freedom System, eq. 7, "
              "https://vdocuments.us/the-forced-response-of-a-single-degree-of-web-view-the-time-domain-response.html; on a base that "
              "accelerates: OpenFAST, equation of TMD_X (see oscillating_mass); the share s is ours")
    signature = Signature(
        depends_on=("qdd", "u0"), parity="mixed", region="about one frequency, at all joints together; ringing after a stop",
        excited_by="quick motions that push the mount, stops with holds after them",
        mistaken_for=("joint_elasticity", "oscillating_mass", "wave_orbital"),
    )
    acts = "arm"
    stage = 0
    fewest_links = 2  # one torque alone resembles that of a mass that swings on the link

    mobility: Values = parameter("1/kg", 0.05, ANY_SIZE, "1/M, M the mass that sways, arm and water included", per="arm")
    carried: Values = parameter("1", 0.0, (0.0, 1.0), "s, share of the mount alone in M", per="arm")
    frequency: Values = parameter("Hz", 2.0, (0.3, 20.0), "its natural frequency f", per="arm", linear=False,
                                  grid=(1.0, 1.35, 1.8, 2.4, 3.2, 4.3, 5.8))
    damping: Values = parameter("1", 0.05, (0.005, 0.9), "damping ratio zeta", per="arm", linear=False, grid=(0.03, 0.15))
    direction: Values = parameter("rad", 0.0, (-pi, pi), "direction in which it sways, from +X", per="arm", linear=False,
                                  grid=(0.0, pi / 2))

    def columns(self, seen: SensorView) -> Tensor:
        """Return d reading / d (mobility, carried), (n, joints, 2); 0 in steady rows, and where the hub's force is not known."""
        loads = self._loads(seen)
        if loads is None:
            return torch.zeros(*seen.motion.q.shape, 2, dtype=torch.float64)
        by_velocity, by_acceleration = seen.memo.of((type(self), self.direction), lambda: self._slopes(seen))
        sways = [self._sway(seen, load) for load in loads]
        return torch.stack([by_velocity * v[:, None] + by_acceleration * a[:, None] for v, a in sways], dim=-1)

    def moved_flow(self, seen: SensorView) -> tuple[Flow, float]:
        """Return the flow of an arm whose hub sways; each stretch begins without ringing."""
        loads = self._loads(seen)
        if loads is None or not bool(self.linear_values().any()):
            return seen.flow, 0.0
        total = sum(value * load for value, load in zip(self.linear_values().tolist(), loads, strict=True))
        return self._with_sway(seen.flow, *self._sway(seen, torch.as_tensor(total))), 0.0

    def _loads(self, seen: SensorView) -> tuple[Tensor, Tensor] | None:
        """The loads (n,) of the mount: -F.d, and -a.d of the carriage; None where nothing can sway."""
        motion = seen.motion
        if seen.hub_force_of is None or motion.steady or len(motion) < 4 or seen.arm.sliding:
            return None
        force = seen.memo.of((type(self), "force"), lambda: seen.hub_force_of(seen.flow))  # type: ignore[misc]
        ahead = torch.stack([torch.zeros_like(motion.du0) if motion.base is None else motion.base.ax, motion.du0], dim=1)
        return -(force @ self._d), -(ahead @ self._d)

    @property
    def _d(self) -> Tensor:  # (2,)
        """The direction as a unit vector."""
        return unit_vector(self.direction[0])

    def _sway(self, seen: SensorView, load: Tensor) -> Sway:
        """Velocity and acceleration of the hub under `load` (n,) m/s^2."""
        if not bool(load.any()):
            return load, load
        omega = 2 * pi * self.frequency[0]
        even = torch.ones_like(load)
        _, v, a = oscillator(seen.motion.t.numpy(), *(x.numpy() for x in (even, 2 * self.damping[0] * omega * even, omega**2 * even, load)))
        return tensor(v), tensor(a)

    def _with_sway(self, flow: Flow, velocity: Tensor, acceleration: Tensor) -> Flow:
        """The flow of the arm whose hub moves with these (n,) along the direction, besides what it does."""
        m, (x, y) = flow.motion, self._d.tolist()
        none = torch.zeros_like(m.u0)
        base = Base(none, none, none, none, none) if m.base is None else m.base
        return replace(flow, motion=replace(m, u0=m.u0 + y * velocity, du0=m.du0 + y * acceleration,
                                            base=replace(base, vx=base.vx + x * velocity, ax=base.ax + x * acceleration)))

    def _slopes(self, seen: SensorView) -> Sway:
        """d tau / d velocity and d tau / d acceleration of the hub along the direction, (n, joints) each."""
        one, none = torch.ones_like(seen.motion.u0), torch.zeros_like(seen.motion.u0)
        by_velocity, by_acceleration = seen.slopes([lambda step: self._with_sway(seen.flow, step * one, none),
                                                    lambda step: self._with_sway(seen.flow, none, step * one)])
        return by_velocity, by_acceleration

    def quantities(self) -> dict[str, Quantity]:
        """Return the mass that sways, frequency, damping and direction."""
        return {"mass": Quantity(1 / max(self.mobility[0], LIGHTEST), "kg"), "frequency": Quantity(self.frequency[0], "Hz"),
                "damping": Quantity(self.damping[0], "1"), "direction": Quantity(self.direction[0], "rad")}

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        return (f"The mount sways under the arm at {text['frequency']} with a damping ratio of {text['damping']}, along the direction "
                f"{text['direction']} from +X: a mass of {text['mass']} on a soft strut or frame.")
