"""What the laws of friction at a joint share: the smooth sign of a joint's rate, and loads that act at their own joint only.

    sgn(qd) ~ tanh(qd / v_0)                                [-], 0 at rest
    dz/dt = (sign(qd) - z) |qd| / z_0                       [-], a contact that bends over z_0 rad before it slips; kept at rest

Friction depends on the relative rate qd_j of the two bodies that meet at joint j, not on absolute rates, and in the LOAD convention it has
the sign of that rate. A joint at rest can hold any friction torque between minus and plus its level: the value 0 given there is the middle
of that dead band, not a measurement. Behind a belt (`drive: remote`) elbow friction reaches motor 1 with the opposite sign
(physics/transmission.py). Source: Rivera (1995), section 3.2, eq. 3-2-4; the smoothing is ours; contacts that bend: dz/dt of LuGre's model
at a level that the speed does not change (known as Dahl's: not checked), https://github.com/jchristopherson/friction, README.md.
"""

from math import isfinite

import torch
from torch import Tensor

from nnhydro.errors import ModelError, require
from nnhydro.physics.carried import StepMemory
from nnhydro.physics.motion import Motion
from nnhydro.physics.travel.wake_memory import relax

SIGN_WIDTH = 0.02  # rad/s: far below the rates of a tow-tank test (0.1 to 3), above what is left of encoder noise after filtering
DRY_WIDTH = 0.005  # rad/s: of the step of dry friction where its level is sought; a wider one is made up for by a larger breakaway

SLOW = 20.0  # steps of dry friction within the rms rate r of a joint: over a sine, tanh(qd / v_0) is short by ln 2 v_0 / (2^0.5 r), 2 %

MOST_BENDING = 0.3  # rad: a contact that bends further is a spring


def smooth_sign(rate: Tensor, width: float) -> Tensor:
    """Return tanh(rate / width); both in rad/s."""
    return torch.tanh(rate / width)


def dry_width(rate: float) -> float:
    """Return the width of the step of dry friction, rad/s, at a joint whose rms rate is `rate` rad/s (m/s along a linear axis)."""
    return min(DRY_WIDTH, rate / SLOW) if rate > 0 else DRY_WIDTH


def bent_sign(motion: Motion, joint: int, bending: float, width: float = DRY_WIDTH) -> Tensor:
    """Return z (n,) of the contact of `joint` (from 1) that bends over `bending` rad, unbent at first; 0: tanh over `width` rad/s."""
    qd = motion.qd[:, joint - 1]
    if bending > 0 and motion.carried is not None:
        return _carried_sign(motion.carried, qd, f"contact/{joint}/{bending}", bending)
    if bending <= 0 or motion.steady or len(qd) < 2:
        return smooth_sign(qd, width)
    between = (qd + torch.cat([qd[:1], qd[:-1]])) / 2  # mean rate since the sample before: z is that at the sample
    travel = torch.diff(motion.t, prepend=motion.t[:1]) * between.abs()
    return relax(torch.sign(between), travel / bending, torch.zeros(1, dtype=torch.float64))


def _carried_sign(carried: StepMemory, qd: Tensor, name: str, bending: float) -> Tensor:
    """z (n,) of a contact that is stepped through time, with the rate (n,) rad/s that it remembers besides."""

    def next_memory(old: Tensor) -> Tensor:
        between = (qd + old[:, 1]) / 2
        sign = torch.sign(between)
        return torch.stack([sign + (old[:, 0] - sign) * torch.exp(-carried.dt * between.abs() / bending), qd], dim=1)

    return carried.value(name, lambda: torch.stack([torch.zeros_like(qd), qd], dim=1), next_memory)[:, 0]


def require_bending(kind: str, bending: tuple[float, ...]) -> None:
    """Raise ModelError naming the term `kind` unless `bending` holds at most one value, from 0 to `MOST_BENDING` rad."""
    fits = len(bending) <= 1 and all(0 <= value <= MOST_BENDING for value in bending)
    require(fits, f"term {kind!r}: bending = {list(bending)}: give none, or one value from 0 to {MOST_BENDING} rad", ModelError)


def diagonal_columns(loads: Tensor) -> Tensor:
    """Return the columns (n, joints, joints) of `loads` (n, joints), each of which acts at its own joint only."""
    return torch.diag_embed(loads)


def require_positive(kind: str, **options: float) -> None:
    """Raise ModelError naming the term `kind` and the option unless every option is a positive finite number."""
    for name, value in options.items():
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        require(number and isfinite(value) and value > 0, f"term {kind!r}: {name} = {value!r} must be a number above 0", ModelError)
