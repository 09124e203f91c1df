"""Campaigns: from a folder, or from data frames in memory."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from nnhydro.errors import CampaignError
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.arm import read_arm as read_file
from nnhydro.recordings.campaign import Campaign, verify_campaign
from nnhydro.recordings.readers.files import channel_names
from nnhydro.recordings.readers.from_columns import NamedColumns, recording_from_columns
from nnhydro.recordings.recording import Origin, Recording

if TYPE_CHECKING:
    import pandas as pd


def read_arm(file: str | Path) -> Arm:
    """Return the arm in the YAML file `file`; raises ArmError with one line naming file and key."""
    return read_file(Path(file))


def load(folder: str | Path, columns: str | Path | None = None) -> Campaign:
    """Return the campaign in `folder` (arm.yaml, recordings/, steady/); every file is read once, so that a faulty one is named now.

    `columns` is a YAML file that says what foreign columns mean; by default columns.yaml in the folder. Raises NnhydroError
    (CampaignError, ArmError, RecordingError, ConfigError) with one line that says what is wrong, where, and the remedy.
    """
    return verify_campaign(Path(folder), None if columns is None else Path(columns))


def campaign_of(given: Campaign | str | Path) -> Campaign:
    """Return a campaign as it is, and that of a folder as `load` reads it; raises CampaignError for anything else."""
    if isinstance(given, Campaign):
        return given
    if isinstance(given, str | Path):
        return load(given)
    raise CampaignError(f"campaign: got {type(given).__name__}: give a folder, what nnhydro.load returns, or "
                        "nnhydro.Campaign.of(arm, recordings) of recordings in memory (nnhydro.read_frame)")


def read_frame(frame: "pd.DataFrame", arm: Arm, name: str = "recording", torque: bool = True) -> Recording:
    """Return the recording in a data frame whose columns are those of a recording's file (t_s, q1_rad, tau1_Nm, ...), SI units.

    Without `torque` it is a motion alone. Raises RecordingError naming the column that is missing or not a number.
    """
    known = channel_names(arm, torque)
    columns = {str(label): np.asarray(frame[label], dtype=float) for label in frame.columns if str(label) in known}
    named = NamedColumns(dict(columns), tuple(map(str, frame.columns)))
    return recording_from_columns(named, arm, name, Origin(name, "", "data frame"), torque)
