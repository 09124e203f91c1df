"""Hypothesis: there is a gap in a drive."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
import torch
from torch import Tensor

from nnhydro.effects.compliance import turned_reading, twisted_flow
from nnhydro.effects.effect import InstrumentEffect, Signature, Values, effect, parameter
from nnhydro.effects.sensor_view import SensorView
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import tensor

PASSING = 0.03  # s: a knock is shorter, and so is what the angles' noise leaves in the torque that they stand for


def _past_knocks(seen: SensorView, tau: Tensor) -> Tensor:
    """Return `tau` (n,) smoothed over the knocks: they follow from the crossing and must not decide when the torque changes its sign."""
    from scipy.ndimage import gaussian_filter1d

    t = seen.motion.t
    if seen.motion.steady or len(tau) < 2:
        return tau
    return tensor(gaussian_filter1d(tau.numpy(), PASSING / float((t[-1] - t[0]) / (len(t) - 1)), mode="nearest"))


def _places(ways: Iterable[float], stay: float) -> Iterator[float]:
    """The place of the link after each of `ways`, -1 to 1 between the flanks; of what winds a flank up, the share `stay` is kept."""
    side = 0.0
    for way in ways:
        side += way
        if side > 1.0:
            side = 1.0 + (side - 1.0) * stay
        elif side < -1.0:
            side = -1.0 + (side + 1.0) * stay
        yield side


@effect
@final
@dataclass(frozen=True)
class Backlash(InstrumentEffect):
    """The link sits at one side of the gap until the torque has changed sign for long enough to carry it to the other; flanks may give."""

    id = "backlash"
    family = "transmission"
    name = "backlash"
    mechanism = "Worn or loose gear teeth have play: when the torque changes sign, the link crosses the gap and hits the other flank."
    equation = ("q_link = q_j - gap/2 s,  ds/dt = 2 tau_j / I, less (s - sgn s) / T beyond |s| = 1;  T = 0: |s| <= 1;  "
                "tau_j smoothed over 0.03 s, as measured where it was, else the model's")
    source = ("play without torque between elastic, damped flanks: Modelica Standard Library, Rotational.Components.ElastoBacklash, "
              "https://github.com/modelica/ModelicaStandardLibrary, Modelica/Mechanics/Rotational/Components/ElastoBacklash.mo; "
              "crossed against viscous grease: from general knowledge, not checked")
    signature = Signature(
        depends_on=("tau",), parity="odd", region="short knocks where the torque of the joint changes sign",
        excited_by="many slow changes of the sign of the torque",
        mistaken_for=("joint_elasticity", "coulomb_friction", "stribeck_friction", "sensor_timing", "flow_memory", "wake_reentry",
                      "wake_development"),
    )
    acts = "joint"
    predictable_share = 0.8  # when the play is crossed hangs on the smallest torques
    stage = 1
    torque_scaled = ("impulse",)

    gap: Values = parameter("rad", 1e-3, (0.0, 0.2), "play of the drive, from flank to flank; more is a broken coupling", per="arm")
    impulse: Values = parameter("N m s", 0.02, (1e-12, 1e12), "torque times time I that carries the link across the gap", per="arm",
                                linear=False,
                                grid=(0.00125, 0.0025, 0.005, 0.01, 0.014, 0.02, 0.028, 0.04, 0.057, 0.08, 0.113, 0.16, 0.226, 0.32))
    settling: Values = parameter("s", 0.0, (0.0, 10.0), "time T in which the flanks yield; 0: they are rigid", per="arm", linear=False,
                                 grid=(0.0, 0.05, 0.3), absent=True)

    def _side(self, seen: SensorView, tau: Tensor) -> Tensor:
        """Half the place of the link in the gap, -1/2 to 1/2 and as much beyond as the flanks give, (n,)."""
        return self._place(seen, _past_knocks(seen, tau))

    def _carried_side(self, seen: SensorView) -> Tensor:
        """The same under the torque that is known to carry the link."""
        return self._place(seen, seen.memo.of((type(self), self.joint), lambda: _past_knocks(seen, self._carried_torque(seen))))

    def _place(self, seen: SensorView, tau: Tensor) -> Tensor:
        """Half the place (n,) of the link in the gap under the torque `tau` (n,) past knocks."""
        if seen.motion.steady or len(tau) < 2:
            return -0.5 * torch.sign(tau)
        time = 2 / self.impulse[0] * torch.diff(seen.motion.t, prepend=seen.motion.t[:1])
        settling = self.settling[0] if self.settling else 0.0
        step = float((seen.motion.t[-1] - seen.motion.t[0]) / (len(tau) - 1))
        stay = settling / (settling + step)  # of what is wound, a step later: backward Euler
        return -0.5 * torch.from_numpy(np.fromiter(_places((time * tau).tolist(), stay), dtype=float, count=len(tau)))

    def _carried_torque(self, seen: SensorView) -> Tensor:
        """The torque (n,) N m that carries the link: as measured where it was, else what the model says."""
        known = seen.tau if seen.measured is None else torch.where(torch.isfinite(seen.measured), seen.measured, seen.tau)
        return seen.joint_torque(known)[:, self.joint - 1]

    def columns(self, seen: SensorView) -> Tensor:
        """Return d reading / d gap, (n, joints, 1)."""
        return seen.along(self._carried_side(seen), self.joint)[..., None]

    def moved_flow(self, seen: SensorView) -> tuple[Flow, float] | None:
        """Return the flow behind the gap, where the torque that carries the link was measured."""
        return None if seen.measured is None else (twisted_flow(seen, self.joint, self.gap[0] * self._carried_side(seen)), 0.0)

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading behind the gap."""
        if seen.measured is not None:
            return super().apply(seen)
        return turned_reading(seen, self.joint, lambda tau: self.gap[0] * self._side(seen, tau))

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        give = f" The flanks yield within {text['settling']}." if any(self.settling) else ""
        return (f"The drive of joint {self.joint} has a backlash of {text['gap']}. When the torque changes sign, the link crosses the gap "
                f"after an impulse of {text['impulse']}.{give}")
