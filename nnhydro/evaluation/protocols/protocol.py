"""What a protocol is: which recordings are fitted and which are held out, fold by fold. A file in this folder is one protocol.

All splits are by recording and by repeat group: recordings of one motion are never torn apart, nor are steady rows of one state.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import final

from nnhydro.errors import CampaignError, ConfigError, require
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit
from nnhydro.runtime.registry import Registry, choices


@final
@dataclass(frozen=True, eq=False)
class Material:
    """What there is to split: one campaign an arm with its preparation and its repeat groups {recording: group}."""

    campaigns: tuple[Campaign, ...]
    hows: tuple[Preparation, ...]
    groups: tuple[dict[str, str], ...]
    fold_count: int = 5
    seed: int = 0


@final
@dataclass(frozen=True)
class Fold:
    """One round: `fitted` and `held_out` are unit indices without a common group; `name` says what is held out."""

    name: str
    fitted: tuple[int, ...]
    held_out: tuple[int, ...]


@final
@dataclass(frozen=True, eq=False)
class Split:
    """Units and the rounds over them. `curve`: the rounds share their held-out units and differ in how many recordings they fit."""

    units: tuple[Unit, ...]
    folds: tuple[Fold, ...]
    curve: bool = False

    def __post_init__(self) -> None:
        for fold in self.folds:
            shared = {self.units[i].group for i in fold.fitted} & {self.units[i].group for i in fold.held_out}
            require(not shared, f"{fold.name}: {', '.join(sorted(shared))} would be fitted and held out at once", CampaignError)
            require(bool(fold.fitted) and bool(fold.held_out), f"{fold.name}: leaves nothing to fit or nothing to hold out: record more",
                    CampaignError)


@final
@dataclass(frozen=True)
class Protocol:
    """A way to hold out, its meaning in a sentence and the function that splits. It raises CampaignError where it cannot be held."""

    name: str
    meaning: str
    split: Callable[[Material], Split]


_PROTOCOLS: Registry[Protocol] = Registry("nnhydro.evaluation.protocols")
DEFAULT = "leave-recordings-out"


def protocol(name: str, meaning: str) -> Callable[[Callable[[Material], Split]], Callable[[Material], Split]]:
    """Declare the decorated function as the protocol `name`."""

    def declare(function: Callable[[Material], Split]) -> Callable[[Material], Split]:
        _PROTOCOLS.enter(name, Protocol(name, meaning, function))
        return function

    return declare


def protocols() -> dict[str, Protocol]:
    """Return every declared protocol by name."""
    return _PROTOCOLS.members()


def protocol_called(name: str) -> Protocol:
    """Return the protocol `name`; raises ConfigError listing the names."""
    known = protocols()
    require(name in known, f"--protocol: unknown protocol {name!r}: {choices(name, known)}", ConfigError)
    return known[name]


def rounds(units: Sequence[Unit], held_out: Sequence[tuple[str, Sequence[int]]]) -> tuple[Fold, ...]:
    """Return folds that hold out the given (name, unit indices) in turn and fit all units of other groups."""
    made = []
    for name, chosen in held_out:
        groups = {units[i].group for i in chosen}
        made.append(Fold(name, tuple(i for i, unit in enumerate(units) if unit.group not in groups), tuple(chosen)))
    return tuple(made)
