"""The card of a hypothesis: what it is, what would be seen, and the check that nothing on it is missing."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final, final

from nnhydro.errors import ModelError, require

if TYPE_CHECKING:
    from nnhydro.effects.effect import Effect

FAMILIES: Final = ("wake", "drag_law", "interference", "water", "inertia", "dry_friction", "viscous", "restoring", "transmission",
                   "torque_sensor", "timing", "angle_sensor")
PARITIES: Final = ("odd", "even", "mixed")
ACTS: Final = ("joint", "link", "arm")
TEXTS: Final = ("id", "family", "name", "mechanism", "equation", "source")


@final
@dataclass(frozen=True)
class Signature:
    """What would be seen.

    `parity`: under the mirrored motion (all angles, rates, accelerations and the carriage negated) each column of an odd effect changes
    sign, of an even one stays, of a mixed one does either. `zero_at_rest`: gone where nothing moves. `mistaken_for`: ids of look-alikes.
    """

    depends_on: tuple[str, ...]
    parity: str
    region: str
    excited_by: str
    mistaken_for: tuple[str, ...]
    zero_at_rest: bool = True


def _has_text(text: Any) -> bool:
    return isinstance(text, str) and bool(text.strip())


def _require_signature(where: str, signature: Any) -> None:
    """Raise ModelError where the signature of a card is missing or incomplete."""
    require(isinstance(signature, Signature), f"{where}: signature is missing: signature = Signature(depends_on=..., ...)", ModelError)
    for name in ("region", "excited_by"):
        require(_has_text(getattr(signature, name)), f"{where}: signature.{name} is empty", ModelError)
    require(signature.parity in PARITIES, f"{where}: parity {signature.parity!r} is not one of {', '.join(PARITIES)}", ModelError)
    for name in ("depends_on", "mistaken_for"):
        words: Sequence[Any] = getattr(signature, name)
        require(isinstance(words, tuple) and all(map(_has_text, words)), f"{where}: signature.{name} must be a tuple of words", ModelError)
    require(bool(signature.depends_on), f"{where}: signature.depends_on names nothing", ModelError)


def require_card(cls: "type[Effect]") -> None:
    """Raise ModelError naming what is missing unless the class carries a whole card."""
    where = f"effect {cls.__name__}"
    for name in TEXTS:
        require(_has_text(getattr(cls, name, None)), f"{where}: {name} is missing or empty: every card has one", ModelError)
    require(cls.id.isidentifier() and cls.id == cls.id.lower(), f"{where}: id {cls.id!r} must be a lower-case name", ModelError)
    require(cls.family in FAMILIES, f"{where}: family {cls.family!r} is not one of {', '.join(FAMILIES)}", ModelError)
    require(cls.acts in ACTS, f"{where}: acts {cls.acts!r} is not one of {', '.join(ACTS)}", ModelError)
    _require_signature(where, getattr(cls, "signature", None))
    require(bool(cls.linear_parameters()), f"{where}: has no linear parameter: make one with parameter(...)", ModelError)
    for field in cls.parameters():
        low, high = field.metadata["bounds"]
        inside = all(low <= value <= high for value in (field.metadata["start"], *field.metadata["grid"]))
        require(inside, f"{where}: {field.name}: start or grid lies outside the bounds {low:g} to {high:g}", ModelError)
        searched = field.metadata["linear"] or bool(field.metadata["grid"])
        require(searched, f"{where}: {field.name} is not linear and has no grid", ModelError)
        for word in ("unit", "meaning"):
            require(_has_text(field.metadata[word]), f"{where}: {field.name} has no {word}", ModelError)
    assert all(declaration.name for declaration in fields(cls))
