"""Files and folders of a campaign that nnhydro does not read: a misspelt folder, logs beside arm.yaml."""

from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path

from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.checks.oddity import CampaignCheck, Oddity, check
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.readers.column_map import FOLDERS
from nnhydro.recordings.readers.files import is_readable

NEAR = 0.8  # likeness of two names: "recording" and "recordings" have 0.95
TEXTS = (".txt",)  # may be notes


def _logs(folder: Path) -> list[Path]:
    """Files of `folder` that a reader would take, notes aside."""
    return [path for path in sorted(folder.iterdir()) if is_readable(path) and path.suffix.lower() not in TEXTS
            and not path.name.startswith(".")]


@check
class MisplacedFiles(CampaignCheck):
    """Recordings lie in recordings/, steady/ or unseen/."""

    id = "misplaced_files"
    looks_for = "folders called much like those that are read, and logs beside arm.yaml"
    remedy = "nnhydro does not read it: move what belongs to the campaign into recordings/, steady/ or unseen/"

    def find(self, campaign: Campaign, how: Preparation) -> Iterator[Oddity]:
        """Yield a warning a folder, and a note for all files beside arm.yaml."""
        if campaign.root is None:
            return
        for folder in sorted(path for path in campaign.root.iterdir() if path.is_dir() and path.name not in FOLDERS):
            close = get_close_matches(folder.name.lower(), FOLDERS, n=1, cutoff=NEAR)
            if close and _logs(folder):
                yield Oddity(None, "warning", f"{folder.name}/", f"holds {len(_logs(folder))} log(s), but only {close[0]}/ is read",
                             f"move them to {close[0]}/, or rename the folder")
        loose = _logs(campaign.root)
        if loose:
            named = ", ".join(path.name for path in loose[:3]) + (f" and {len(loose) - 3} more" if len(loose) > 3 else "")
            yield Oddity(None, "warning", named, "lies beside arm.yaml" if len(loose) == 1 else "lie beside arm.yaml", self.remedy)
