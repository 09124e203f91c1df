"""The recipe of a simulated campaign: arm, terms of the truth, motions, controller, sensors, seed; checked whole before anything runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np

from nnhydro.errors import ConfigError, require
from nnhydro.physics.load_sum import Loads
from nnhydro.recordings.arm import Arm, parse_arm, read_arm
from nnhydro.recordings.readers.validation import validate
from nnhydro.recordings.readers.yaml_file import read_yaml
from nnhydro.runtime.registry import choices
from nnhydro.simulation.motions.motion_kind import MotionKind, Reference, Setting, TimedMotion, motion_of
from nnhydro.simulation.motions.steady import SteadyRuns
from nnhydro.simulation.plant import require_steps
from nnhydro.simulation.recipe.concealed_truth import ConcealedTruth, TruthKeys, concealed_truth
from nnhydro.simulation.recipe.model_truth import ModelTruth, model_truth
from nnhydro.simulation.recipe.recipe_file import RecipeFile
from nnhydro.simulation.recipe.true_loads import true_loads
from nnhydro.simulation.run import grid, require_length, stream


@final
@dataclass(frozen=True, eq=False)
class Recipe:
    """A recipe that can be carried out: every name resolved, every motion found possible."""

    settings: RecipeFile
    arm: Arm
    loads: Loads
    motions: tuple[MotionKind, ...]
    references: Mapping[str, Reference]  # of the motions against time, by name, in order
    document: Mapping[str, Any]  # as written
    folder: Path  # that paths in it refer to
    concealed: ConcealedTruth | None = None  # the truth in place of loads

    @property
    def truth_names(self) -> tuple[str, ...]:
        """What the truth is made of, in the words of the recipe."""
        return ("concealed",) if self.concealed is not None else tuple(self.loads.terms)

    @property
    def steady(self) -> tuple[SteadyRuns, ...]:
        """The grids of steady runs."""
        return tuple(m for m in self.motions if isinstance(m, SteadyRuns))

    @property
    def learned_truth(self) -> ModelTruth | None:
        """The truth where it is a model whose torque is not affine in the acceleration, else None."""
        learned = (term for term in self.loads.terms.values() if isinstance(term, ModelTruth) and not term.dynamics.affine)
        return next(learned, None)


def _references(settings: RecipeFile, motions: tuple[MotionKind, ...], arm: Arm, folder: Path) -> dict[str, Reference]:
    """Every motion against time as a function, tried against the limits at the sampling instants."""
    made: dict[str, Reference] = {}
    for motion in motions:
        if isinstance(motion, TimedMotion):
            reference = motion.reference(Setting(arm, stream(settings.seed, motion.name, "motion"), folder))
            require_length(reference, settings.sample_rate_hz, settings.fine_rate_hz, motion.name)
            t = grid(reference, settings.sample_rate_hz)
            settings.limits.require_within(reference.at(t), t, motion.name)
            made[motion.name] = reference
        elif isinstance(motion, SteadyRuns):
            state = motion.states(arm.n_links)
            settings.limits.require_within(state, np.arange(len(state.u0), dtype=float), motion.name)
    return made


def _require_names(settings: RecipeFile, motions: tuple[MotionKind, ...], where: str) -> None:
    """Raise ConfigError where two motions have one name, or `unseen` names a motion that is not there."""
    seen: set[str] = set()
    for motion in motions:
        # names become files, and some file systems do not tell upper from lower case
        require(motion.name.casefold() not in seen, f"{where}: two motions are called {motion.name!r}: rename one")
        seen.add(motion.name.casefold())
    timed = [motion.name for motion in motions if isinstance(motion, TimedMotion)]
    for name in settings.unseen:
        require(name in timed, f"{where}: unseen: {name!r} is not a motion against time of this recipe: {choices(name, timed)}")


def _truth(settings: RecipeFile, where: str, folder: Path) -> tuple[Arm, Loads, ConcealedTruth | None]:
    """The arm and what loads it: terms, or a model as the only one; or a concealed world."""
    if isinstance(settings.truth, TruthKeys):
        world = concealed_truth(settings.truth.concealed, settings.seed, where)
        return world.arm, Loads({}), world
    if settings.truth is not None:
        model = model_truth(folder / settings.truth, where)
        return model.dynamics.arm, Loads({Path(settings.truth).name: model}), None
    arm = read_arm(folder / settings.arm) if isinstance(settings.arm, str) else parse_arm(settings.arm or {}, f"{where}: arm")
    return arm, true_loads(settings.terms, arm, where), None


def parse_recipe(document: Mapping[str, Any], where: str, folder: Path) -> Recipe:
    """Return the recipe that `document` describes, paths in it relative to `folder`; raise NnhydroError naming `where` and the key."""
    settings = validate(RecipeFile, dict(document), where, ConfigError)
    arm, loads, concealed = _truth(settings, where, folder)
    motions = tuple(motion_of(m, f"{where}: motions[{i}]") for i, m in enumerate(settings.motions))
    _require_names(settings, motions, where)
    settings.sensors.require_fit(arm, settings.sample_rate_hz, settings.fine_rate_hz)
    if settings.controller is not None:
        settings.controller.torque_law(arm, settings.sample_rate_hz, folder)
        if settings.truth is None:
            require_steps(loads, arm)
    recipe = Recipe(settings, arm, loads, motions, _references(settings, motions, arm, folder), document, folder, concealed)
    if concealed is not None:
        require(not recipe.steady, f"{where}: motions: a concealed world gives no steady tables: leave out "
                f"{', '.join(repr(table.name) for table in recipe.steady)}, or give truth as terms or a model")
        concealed.require_possible(recipe.references, settings.fine_rate_hz, settings.controller is not None, where)
    return recipe


def read_recipe(path: Path) -> Recipe:
    """Return the recipe in the file `path`; raise NnhydroError with one line naming file and key."""
    return parse_recipe(read_yaml(path, ConfigError), str(path), path.parent)
