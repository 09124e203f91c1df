"""`nnhydro check`: read a campaign, say what is derived and what looks wrong."""

from pathlib import Path

import typer

from nnhydro.cli.terminal.output import (
    BACKEND,
    CUTOFF,
    JOBS,
    JSON,
    MAP,
    QUIET,
    SCHEDULER,
    conclude,
    emit,
    note_folders_without_arm,
    say,
    shell_words,
)


def check(
    campaign: Path = typer.Argument(help="Folder of the campaign (arm.yaml, recordings/, steady/), or a folder of campaigns."),
    column_map: Path | None = MAP,
    cutoff: float | None = CUTOFF,
    jobs: int = JOBS,
    backend: str = BACKEND,
    scheduler: str = SCHEDULER,
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Read a campaign and say what looks wrong in it.

    Prints what was given, what is derived, what looks wrong, and the remedy.
    """
    from nnhydro.cli.terminal.survey import print_survey
    from nnhydro.errors import ConfigError, RecordingError, require
    from nnhydro.fitting.physical_survey import survey_with_physics
    from nnhydro.recordings.campaign import open_campaigns
    from nnhydro.recordings.checks.oddity import merge_kinds
    from nnhydro.report.survey_table import document, verdict_of_all
    from nnhydro.runtime.workers import Workers

    require(cutoff is None or 0 < cutoff < 1e6, f"--cutoff {cutoff}: give a positive frequency in Hz", ConfigError)
    workers = Workers(jobs, backend, scheduler)
    documents, failed, surveys = [], [], {}
    campaigns = open_campaigns(campaign, column_map)
    note_folders_without_arm(campaign)
    for opened in campaigns:
        found, name = survey_with_physics(opened, cutoff, workers), str(opened.root)
        surveys[opened.root.name if opened.root else name] = found
        failed += [f"{name}: {kind[0].message}" for kind in merge_kinds(found.errors)]
        if json:
            documents.append(document(found, name))
            continue
        if len(campaigns) > 1:
            say(f"== {opened.arm.name} ({name})")
        print_survey(found, shell_words(name, column_map))
    if not json and len(campaigns) > 1:
        say()
        conclude(verdict_of_all(surveys))
    if json:
        emit(documents[0] if len(documents) == 1 else {"campaigns": documents})
    if failed:
        more = f" (and {len(failed) - 1} more)" if len(failed) > 1 else ""
        raise RecordingError(f"{failed[0]}{more}")
