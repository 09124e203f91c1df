"""`nnhydro reproduce`: the tables and figures of a paper, beside what the paper says."""

from pathlib import Path

import typer

from nnhydro.report.screen import JSON, QUIET, conclude, emit, say, table


def reproduce(
    name: str = typer.Argument("mclain", help="Which paper: mclain (McLain & Rock 1998)."),
    out: Path = typer.Option(Path("nnhydro_out/reproduce_mclain"), "--out", help="Folder for the figures and reproduction.json."),
    seed: int = typer.Option(0, "--seed", help="Seed of the deviations and of the intervals."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Reproduce McLain & Rock (1998): curves, slews, errors, segments, slenderness; says what the text does not allow."""
    from nnhydro.errors import require
    from nnhydro.evaluation import reproduce_mclain
    from nnhydro.files import check_folder, whole_folder, write_json
    from nnhydro.report.mclain_figures import write_figures

    require(name == "mclain", f"unknown paper {name!r}: the one that can be reproduced is mclain")
    check_folder(out, "reproduction.json")
    result = reproduce_mclain.reproduce(seed)
    with whole_folder(out, "reproduction.json") as folder:
        write_json(folder / "reproduction.json", result.document())
        figures = [path.name for path in write_figures(result, folder)]
    if json:
        emit(result.document())
        return
    table("McLain & Rock (1998)", ("what", "published", "here"), reproduce_mclain.table(result))
    say("Not in the text, so not reproduced:")
    for gap in reproduce_mclain.NOT_IN_TEXT:
        say(f"  - {gap}")
    conclude(f"{len(reproduce_mclain.table(result))} published numbers beside ours, {len(reproduce_mclain.NOT_IN_TEXT)} that the text does "
             "not allow.", [out / figure for figure in figures if figure.endswith(".png")])
