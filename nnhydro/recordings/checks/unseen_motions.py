"""Motions in unseen/ that cannot be read, or not be used as they are: no fit needs them, but predict will."""

from collections.abc import Iterator
from pathlib import Path

from nnhydro.errors import NnhydroError
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CHECKS, CampaignCheck, Oddity, RecordingCheck, check
from nnhydro.recordings.checks.reading import Reading
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.files import read_recording
from nnhydro.runtime.stamp import is_system_file

FOLDER = "unseen"


@check
class UnseenMotions(CampaignCheck):
    """Every motion in unseen/ can be predicted."""

    id = "unseen_motions"
    looks_for = "files in unseen/ that no reader takes, or whose motions are unusable"
    remedy = "predict refuses it"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield one warning a file."""
        folder = None if campaign.root is None else campaign.root / FOLDER
        for path in sorted(folder.iterdir()) if folder is not None and folder.is_dir() else ():
            said = "" if path.name.startswith(".") or is_system_file(path.name) else self._complaint(path, campaign)
            if said:
                yield Oddity(None, "warning", f"{FOLDER}/{path.name}", said, self.remedy)

    def _complaint(self, path: Path, campaign: Campaign) -> str:
        """What keeps one motion from being used, "" where nothing does."""
        try:
            motion = read_recording(path, campaign.arm, torque=False, column_map=campaign.mapping)
        except NnhydroError as cause:
            return str(cause).removeprefix(f"{path}: ")
        reading = Reading.of(motion, campaign.arm)
        found = (oddity for kind in CHECKS.values() if isinstance(kind, RecordingCheck) for oddity in kind.find(reading))
        return next((f"{oddity.where}: {oddity.what}" for oddity in found if oddity.severity == "error"), "")
