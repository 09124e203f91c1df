"""`nnhydro effects`: the catalogue of what a simulation may omit."""

from pathlib import Path

import typer

from nnhydro.cli.terminal.output import JSON, QUIET, emit, say


def effects(
    name: str | None = typer.Argument(None, metavar="[ID]", help="Explain this effect; without it all are listed."),
    plugin: Path | None = typer.Option(None, "--effects", help="Python file with your own effects (@effect); nnhydro runs it."),
    out: Path | None = typer.Option(None, "--out", help="PNG file for a picture of the signature; SVG and CSV are written next to it."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """List the effects that a diagnosis can find, or explain one."""
    from nnhydro.cli.terminal.effect_card import print_card, print_list
    from nnhydro.effects.catalogue import card, catalogue, effect_of_id
    from nnhydro.effects.plugin import load_plugin
    from nnhydro.errors import require

    require(out is None or name is not None, "--out needs an ID: nnhydro effects ID --out FILE.png")
    require(out is None or out.suffix.lower() == ".png", f"--out {out}: give a file that ends in .png")
    if plugin is not None:
        load_plugin(plugin)
    if name is None:
        every = list(catalogue().values())
        if json:
            emit([card(effect) for effect in every])
        else:
            print_list(every)
        return
    effect = effect_of_id(name)
    if out is not None:
        from nnhydro.report.effects.effect_figure import draw
        from nnhydro.report.figure_file import paths_of
        from nnhydro.runtime.stamp import refuse_foreign, stamp_file

        for path in paths_of(out.with_suffix("")):
            refuse_foreign(path)
        draw(effect, out)
        for path in paths_of(out.with_suffix("")):
            stamp_file(path)
    if json:
        emit(card(effect))
        return
    print_card(effect)
    say(f"Picture: {out}" if out is not None else f"A picture of what it looks like: nnhydro effects {name} --out {name}.png")
