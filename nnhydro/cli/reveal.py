"""`nnhydro reveal`: score diagnoses of concealed campaigns against the sealed answers."""

from pathlib import Path
from typing import Annotated

import typer

from nnhydro.cli.terminal.output import JSON, QUIET, emit

Suite = Annotated[Path, typer.Argument(metavar="DIR", help="The suite that nnhydro conceal made.")]
Diagnoses = Annotated[Path, typer.Option("--diagnoses", help="Folder with <campaign>/diagnosis.json, model/, baseline/, torques/.")]
Key = Annotated[Path | None, typer.Option("--key", help="File with the key; default DIR/key.txt.")]


def reveal(suite: Suite, diagnoses: Diagnoses, key: Key = None, quiet: bool = QUIET, json: bool = JSON) -> None:
    """Score diagnoses of concealed campaigns.

    Opens the sealed answers of a suite and compares names, joints, false claims, parameters and unseen motions.
    """
    from nnhydro.blind_tests.reveal import reveal as opened
    from nnhydro.cli.terminal.score import print_score

    score = opened(suite, diagnoses, key)
    if json:
        emit(score)
    else:
        print_score(score, str(suite))
