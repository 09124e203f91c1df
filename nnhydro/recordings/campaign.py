"""A campaign: the arm and its recordings, read one at a time so that memory stays flat as recordings grow."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from textwrap import shorten
from typing import Any, TypeVar, final

from nnhydro.errors import CampaignError, RecordingError, count_text
from nnhydro.recordings.arm import Arm, read_arm
from nnhydro.recordings.content_hash import exact, marks
from nnhydro.recordings.filtering.preprocessing import Preparation, plan, prepare, steady_segment
from nnhydro.recordings.readers.column_map import FOLDERS, ColumnMap, map_file, read_column_map
from nnhydro.recordings.readers.files import FORMATS, is_bag_folder, is_readable, read_recording, read_steady
from nnhydro.recordings.recording import Recording, SteadyTable
from nnhydro.recordings.segment import Segment
from nnhydro.runtime.stamp import ARM_FILES, is_system_file

T = TypeVar("T")
R = TypeVar("R")

SHORT, MOST, NAMED = 60, 5, 3  # characters of a further complaint, complaints and files of each that are listed
CACHED_SAMPLES = 500_000  # about 60 MB: recordings beyond that are read again from disk when they are needed again


@final
@dataclass(eq=False, repr=False)
class Campaign:
    """The arm, its recordings (read when asked for), its steady tables and the sha256 of all that was read.

    `names` are the recordings' names in order; `load` reads one. `Campaign.of` makes one from recordings in memory.
    """

    arm: Arm
    names: tuple[str, ...]
    read: Callable[[str], Recording]
    steady: tuple[SteadyTable, ...] = ()
    root: Path | None = None
    mapping: ColumnMap | None = None  # of columns, that the files were read through
    _cache: dict[str, Recording] = field(default_factory=dict, repr=False)
    _seen: dict[str, str] = field(default_factory=dict, repr=False)  # sha256 of each recording when it was first read
    _marks: dict[str, frozenset[str]] = field(default_factory=dict, repr=False)  # of what each recording holds

    def __getstate__(self) -> dict[str, Any]:
        """What goes to another process: recordings that were read are read there again, from their files."""
        return {**self.__dict__, "_cache": {}}

    def __repr__(self) -> str:
        names = ", ".join(self.names[:3]) + (", ..." if len(self.names) > 3 else "")
        parts = [count_text(self.arm.n_links, "link"), f"{count_text(len(self.names), 'recording')} ({names})"]
        parts += [f"steady table {table.name} ({count_text(len(table), 'run')})" for table in self.steady]
        return f"<Campaign {self.arm.name!r}: {', '.join(parts)}{'' if self.root is None else f', in {self.root}'}>"

    @staticmethod
    def of(arm: Arm, recordings: list[Recording], steady: tuple[SteadyTable, ...] = ()) -> "Campaign":
        """Return a campaign of recordings that are in memory already."""
        by_name = {recording.name: recording for recording in recordings}
        if len(by_name) != len(recordings):
            raise CampaignError("two recordings have the same name: rename one")
        return Campaign(arm, tuple(by_name), by_name.__getitem__, steady)

    def load(self, name: str) -> Recording:
        """Return the recording called `name`; raises RecordingError where its file cannot be used."""
        if name not in self._cache:
            recording = self.read(name)
            first = self._seen.setdefault(name, recording.origin.sha256)
            if recording.origin.sha256 != first:
                raise RecordingError(f"{recording.origin.path or name}: changed since this run first read it: results would come from two "
                                     "versions of it; run again on files that nobody writes to")
            if sum(len(r) for r in self._cache.values()) + len(recording) > CACHED_SAMPLES:
                self._cache.clear()
            self._cache[name] = recording
        return self._cache[name]

    def content(self, name: str) -> str:
        """Return the sha256 of what the recording called `name` holds (content_hash.py); it is read where it was not yet."""
        (found,) = exact(self.marks(name))
        return found

    def marks(self, name: str) -> frozenset[str]:
        """Return that sha256 and the marks by which the recording is known when it was saved again with fewer digits."""
        if name not in self._marks:
            self._marks[name] = marks(self.load(name))
        return self._marks[name]

    def recordings(self) -> Iterator[Recording]:
        """Yield the recordings one at a time."""
        for name in self.names:
            yield self.load(name)

    def verify(self) -> None:
        """Read every recording once; raises one RecordingError that lists all that cannot be used."""
        every_one(self.names, self.load)

    def plan(self, cutoff_hz: float | None = None) -> Preparation:
        """Return how this campaign's recordings are prepared (filter and cut-off); see `preprocessing.plan`."""
        return plan(self.recordings(), cutoff_hz) if self.names else Preparation(None)

    def segments(self, name: str, how: Preparation) -> tuple[Segment, ...]:
        """Return the segments of the recording called `name`."""
        return tuple(self._of_arm(segment) for segment in prepare(self.load(name), how))

    def _of_arm(self, segment: Segment) -> Segment:
        return replace(segment, sliding=True) if self.arm.sliding else segment

    def steady_segments(self) -> tuple[Segment, ...]:
        """Return one segment a steady table."""
        return tuple(self._of_arm(steady_segment(table)) for table in self.steady)

    def sha256(self) -> str:
        """Return one sha256 over the arm and every file, in order of name."""
        digest = hashlib.sha256(repr(sorted(self.arm.document().items())).encode())
        for name in sorted(self.names):
            digest.update(f"{name}:{self.load(name).origin.sha256}".encode())
        for table in sorted(self.steady, key=lambda table: table.name):
            digest.update(f"{table.name}:{table.origin.sha256}".encode())
        digest.update(b"" if self.mapping is None else self.mapping.sha256.encode())
        return digest.hexdigest()


