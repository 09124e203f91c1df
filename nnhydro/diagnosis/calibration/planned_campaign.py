"""A campaign that is only planned: a recipe's motions, run by the arm that the baseline describes, read by the sensors it states."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from nnhydro.errors import require
from nnhydro.models.baselines import BASELINES
from nnhydro.models.baselines import baseline as baseline_called
from nnhydro.physics.load_sum import Loads
from nnhydro.recordings.campaign import Campaign, open_campaign
from nnhydro.simulation.campaign_writer import write_campaign
from nnhydro.simulation.recipe.recipe import Recipe, read_recipe


def baseline_recipe(recipe: Recipe, named: str | None) -> tuple[Recipe, tuple[str, ...]]:
    """Return the recipe with the baseline's terms alone, and the names of the terms that were left off.

    Coefficients are those of the recipe where it states them, else the starting values of fits.
    """
    usual = "rigid" if recipe.arm.dry else "constant"
    start = baseline_called(named if named in BASELINES else usual).start(recipe.arm).terms
    kinds = {type(term) for term in start.values()}
    stated = {name: term for name, term in recipe.loads.terms.items() if type(term) in kinds}
    missing = {name: term for name, term in start.items() if type(term) not in {type(t) for t in stated.values()}}
    left_off = tuple(name for name in recipe.truth_names if name not in stated)
    return replace(recipe, loads=Loads({**stated, **missing}), concealed=None), left_off


def simulate_plan(plan: Path, named: str | None = None) -> tuple[Campaign, tuple[str, ...]]:
    """Return the campaign that the recipe in the file `plan` would give a healthy arm, and the terms of the recipe that were left off.

    Raises ConfigError for a recipe that cannot be carried out or states no noise of the torque.
    """
    recipe, left_off = baseline_recipe(read_recipe(plan), named)
    sensors = recipe.settings.sensors
    require(max(*sensors.torque_noise_Nm, *sensors.torque_noise_share) > 0, f"{plan}: sensors state no torque noise, so that any effect "
            "would show: give sensors.torque_noise_Nm or sensors.torque_noise_share as your rig has it")
    with TemporaryDirectory(prefix="nnhydro_plan_") as folder:
        write_campaign(recipe, Path(folder) / "campaign")
        written = open_campaign(Path(folder) / "campaign")
        return Campaign.of(written.arm, list(written.recordings()), written.steady), left_off
