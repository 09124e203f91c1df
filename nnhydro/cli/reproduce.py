"""`nnhydro reproduce`: the tables and figures of a paper, beside what the paper says."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import typer

from nnhydro.cli.terminal.output import JSON, MAP, QUIET, conclude, emit, say, table


@final
@dataclass(frozen=True)
class Study:
    """What is printed and written of a paper."""

    title: str
    headings: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    kind: str  # of rows
    gaps: tuple[str, ...]
    document: dict[str, Any]
    draw: Callable[[Path], list[Path]]


def _mclain(seed: int) -> Study:
    from nnhydro.evaluation.mclain import reproduce as study
    from nnhydro.report.mclain_figures import write_figures

    result = study.reproduce(seed)
    return Study("McLain & Rock (1998)", ("what", "published", "here"), study.table(result), "published numbers and ours",
                 study.NOT_IN_TEXT, result.document(), lambda folder: write_figures(result, folder))


def _rivera(seed: int, campaign: Path | None, column_map: Path | None, epochs: int, quiet: bool) -> Study:
    from nnhydro.demo import CAMPAIGN
    from nnhydro.evaluation import reproduce_rivera as study
    from nnhydro.recordings.campaign import open_campaign
    from nnhydro.report.rivera_figures import write_figures

    result = study.reproduce(open_campaign(campaign or CAMPAIGN, column_map), seed, epochs, (lambda text: None) if quiet else say)
    return Study("Rivera's identifier (1995), a study of our own", ("what", "common layers", "parallel layers"), study.table(result),
                 "lines of a study of our own", study.NOT_IN_TEXT, result.document(), lambda folder: write_figures(result, folder))


def reproduce(
    name: str = typer.Argument("mclain", help="mclain (McLain & Rock 1998) or rivera (the identifier of Rivera 1995, as a study)."),
    out: Path | None = typer.Option(None, "--out", help="Folder for figures and reproduction.json; default nnhydro_out/reproduce_NAME."),
    seed: int = typer.Option(0, "--seed", help="Seed of the simulated deviations, the intervals and the networks."),
    campaign: Path | None = typer.Option(None, "--campaign", help="rivera: campaign of an arm in water; default the demo's."),
    column_map: Path | None = MAP,
    epochs: int = typer.Option(150, "--epochs", min=1, max=10_000, help="rivera: passes of each training over its rows."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Reproduce McLain & Rock (1998), or study Rivera's method.

    mclain: figures and tables, compared with the published numbers. rivera: a study of the identification by neural networks (1995). Lists
    what the texts do not determine.
    """
    from nnhydro.errors import require
    from nnhydro.runtime.files import check_folder, whole_folder, write_json
    from nnhydro.runtime.registry import choices

    require(name in ("mclain", "rivera"), f"unknown paper {name!r}: {choices(name, ('mclain', 'rivera'))}")
    require(campaign is None or name == "rivera", "--campaign: mclain needs none: leave it out, or reproduce rivera")
    out = out or Path("nnhydro_out") / f"reproduce_{name}"
    check_folder(out, "reproduction.json")
    study = _mclain(seed) if name == "mclain" else _rivera(seed, campaign, column_map, epochs, quiet or json)
    with whole_folder(out, "reproduction.json") as folder:
        write_json(folder / "reproduction.json", study.document)
        figures = [path.name for path in study.draw(folder)]
    if json:
        emit(study.document)
        return
    table(study.title, study.headings, study.rows)
    say("Not in the text, so not reproduced:")
    for gap in study.gaps:
        say(f"  - {gap}")
    conclude(f"{len(study.rows)} {study.kind}, {len(study.gaps)} that the text does not allow.",
             [out / figure for figure in figures if figure.endswith(".png")])