def _first_names(names: Sequence[str], most: int) -> str:
    """The first names, and how many more there are."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def _others(wrong: Sequence[str]) -> str:
    """What the messages after the first say: files with one complaint together, and the beginning of each complaint but the first."""
    groups: dict[str, list[str]] = {}
    for line in wrong:
        where, _, what = line.partition(": ")
        groups.setdefault(what, []).append(where.rpartition("/")[2])
    (_, first), *rest = groups.items()
    parts = [f"the same in {_first_names(first[1:], NAMED)}"] if len(first) > 1 else []
    parts += [f"{_first_names(files, NAMED)}: {shorten(what, SHORT, placeholder=' ...')}" for what, files in rest[:MOST]]
    return "; ".join([*parts, *(["..."] if len(rest) > MOST else [])])


def every_one(names: Sequence[T], load: Callable[[T], R]) -> list[R]:
    """Return what `load` gives for every name; raises one RecordingError that lists all that cannot be used, the first with its remedy."""
    found, wrong = list[R](), list[str]()
    for name in names:
        try:
            found.append(load(name))
        except RecordingError as cause:
            wrong.append(str(cause))
    if wrong:
        more = f" (and {len(wrong) - 1} more of {len(names)} files: {_others(wrong)})" if len(wrong) > 1 else ""
        raise RecordingError(wrong[0] + more)
    return found


def arm_file(root: Path) -> Path | None:
    """Return the file that describes the arm of the campaign in `root`, arm.yaml or arm.yml; None where there is none."""
    there = [root / name for name in ARM_FILES if (root / name).is_file()]
    if len(there) > 1:
        raise CampaignError(f"{root}: has both {there[0].name} and {there[1].name}: remove one")
    return there[0] if there else None


def _files(folder: Path) -> dict[str, Path]:
    """Recordings in `folder` by name; hidden files are passed over. Raises where two share a name or a file is of another kind."""
    found: dict[str, Path] = {}
    if not folder.is_dir():
        if folder.exists():
            raise CampaignError(f"{folder}: is a file: it must be the folder that holds the runs")
        return found
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or is_system_file(path.name):
            continue
        if path.is_dir() and not is_bag_folder(path):
            raise CampaignError(f"{path}: is a folder: move its files up into {folder.name}/, or start its name with a dot to leave it out")
        if not is_readable(path):
            kinds = ", ".join(FORMATS)
            raise CampaignError(f"{path}: is none of {kinds}: convert it, move it out of {folder.name}/ or start its name with a dot")
        name = path.name if path.is_dir() else path.stem
        if name in found:
            raise CampaignError(f"{path}: the name {name!r} is taken by {found[name].name}: rename one")
        found[name] = path
    return found


def _read(files: dict[str, Path], arm: Arm, mapping: ColumnMap | None, name: str) -> Recording:
    return read_recording(files[name], arm, column_map=mapping)


def _require_folder(root: Path) -> None:
    wrong = "" if root.is_dir() else "is a file" if root.exists() else "does not exist"
    above, inside = root.resolve().parent, root.resolve().name
    if not wrong and inside in FOLDERS and arm_file(root) is None and arm_file(above) is not None:
        wrong = f"is the folder {inside}/ of the campaign {above}"
    if wrong:
        raise CampaignError(f"{root}: {wrong}: give the campaign's folder (it holds arm.yaml)")


def open_campaign(root: Path, column_map: Path | None = None) -> Campaign:
    """Return the campaign in the folder `root`; raises CampaignError, ArmError, ConfigError or RecordingError with one line.

    `column_map` is a mapping of foreign columns (YAML); by default columns.yaml in `root`, where there is one.
    """
    _require_folder(root)
    described = arm_file(root)
    if described is None:
        inside = sorted(path.name for path in root.iterdir() if path.is_dir() and arm_file(path) is not None)
        hint = f"it holds the campaigns {', '.join(inside[:5])}: give one of them" if inside else \
            f"write one (the README shows it), or make it from a URDF: nnhydro arm FILE.urdf --out {root / 'arm.yaml'}"
        raise CampaignError(f"{root}: has no arm.yaml: {hint}")
    arm = read_arm(described)
    given = column_map or map_file(root)
    mapping: ColumnMap | None = None if given is None else read_column_map(given)
    files = _files(root / "recordings")
    steady = tuple(every_one(tuple(_files(root / "steady").values()), lambda path: read_steady(path, arm, mapping)))
    if not files and not steady:
        raise CampaignError(f"{root}: holds neither recordings nor steady runs: put the logs into recordings/ there, one file per run "
                            f"({', '.join(FORMATS)}), or a table of steady runs, one row per run, into steady/")
    return Campaign(arm, tuple(files), partial(_read, files, arm, mapping), steady, root, mapping)


def verify_campaign(root: Path, column_map: Path | None = None) -> Campaign:
    """Return the campaign in `root` after reading every file of it once: the first that cannot be used is raised now, not midway."""
    campaign = open_campaign(root, column_map)
    campaign.verify()
    return campaign


def _subfolders(root: Path) -> tuple[Path, ...]:
    """The visible folders inside `root`, in order; none where `root` is a campaign itself."""
    if not root.is_dir() or arm_file(root) is not None:
        return ()
    return tuple(sorted(path for path in root.iterdir() if path.is_dir() and not (path.name.startswith(".") or is_system_file(path.name))))


def folders_without_arm(root: Path) -> tuple[str, ...]:
    """Return the names of the folders beside the campaigns inside `root` that are none; empty where `root` holds no campaigns."""
    names = tuple(path.name for path in _subfolders(root) if arm_file(path) is None)
    return names if inner_campaigns(root) else ()


def inner_campaigns(root: Path) -> tuple[Path, ...]:
    """Return the folders of the campaigns inside `root`, in order; none where `root` is a campaign itself."""
    return tuple(path for path in _subfolders(root) if arm_file(path) is not None)


def open_campaigns(root: Path, column_map: Path | None = None) -> tuple[Campaign, ...]:
    """Return the campaign in `root`, or those in its sub-folders, one an arm, where `root` has no arm.yaml but they do."""
    _require_folder(root)
    return tuple(open_campaign(folder, column_map) for folder in inner_campaigns(root) or (root,))
