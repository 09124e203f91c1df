"""What a hypothesis is: a card, columns that are linear in its parameters, and a sentence for people.

    tau_sensor = Y theta + sum_k x_k(motion; phi_k) beta_k             [N m]

    LoadEffect        x_k = columns(flow): torque at the joints, as any load term; a confirmed one is one more term of a sum
    InstrumentEffect  x_k = columns(seen): change of what the sensors read, linear about no effect; `apply` is the exact reading.
                      Also for causes that act on the torque of the rest of the model (water that moves, a compliant drive)

`@effect` checks the card and enters the class in the register; the file is the whole registration.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from typing import Any, ClassVar, Self, TypeVar

import torch
from torch import Tensor

from nnhydro.effects.card import Signature, require_card
from nnhydro.effects.quantity import Interval, Quantity, format_quantity
from nnhydro.effects.sensor_view import SensorView
from nnhydro.errors import ModelError, require
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import LinearTerm
from nnhydro.physics.parametrised import ANY_SIZE, ANY_VALUE, ParametricTerm, Values, parameter
from nnhydro.recordings.arm import Arm

__all__ = ["ANY_SIZE", "ANY_VALUE", "REGISTER", "Effect", "InstrumentEffect", "LoadEffect", "Signature", "Values", "at_joint",
           "effect", "parameter"]


@dataclass(frozen=True)
class Effect(ParametricTerm):
    """The card, and where the effect acts: `joint` counts from 1 (for `acts` = "link" it is the link), 0 is the whole arm."""

    id: ClassVar[str]
    family: ClassVar[str]
    name: ClassVar[str]
    mechanism: ClassVar[str]
    equation: ClassVar[str]
    source: ClassVar[str]
    signature: ClassVar[Signature]
    acts: ClassVar[str]
    needs_water: ClassVar[bool] = False
    fewest_links: ClassVar[int] = 1
    driven: ClassVar[bool] = True  # also tried where a drive moves the arm
    per_recording: ClassVar[bool] = False  # its linear values hold within one recording only: a phase of its own
    general: ClassVar[bool] = False  # the form of its family that no other effect covers: those must stand clear of it
    cause: ClassVar[str] = ""  # laws of one cause exclude each other at a joint; of a family where the card names no other
    everywhere: ClassVar[bool] = False  # every joint of a machine has some
    standard: ClassVar[bool] = False  # every robot's identification model has it (Khalil & Dombre 2002, chapter 12)
    varies: ClassVar[bool] = False  # its size differs between recordings of a sound machine: friction with its temperature
    random_intercept: ClassVar[bool] = False  # besides its linear values each recording has an offset at the joint: a random effect
    predictable_share: ClassVar[float] = 1.0  # share of its torque that a fit can predict where it is the cause, as far as that is known
    dissipates: ClassVar[bool] = False  # with the hub at rest no sample gives the drive energy back, but for what a contact was bent
    shown_by_reversals: ClassVar[tuple[str, ...]] = ()  # parameters that only show where the joint turns both ways
    rate_scaled: ClassVar[tuple[str, ...]] = ()  # parameters whose grid shrinks with the joint's rate, below USUAL_RATE
    torque_scaled: ClassVar[tuple[str, ...]] = ()  # parameters whose grid is in shares of the joint's largest torque
    spread: ClassVar[Mapping[str, tuple[float, ...]]] = {}  # multiples of a parameter over which a law of other form spreads what it does

    joint: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        whole = isinstance(self.joint, int) and not isinstance(self.joint, bool)
        fits = whole and (self.joint == 0 if self.acts == "arm" else self.joint >= 1)
        wanted = "0: it loads the whole arm" if self.acts == "arm" else f"the {self.acts} it acts on, counted from 1"
        require(fits, f"effect {self.id!r}: joint = {self.joint!r}: give {wanted}", ModelError)

    @classmethod
    def linear_parameters(cls) -> tuple["Field[Any]", ...]:
        """Return the fields whose values enter linearly."""
        return tuple(declaration for declaration in cls.parameters() if declaration.metadata["linear"])

    @classmethod
    def grids(cls) -> dict[str, tuple[float, ...]]:
        """Return the grid of each parameter that is not linear."""
        return {declaration.name: declaration.metadata["grid"] for declaration in cls.parameters() if not declaration.metadata["linear"]}

    @classmethod
    def details(cls) -> dict[str, tuple[float, ...]]:
        """Return the values of each parameter that is refined once the effect is found."""
        return {declaration.name: declaration.metadata["detail"] for declaration in cls.parameters() if declaration.metadata["detail"]}

    @classmethod
    def places(cls, arm: Arm) -> tuple[int, ...]:
        """Return the joints (links) of `arm` at which the effect can act, (0,) for the whole arm, () where it makes no sense."""
        if (cls.needs_water and arm.dry) or arm.n_links < cls.fewest_links:
            return ()
        return (0,) if cls.acts == "arm" else tuple(range(1, arm.n_links + 1))

    def narrower(self) -> tuple[Self, ...]:
        """Return laws with fewer parameters that are also tried; an omitted parameter has no values. None by default."""
        return ()

    def acts_on(self, arm: Arm) -> bool:
        """Return whether this law makes sense for `arm`; by default wherever the effect does."""
        return True

    def centre(self, angles: tuple[float, ...]) -> Self:
        """Return the effect as a law about the mean `angles` (joints,) rad of the campaign; itself where no origin matters."""
        return self

    def at_pace(self, rates: tuple[float, ...]) -> Self:
        """Return the effect for joints whose rms `rates` (joints,) are these, rad/s; itself where no rate matters."""
        return self

    def at_reynolds(self, low: float, high: float) -> Self:
        """Return the effect for water that passes the links at Reynolds numbers `low` to `high`; itself where none matters."""
        return self

    def plausible(self) -> bool:
        """Return whether the values, each within its bounds, are possible together; an impossible mechanism is not claimed."""
        return True

    def narrowest(self) -> float:
        """Return the narrowest range of the joint's angles, rad, that shows the effect: two periods of what is periodic; 0 by default."""
        return 0.0

    def slowest(self) -> float:
        """Return the rate of the joint, rad/s, below which some rows must lie to show the effect; no limit by default."""
        return float("inf")

    def quantities(self) -> dict[str, Quantity]:
        """Return the quantities to report, with units: by default the parameters themselves."""
        linear = dict(zip(self.linear_names(), zip(self.linear_values().tolist(), self.linear_units(), strict=True), strict=True))
        shape = {declaration.name: (value, declaration.metadata["unit"]) for declaration in self.parameters()
                 if not declaration.metadata["linear"] for value in getattr(self, declaration.name)}
        return {name: Quantity(value, unit) for name, (value, unit) in (linear | shape).items()}

    def statement(self, intervals: Mapping[str, Interval] | None = None, instead: Mapping[str, str] | None = None) -> str:
        """Return the finding as one sentence with numbers and units.

        `intervals` holds (low, high) by the name of the quantity, `instead` the text in place of a quantity.
        """
        text = {name: format_quantity(q, (intervals or {}).get(name)) for name, q in self.quantities().items()}
        return self.sentence(text | dict(instead or {}))

    def sentence(self, text: Mapping[str, str]) -> str:
        """Return the sentence; `text` holds each quantity as text with unit."""
        where = f" at {self.acts} {self.joint}" if self.joint else ""
        return f"{self.name}{where}: {', '.join(f'{name} {value}' for name, value in text.items())}."


