"""`nnhydro simulate`: a tow-tank campaign from a recipe."""

from pathlib import Path
from typing import Annotated

import typer

from nnhydro.cli.terminal.output import JSON, QUIET, conclude, emit, say, shell_words, table

RecipeArgument = Annotated[Path, typer.Argument(metavar="RECIPE.yaml", help="Arm, load terms, motions, controller, sensors, seed.")]
OutOption = Annotated[Path, typer.Option("--out", help="Folder for the campaign; an earlier simulated campaign there is replaced.")]


def simulate(recipe: RecipeArgument, out: OutOption, quiet: bool = QUIET, json: bool = JSON) -> None:
    """Simulate a tow-tank campaign.

    A recipe holds arm, true loads, motions, controller, sensors and seed. The key terms lists the true loads (rigid_body, normal_drag,
    added_mass, coulomb_friction, ...). In place of arm and terms, the key truth may name the folder of a model, or hide an effect as
    nnhydro conceal does: {concealed: {effect: ID, seed: N}}.
    Motions are tow, slew, rotation, fourier, file and steady (a grid of steady runs).
    """
    from nnhydro.errors import count_text
    from nnhydro.simulation.campaign_writer import write_campaign
    from nnhydro.simulation.recipe.recipe import read_recipe

    read = read_recipe(recipe)
    made = write_campaign(read, out)
    if json:
        emit({"campaign": str(out), "name": read.settings.name, "seed": read.settings.seed, "terms": list(read.truth_names),
              "files": [{"file": recording.file, "kind": recording.kind, "rows": recording.rows, "seconds": recording.seconds}
                        for recording in made]})
        return
    table(f"{out}: {read.arm.name}, seed {read.settings.seed}", ("file", "motion", "rows", "seconds"),
          [(recording.file, recording.kind, str(recording.rows), "" if recording.seconds is None else f"{recording.seconds:.2f}")
           for recording in made])
    say(f"Truth: {', '.join(read.truth_names)}")
    conclude(f"{count_text(len(made), 'file')} in {out}, seed {read.settings.seed}.", following=f"nnhydro check {shell_words(out)}")
