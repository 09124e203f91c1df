"""What the dry frictions of a joint share: a contact that may bend before it slips, and a step in proportion to the joint's rate."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

from torch import Tensor

from nnhydro.effects.effect import Effect, Values, parameter
from nnhydro.effects.quantity import Interval, Quantity
from nnhydro.physics.joints import DRY_WIDTH, MOST_BENDING, bent_sign, dry_width, require_bending
from nnhydro.physics.motion import Motion


@dataclass(frozen=True, kw_only=True)
class DryContact(Effect):
    """An effect at a joint whose contact slips: z follows the sign of the rate, dz/dt = (sign(qd_j) - z) |qd_j| / z_0."""

    bending: Values = parameter("rad", 0.0, (0.0, MOST_BENDING), "rotation over which the contact bends before it slips, z_0", per="arm",
                                linear=False, grid=(0.0,), absent=True, detail=(0.0003, 0.003, 0.01, 0.03, 0.1))
    width: float = DRY_WIDTH  # rad/s: of the step z = tanh(qd_j / width) where nothing bends

    def __post_init__(self) -> None:
        super().__post_init__()
        require_bending(self.kind, self.bending)

    def at_pace(self, rates: tuple[float, ...]) -> Self:
        """Return the law whose step is narrow beside the rate of its joint."""
        return replace(self, width=dry_width(rates[self.joint - 1]))

    def sign(self, motion: Motion, widths: float = 1.0) -> Tensor:
        """Return z (n,), its step `widths` times as wide as that of the law."""
        return bent_sign(motion, self.joint, sum(self.bending), widths * self.width)

    def bent(self) -> dict[str, Quantity]:
        """Return over how much of turning the contact bends; nothing where it does not."""
        return {"bending": Quantity(self.bending[0], "rad")} if any(self.bending) else {}

    def statement(self, intervals: Mapping[str, Interval] | None = None, instead: Mapping[str, str] | None = None) -> str:
        """Return the finding as one sentence; of a contact that may be rigid it says nothing of bending."""
        rigid = "bending" in (intervals or {}) and (intervals or {})["bending"][0] <= 0
        return Effect.statement(replace(self, bending=(0.0,)) if rigid else self, intervals, instead)
