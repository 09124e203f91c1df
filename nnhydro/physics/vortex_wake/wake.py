"""The vortices above the X axis; those below are their mirror images with the opposite circulation.

Source: McLain & Rock 1998, eq. 4, with the kernel smoothed after Krasny 1986, J. Comput. Phys. 65.
"""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from nnhydro.physics.vortex_wake.choices import WakeChoices
from nnhydro.physics.vortex_wake.potential import Complex, Real


@final
@dataclass(frozen=True, eq=False)
class Wake:
    """Vortices of the upper half in the order they were shed. Never changed in place."""

    z: Complex  # (k,) m, relative to the cylinder's centre
    Gamma: Real  # (k,) m^2/s
    born: Real  # (k,) s

    def with_vortex(self, z: complex, Gamma: float, born: float) -> "Wake":
        """Give the wake with one more vortex."""
        return Wake(np.append(self.z, z), np.append(self.Gamma, Gamma), np.append(self.born, born))

    def shifted_by(self, step: Complex) -> "Wake":
        """Give the wake displaced by step (k,) m."""
        return replace(self, z=self.z + step)

    def cores(self, time: float, diameter: float, choices: WakeChoices) -> Real:
        """Give the core radii (k,) m: delta^2 = (core D)^2 + 4 nu age."""
        age = np.maximum(time - self.born, 0.0)
        return np.asarray(np.sqrt((choices.core * diameter) ** 2 + 4.0 * choices.kinematic_viscosity_m2_s * age))

    def whole(self) -> tuple[Complex, Real]:
        """Give positions (2k,) m and circulations (2k,) m^2/s of both halves, the upper half first."""
        return np.concatenate([self.z, np.conj(self.z)]), np.concatenate([self.Gamma, -self.Gamma])


EMPTY = Wake(np.zeros(0, np.complex128), np.zeros(0), np.zeros(0))


def wake_velocities(wake: Wake, U: float, radius: float, core: Real) -> Complex:
    """Give u + i v (k,) m/s of the upper vortices, in the frame of the water at rest.

        u - i v = U c^2/z^2 - (i/2 pi) sum_j Gamma_j [K(z - z_j) - K(z - conj z_j) - 1/(z - c^2/conj z_j) + 1/(z - c^2/z_j)]
        K(r) = conj(r) / (|r|^2 + delta^2),   delta^2 = (delta_k^2 + delta_j^2) / 2

    wake of k vortices; U m/s; radius m; core (k,) m. The common delta keeps action equal to reaction, so the smoothing adds no force.
    Source: McLain & Rock 1998, eq. 4.
    """
    z = wake.z[:, None]
    blur = 0.5 * (core[:, None] ** 2 + core[None, :] ** 2)  # (k, k) m^2
    image = radius**2 / np.conj(wake.z)
    kernel = _smooth(z - wake.z, blur) - _smooth(z - np.conj(wake.z), blur) - 1.0 / (z - image) + 1.0 / (z - np.conj(image))
    return np.asarray(np.conj(U * radius**2 / wake.z**2 - 0.5j / np.pi * (kernel @ wake.Gamma)))


def _smooth(r: Complex, blur: Real) -> Complex:
    return np.asarray(np.conj(r) / (r.real**2 + r.imag**2 + blur))


def without_absorbed(wake: Wake, radius: float, closest: float) -> Wake:
    """Give the wake without vortices within `closest` m of the wall or across the axis: image or mirror cancels them there."""
    keep = (np.abs(wake.z) > radius + closest) & (wake.z.imag > 0.0)
    return wake if bool(keep.all()) else Wake(wake.z[keep], wake.Gamma[keep], wake.born[keep])


def merge(wake: Wake, distance: float, beyond: float) -> Wake:
    """Give the wake with neighbours in the order of shedding made one, where both are beyond `beyond` m and within `distance` m.

        Gamma = Gamma_1 + Gamma_2,   z = (Gamma_1 z_1 + Gamma_2 z_2) / Gamma

    Circulation and the impulse of the free vortices are kept exactly.
    Source: ours.
    """
    pairs = wake.z.size // 2
    if pairs == 0 or distance == 0.0:
        return wake
    first, second = slice(0, 2 * pairs, 2), slice(1, 2 * pairs, 2)
    far = np.minimum(np.abs(wake.z[first]), np.abs(wake.z[second])) > beyond
    join = far & (np.abs(wake.z[first] - wake.z[second]) < distance) & (wake.Gamma[first] + wake.Gamma[second] > 0.0)
    if not bool(join.any()):
        return wake
    z, Gamma, born = wake.z.copy(), wake.Gamma.copy(), wake.born.copy()
    left, right = 2 * np.flatnonzero(join), 2 * np.flatnonzero(join) + 1
    total = Gamma[left] + Gamma[right]
    z[left] = (Gamma[left] * z[left] + Gamma[right] * z[right]) / total
    born[left] = (Gamma[left] * born[left] + Gamma[right] * born[right]) / total
    Gamma[left] = total
    keep = np.ones(z.size, dtype=bool)
    keep[right] = False
    return Wake(z[keep], Gamma[keep], born[keep])
