"""An oddity, and what a check is: it looks for one cause of trouble and says what to do about it."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, TypeVar, final

from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.recording import SteadyTable

Severity = Literal["error", "warning", "note"]  # error: the recording cannot be used as it is


@final
@dataclass(frozen=True)
class Oddity:
    """One finding: in which recording (None: in the campaign), how bad, where, what it is, and what to do."""

    recording: str | None
    severity: Severity
    where: str  # column, and rows or times
    what: str
    remedy: str
    check: str = ""
    in_file: str = ""  # what to do in the file itself, where a remedy in columns.yaml would change recordings that are right

    @property
    def message(self) -> str:
        """The finding in one line."""
        head = f"{self.recording}: " if self.recording else ""
        return f"{head}{self.where}: {self.what}: {self.remedy}" if self.where else f"{head}{self.what}: {self.remedy}"

    def document(self) -> dict[str, str | None]:
        """Return the finding as JSON holds it."""
        return {"check": self.check, "recording": self.recording, "severity": self.severity, "where": self.where, "what": self.what,
                "remedy": self.remedy}


def merge_kinds(oddities: Iterable[Oddity]) -> list[list[Oddity]]:
    """Return the findings of one kind together: the same severity, check and column, whatever the recording."""
    groups: dict[tuple[str, str, str], list[Oddity]] = {}
    for oddity in oddities:
        groups.setdefault((oddity.severity, oddity.check, oddity.where.split(",")[0]), []).append(oddity)
    return list(groups.values())


def for_some(oddities: Iterable[Oddity], recordings: int, at_zero: Mapping[str, int]) -> list[Oddity]:
    """Return the findings of a campaign with so many `recordings`: where only some of these have one, its remedy spares the others.

    `at_zero` counts, by column, the recordings in which it is 0 throughout: no unit, sign or scale changes these.
    """
    found = list(oddities)
    groups: dict[tuple[str, str], set[str | None]] = {}
    for oddity in found:
        groups.setdefault((oddity.check, oddity.where.split(",")[0]), set()).add(oddity.recording)
    places = ((oddity, oddity.where.split(",")[0]) for oddity in found)
    return [_sparing(oddity, len(groups[oddity.check, column]), recordings - at_zero.get(column, 0)) for oddity, column in places]


def _sparing(oddity: Oddity, affected: int, recordings: int) -> Oddity:
    """The finding with a remedy for `affected` of the `recordings`: columns.yaml holds for all files of the campaign."""
    if not oddity.in_file or oddity.recording is None or affected >= recordings:
        return oddity
    share = f"{affected} of {recordings} recordings {'is' if affected == 1 else 'are'} so"
    if 2 * affected < recordings:
        return replace(oddity, remedy=f"only {share}: {oddity.in_file}; a line in columns.yaml would change the others, too")
    return replace(oddity, remedy=f"{share}; where all are, {oddity.remedy}; else {oddity.in_file}")


class OddityCheck(ABC):
    """What every check says about itself: `id`, what it looks for, and the remedy."""

    id: ClassVar[str]
    looks_for: ClassVar[str]
    remedy: ClassVar[str]


class RecordingCheck(OddityCheck):
    """A check of one recording at a time."""

    @abstractmethod
    def find(self, reading: Reading) -> Iterator[Oddity]:
        """Yield what is odd about one recording."""


class ArmCheck(OddityCheck):
    """A check of the arm as arm.yaml states it."""

    @abstractmethod
    def find(self, arm: Arm) -> Iterator[Oddity]:
        """Yield what is odd about the arm."""


class TableCheck(OddityCheck):
    """A check of one steady table."""

    @abstractmethod
    def find(self, table: SteadyTable, arm: Arm) -> Iterator[Oddity]:
        """Yield what is odd about the table."""


class CampaignCheck(OddityCheck):
    """A check across recordings; runs only where every recording is usable."""

    @abstractmethod
    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield what is odd about the campaign."""


C = TypeVar("C", bound=type[OddityCheck])
CHECKS: dict[str, OddityCheck] = {}


def check(kind: C) -> C:
    """Register a check; its card must be complete and its id new."""
    for key in ("id", "looks_for", "remedy"):
        if not getattr(kind, key, ""):
            raise TypeError(f"check {kind.__name__} has no {key}")
    if kind.id in CHECKS:
        raise TypeError(f"two checks are called {kind.id!r}")
    CHECKS[kind.id] = kind()
    return kind