@dataclass(frozen=True)
class LoadEffect(Effect, LinearTerm):
    """A hypothesis that adds torque at the joints: `columns(flow)` (n, joints, p)."""


@dataclass(frozen=True)
class InstrumentEffect(Effect, ABC):
    """A hypothesis that changes what is read: columns (n, joints, p) linear about no effect, and the exact reading.

    `stage` orders several: 0 the water and the angles the model is given, 1 compliant drives, 2 time, 3 scale, 4 offset, 5 clipping.
    """

    stage: ClassVar[int]
    additive: ClassVar[bool] = False  # it changes each part of the torque as if it were alone, by the same values

    @abstractmethod
    def columns(self, seen: SensorView) -> Tensor:
        """Return d reading / d linear parameter about no effect, (n, joints, p), p in the order of `linear_names`."""

    def moved_flow(self, seen: SensorView) -> tuple[Flow, Tensor | float] | None:
        """Return the flow at which ideal sensors would read what is read, and what adds to it, (n, joints) N m; None: `apply` does more."""
        return None

    def apply(self, seen: SensorView) -> Tensor:
        """Return the reading (n, joints) N m with this effect; exactly seen.tau where all values are 0."""
        moved = self.moved_flow(seen)
        require(moved is not None, f"effect {self.id!r}: needs `apply` or `moved_flow`", ModelError)
        return seen.tau if moved is None else seen.torque_of(moved[0]) + moved[1]

    def change(self, seen: SensorView) -> Tensor:
        """Return columns times values, (n, joints) N m: `apply` less seen.tau, for small effects."""
        return self.columns(seen) @ self.linear_values()

    def tangent(self, seen: SensorView) -> Tensor:
        """Return d reading / d linear parameter (n, joints, p) about the effect's values; by default the columns about no effect."""
        return self.columns(seen)

    def extra_starts(self, seen: SensorView) -> tuple["InstrumentEffect", ...]:
        """Return the effect at values from which the search may start, too, where the columns about no effect mislead; none by default."""
        return ()

    def for_prediction(self, offset: float) -> "InstrumentEffect":
        """Return the effect as it enters predictions; `offset` N m is that of the last recording, if each has one."""
        return self

    def secant(self, seen: SensorView, reading: Tensor | None = None) -> Tensor:
        """Return columns (n, joints, p) whose product with the values is exactly what `apply` changes, however large the effect.

            X = J + (apply - tau - J v) w',   w_k = |J_k|^2 v_k / sum_l |J_l|^2 v_l^2,   J the tangent at the values v

        `reading` is that of `apply`, where it is known. With all values 0 it returns J. Source: the secant condition of Broyden (1965),
        Math. Comp. 19.
        """
        if not bool(self.linear_values().any()):
            return self.columns(seen)
        return self._secant_to(seen, self.apply(seen) if reading is None else reading)

    def rough_secant(self, seen: SensorView) -> Tensor:
        """Return the columns of `secant`, approximately if that is much faster: enough to decide what to fit exactly."""
        return self.secant(seen)

    def _tangent_from(self, seen: SensorView, reading: Tensor) -> Tensor:
        """`tangent` where the `reading` (n, joints) N m about which it is taken is known."""
        return self.tangent(seen)

    def _secant_to(self, seen: SensorView, reading: Tensor) -> Tensor:
        """The columns (n, joints, p) whose product with the values is `reading` less seen.tau."""
        J, v = self._tangent_from(seen, reading), self.linear_values()
        energy = (J**2).sum(dim=(0, 1))
        scale = float((energy * v**2).sum())
        if scale <= 0:
            return J
        return J + (reading - seen.tau - J @ v)[..., None] * (energy * v / scale)


