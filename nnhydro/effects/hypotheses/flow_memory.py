"""Hypothesis: drag lags behind the motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Self, final

import torch
from torch import Tensor

from nnhydro.effects.effect import LoadEffect, Signature, Values, effect, parameter
from nnhydro.effects.quantity import Quantity
from nnhydro.physics.flow import Flow
from nnhydro.physics.strips import Strips
from nnhydro.physics.travel.wake_memory import lags_behind, share_missed

STRIPS = 10  # a link
TINY = 1e-12  # m: water at rest has no travel


def _lagging(strips: Strips, v: float) -> tuple[Tensor, Tensor, Tensor]:
    """Return |w|, what lags, |w|^(1-v) w, and what its lag is multiplied by, 0.5 rho D |w|^v, (n, links, s) each."""
    w = strips.w.abs()
    return w, w ** (1 - v) * strips.w, 0.5 * strips.flow.rho * strips.flow.D[:, None] * w**v


@effect
@final
@dataclass(frozen=True)
class FlowMemory(LoadEffect):
    """The drag of each strip as it was a moment or a little travel ago, less the drag itself; or the velocity in it alone, after Wagner."""

    id = "flow_memory"
    family = "wake"
    name = "drag that lags"
    mechanism = "The wake takes time to follow a change of speed: the present drag belongs to the motion a moment ago."
    equation = ("f -> f + 0.5 m_i rho D |w|^v (g - |w|^(1-v) w),  (T + l D/|w|) dg/dt = |w|^(1-v) w - g,  w of a strip of link i;  "
                "v = 0: the drag lags, v = 1: the velocity in it")
    source = ("first-order wake response: an assumption of ours; the distance travelled as its clock: McLain & Rock (1998), eq. (1); "
              "v = 1 after Wagner (1925): from general knowledge, not checked")
    signature = Signature(
        depends_on=("w", "t"), parity="odd", region="quick changes of speed; nothing in steady motion",
        excited_by="oscillations at several frequencies and the same speed",
        mistaken_for=("sensor_timing", "wake_development", "joint_elasticity", "history_force", "added_mass"),
    )
    acts = "arm"
    needs_water = True

    share: Values = parameter("1", 0.5, (0.0, 5.0), "part of C_D that lags, m_i")
    response: Values = parameter("s", 0.2, (0.005, 10.0), "response time T", per="arm", linear=False,
                                 grid=(0.005, 0.03, 0.06, 0.12, 0.25, 0.5, 1.0))
    travel: Values = parameter("1", 0.0, (0.0, 50.0), "response travel l in diameters", per="arm", linear=False,
                               grid=(0.0, 0.1, 0.3, 1.0, 3.0))
    velocity: Values = parameter("1", 0.0, (0.0, 1.0), "whether the drag lags (0) or the velocity in it (1), v", per="arm", linear=False,
                                 grid=(0.0, 1.0), absent=True)

    def columns(self, flow: Flow) -> Tensor:
        """Return d tau / d share, (n, joints, links)."""
        strips, v = Strips.of(flow, STRIPS), sum(self.velocity)
        w, lagging, scale = flow.memo.of((type(self), v), lambda: _lagging(strips, v))
        memory, carried = self.response[0] * w + self.travel[0] * flow.D[:, None], flow.motion.carried
        if carried is not None:  # stepped through time
            rate = carried.steps(3) * w / (memory + TINY)

            def following(old: Tensor) -> Tensor:
                """Return what lags and its lag (n, links, strips, 2) after a step from `old`."""
                lag = old[..., 1] * torch.exp(-rate) + (lagging - old[..., 0]) * share_missed(rate)
                return torch.stack([lagging, lag], dim=-1)

            name = f"lagging drag/{self.response[0]}/{self.travel[0]}/{v}"
            now = carried.value(name, lambda: torch.stack([lagging, torch.zeros_like(w)], dim=-1), following)
            return strips.to_joints(-scale * now[..., 1])
        if flow.motion.steady or len(w) < 2:
            return strips.to_joints(torch.zeros_like(w))
        known = flow.memo.of(type(self), dict[tuple[float, ...], Tensor])
        return known[self._law] if self._law in known else self._together(flow, [v])[0]

    @property
    def _law(self) -> tuple[float, ...]:
        """All that the columns depend on."""
        return self.response[0], self.travel[0], sum(self.velocity)

    def _together(self, flow: Flow, velocities: Sequence[float]) -> list[Tensor]:
        """The columns (n, joints, links) of this memory for each of `velocities`."""
        strips = Strips.of(flow, STRIPS)
        laws = [flow.memo.of((type(self), v), partial(_lagging, strips, v)) for v in velocities]
        memory = self.response[0] * laws[0][0] + self.travel[0] * flow.D[:, None]
        rate = torch.diff(flow.motion.t, prepend=flow.motion.t[:1])[:, None, None] * laws[0][0] / (memory + TINY)
        lags = lags_behind([lagging for _, lagging, _ in laws], rate)
        return [strips.to_joints(-scale * lag) for (_, _, scale), lag in zip(laws, lags, strict=True)]

    @classmethod
    def prepare(cls, flows: Sequence[Flow], terms: Sequence[Self]) -> None:
        """Compute the columns of laws that remember alike together."""
        motion = flows[0].motion
        if motion.steady or motion.carried is not None or len(motion.t) < 2:
            return
        alike: dict[tuple[float, ...], dict[float, Self]] = {}
        for law in terms:
            alike.setdefault(law._law[:2], {})[law._law[2]] = law
        for flow, (memory, laws) in product(flows, alike.items()):
            if len(laws) > 1:
                made = next(iter(laws.values()))._together(flow, list(laws))
                flow.memo.of(cls, dict[tuple[float, ...], Tensor]).update(zip([(*memory, v) for v in laws], made, strict=True))

    def quantities(self) -> dict[str, Quantity]:
        """Return the values, and by link share times response and share times travel: all that changes slower than the lag tell of it."""
        made, links = super().quantities(), range(1, len(self.share) + 1)
        slow = {f"{name}[{i}]": Quantity(self.share[i - 1] * lag[0], unit)
                for name, lag, unit in (("late", self.response, "s"), ("behind", self.travel, "1")) for i in links}
        return made | slow

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the finding."""
        links = range(1, len(self.share) + 1)
        parts, late = ([text[f"{name}[{i}]"] for i in links] for name in ("share", "late"))
        what = "The velocity in the drag" if sum(self.velocity) > 0.5 else "Drag"
        return (f"{what} lags the motion by {text['response']} and {text['travel']} diameters of travel (flow memory). "
                f"The part of C_D that lags is {', '.join(parts)}, link by link. This part times the response is {', '.join(late)}.")
