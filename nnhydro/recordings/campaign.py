"""A campaign: the arm and its recordings, read one at a time so that memory stays flat as recordings grow."""

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import final

from nnhydro.errors import CampaignError
from nnhydro.recordings.arm import Arm, read_arm
from nnhydro.recordings.preprocessing import Preparation, plan, prepare, steady_segment
from nnhydro.recordings.readers.files import read_recording, read_steady
from nnhydro.recordings.readers.table import SUFFIXES
from nnhydro.recordings.recording import Recording, SteadyTable
from nnhydro.recordings.segment import Segment

CACHED_SAMPLES = 2_000_000  # about 100 MB: recordings beyond that are read again from disk when they are needed again


@final
@dataclass(eq=False)
class Campaign:
    """The arm, its recordings (read when asked for), its steady tables and the sha256 of all that was read.

    `names` are the recordings' names in order; `load` reads one. `Campaign.of` makes one from recordings in memory.
    """

    arm: Arm
    names: tuple[str, ...]
    read: Callable[[str], Recording]
    steady: tuple[SteadyTable, ...] = ()
    root: Path | None = None
    _cache: dict[str, Recording] = field(default_factory=dict, repr=False)

    @staticmethod
    def of(arm: Arm, recordings: list[Recording], steady: tuple[SteadyTable, ...] = ()) -> "Campaign":
        """Return a campaign of recordings that are in memory already."""
        by_name = {r.name: r for r in recordings}
        if len(by_name) != len(recordings):
            raise CampaignError("two recordings have the same name: rename one")
        return Campaign(arm, tuple(by_name), by_name.__getitem__, steady)

    def load(self, name: str) -> Recording:
        """Return the recording called `name`; raises RecordingError where its file cannot be used."""
        if name not in self._cache:
            recording = self.read(name)
            if sum(len(r) for r in self._cache.values()) + len(recording) > CACHED_SAMPLES:
                self._cache.clear()
            self._cache[name] = recording
        return self._cache[name]

    def recordings(self) -> Iterator[Recording]:
        """Yield the recordings one at a time."""
        for name in self.names:
            yield self.load(name)

    def plan(self, cutoff_hz: float | None = None) -> Preparation:
        """Return how this campaign's recordings are prepared (filter and cut-off); see `preprocessing.plan`."""
        return plan(self.recordings(), cutoff_hz) if self.names else Preparation(None)

    def segments(self, name: str, how: Preparation) -> tuple[Segment, ...]:
        """Return the segments of the recording called `name`."""
        return tuple(prepare(self.load(name), how))

    def steady_segments(self) -> tuple[Segment, ...]:
        """Return one segment a steady table."""
        return tuple(steady_segment(table) for table in self.steady)

    def sha256(self) -> str:
        """Return one sha256 over the arm and every file, in order of name."""
        digest = hashlib.sha256(repr(sorted(self.arm.document().items())).encode())
        for name in sorted(self.names):
            digest.update(f"{name}:{self.load(name).origin.sha256}".encode())
        for table in sorted(self.steady, key=lambda table: table.name):
            digest.update(f"{table.name}:{table.origin.sha256}".encode())
        return digest.hexdigest()


def _files(folder: Path) -> dict[str, Path]:
    """Tables in `folder` by stem; raises where two share a stem or a file is of another kind."""
    found: dict[str, Path] = {}
    if not folder.is_dir():
        return found
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or path.is_dir():
            continue
        if path.suffix not in SUFFIXES:
            raise CampaignError(f"{path}: is neither CSV nor Parquet: move it out of {folder.name}/ or convert it")
        if path.stem in found:
            raise CampaignError(f"{path}: the name {path.stem!r} is taken by {found[path.stem].name}: rename one")
        found[path.stem] = path
    return found


def open_campaign(root: Path) -> Campaign:
    """Return the campaign in the folder `root`; raises CampaignError, ArmError or RecordingError with one line."""
    if not root.is_dir():
        raise CampaignError(f"{root}: {'is a file' if root.exists() else 'does not exist'}: give the campaign's folder (it holds arm.yaml)")
    if not (root / "arm.yaml").is_file():
        inside = sorted(path.parent.name for path in root.glob("*/arm.yaml"))
        hint = f"it holds the campaigns {', '.join(inside[:5])}: give one of them" if inside else "write one; the README shows it"
        raise CampaignError(f"{root}: has no arm.yaml: {hint}")
    arm = read_arm(root / "arm.yaml")
    files = _files(root / "recordings")
    steady = tuple(read_steady(path, arm) for path in _files(root / "steady").values())
    if not files and not steady:
        raise CampaignError(f"{root}: holds neither recordings/*.csv nor steady/*.csv: put the runs there")
    return Campaign(arm, tuple(files), lambda name: read_recording(files[name], arm), steady, root)