REGISTER: dict[str, type[Effect]] = {}
E = TypeVar("E", bound=type[Effect])


def effect(cls: E) -> E:
    """Check the card of `cls` and enter it in the register; raises ModelError naming what is missing or a second effect of the same id."""
    require_card(cls)
    known = REGISTER.get(cls.id)
    again = known is None or (known.__module__, known.__qualname__) == (cls.__module__, cls.__qualname__)
    require(again, f"effect {cls.__name__}: the id {cls.id!r} is taken by {known}: give it another", ModelError)
    wrong = [declaration.name for declaration in fields(cls) if declaration.name in ("id", "family", "name", "signature")]
    require(not wrong, f"effect {cls.__name__}: {wrong} must be class variables: annotate with ClassVar or not at all", ModelError)
    cls.kind = f"effect:{cls.id}"
    REGISTER[cls.id] = cls
    return cls


def of_joint(columns: Tensor, joint: int) -> Tensor:
    """Return the column (n, joints, 1) of `joint` (from 1) of a load term with one parameter a joint, `columns` (n, joints, joints)."""
    require(joint <= columns.shape[2], f"joint {joint}: this arm has {columns.shape[2]}", ModelError)
    return columns[..., joint - 1:joint]


def at_joint(load: Tensor, joint: int, joints: int) -> Tensor:
    """Return the columns (n, joints, p) of `load` (n, p) that is felt at `joint` (from 1) alone."""
    require(joint <= joints, f"joint {joint}: this arm has {joints}", ModelError)
    columns = torch.zeros(len(load), joints, load.shape[1], dtype=torch.float64)
    columns[:, joint - 1] = load
    return columns


def with_effects(seen: SensorView, effects: Sequence[InstrumentEffect]) -> SensorView:
    """Return the view whose `torques_of` holds all of `effects`: its `tau` is the reading with them."""
    for effect in sorted(effects, key=lambda effect: effect.stage):
        seen = _with_effect(seen, effect)
    return seen


def _with_effect(seen: SensorView, effect: InstrumentEffect) -> SensorView:
    """The view after one effect more: torques of any flow are then those that this effect makes of them."""
    inner = seen

    def torques_of(flows: Sequence[Flow]) -> list[Tensor]:
        return [effect.apply(replace(inner, flow=flow)) for flow in flows]

    return replace(seen, torques_of=torques_of)
