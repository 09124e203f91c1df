"""Carry out a recipe and write the campaign folder, whole or not at all; the same recipe and versions give the same bytes.

    arm.yaml  recordings/  steady/  unseen/        the campaign
    answers/                                       torques of the unseen motions, with and without the sensor's noise
    recipe.yaml  motions/  truth/  recipe.json     the recipe, complete in itself; seed and versions
"""

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np
import yaml
from numpy.typing import NDArray

from nnhydro.conventions import TIME
from nnhydro.errors import require
from nnhydro.runtime.files import whole_folder, write_json, write_text
from nnhydro.simulation.forward import run_controlled
from nnhydro.simulation.motions.motion_kind import TimedMotion
from nnhydro.simulation.plant import Plant
from nnhydro.simulation.recipe.recipe import Recipe
from nnhydro.simulation.run import Run, run_prescribed, stream
from nnhydro.simulation.sensors import RecordedRun, record
from nnhydro.simulation.steady_table import steady_table

Array = NDArray[np.float64]
MARKER = "recipe.json"  # a folder that holds it was made here and may be replaced


@final
@dataclass(frozen=True)
class WrittenRun:
    """One file of the campaign: what it holds, in words and numbers for people."""

    file: str
    kind: str
    rows: int
    seconds: float | None  # None for a table of steady runs


def runs(recipe: Recipe) -> Iterator[Run]:
    """Yield the runs of the motions against time, in order, before any sensor saw them; raise ConfigError naming the motion."""
    settings, control = recipe.settings, recipe.settings.controller
    law = None if control is None else control.torque_law(recipe.arm, settings.sample_rate_hz, recipe.folder)
    if recipe.concealed is not None:
        yield from recipe.concealed.runs(recipe.references, law, settings.fine_rate_hz, settings.hold)
    elif law is None:
        for name, reference in recipe.references.items():
            yield run_prescribed(name, reference, recipe.arm, recipe.loads, settings.fine_rate_hz)
    elif recipe.references:
        if recipe.learned_truth is not None:
            yield from recipe.learned_truth.track_all(recipe.references, law, settings.fine_rate_hz, settings.hold)
            return
        yield from run_controlled(recipe.references, Plant(recipe.arm, recipe.loads), law, settings.fine_rate_hz, settings.hold)


def record_runs(recipe: Recipe) -> Iterator[RecordedRun]:
    """Yield what the sensors record of each run, then the steady tables."""
    settings = recipe.settings
    for run in runs(recipe):
        yield record(run, recipe.arm, settings.sensors, settings.steps, stream(settings.seed, run.name, "sensors"))
    for table in recipe.steady:
        yield steady_table(table, recipe.arm, recipe.loads, settings.sensors, settings.sample_rate_hz,
                           stream(settings.seed, table.name, "sensors"))


def _csv(path: Path, columns: dict[str, Array]) -> None:
    path.parent.mkdir(exist_ok=True)
    # + 0.0 turns minus zero into zero
    np.savetxt(path, np.column_stack(list(columns.values())) + 0.0, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")


def _write(work: Path, seen: RecordedRun, kind: str, unseen: bool) -> WrittenRun:
    """Write one run to its folder and return what was made."""
    if kind == "steady":
        _csv(work / "steady" / f"{seen.name}.csv", seen.motion | seen.torque)
        return WrittenRun(f"steady/{seen.name}.csv", kind, len(seen.clean), None)
    t = seen.motion[TIME]
    folder = "unseen" if unseen else "recordings"
    _csv(work / folder / f"{seen.name}.csv", seen.motion if unseen else seen.motion | seen.torque)
    if unseen:
        clean = {name.replace("_Nm", "_clean_Nm"): x for name, x in zip(seen.torque, seen.clean.T, strict=True)}
        _csv(work / "answers" / f"{seen.name}.csv", {TIME: t} | seen.torque | clean)
    return WrittenRun(f"{folder}/{seen.name}.csv", kind, len(t), float(t[-1] - t[0]))


def _self_contained(recipe: Recipe, work: Path) -> dict[str, Any]:
    """The recipe's document with the arm written out; the files it reads lie in motions/, a model that is the truth in truth/."""
    motions = [dict(m) for m in recipe.document["motions"]]
    for motion, document in zip(recipe.motions, motions, strict=True):
        for key, path in motion.files(recipe.folder).items() if isinstance(motion, TimedMotion) else ():
            document[key] = f"motions/{motion.name}{path.suffix}"
            (work / "motions").mkdir(exist_ok=True)
            shutil.copyfile(path, work / document[key])
    truth: dict[str, Any] = {}
    if recipe.settings.truth is None:
        truth = {"arm": recipe.arm.document()}
    elif isinstance(recipe.settings.truth, str):
        truth = {"truth": "truth"}
        shutil.copytree(recipe.folder / recipe.settings.truth, work / "truth")
    return {**recipe.document, **truth, "seed": recipe.settings.seed, "motions": motions}


def _versions() -> dict[str, str]:
    """Versions of the programs on which the bytes of a campaign depend."""
    import platform
    from importlib.metadata import version

    import nnhydro

    return {"nnhydro": nnhydro.__version__, "python": platform.python_version(), **{k: version(k) for k in ("numpy", "scipy", "torch")}}


def write_campaign(recipe: Recipe, out: Path) -> tuple[WrittenRun, ...]:
    """Write the campaign of `recipe` to the folder `out` and return what was made.

    An existing `out` is replaced whole if it is empty or was made by a recipe, and refused otherwise (ConfigError).
    """
    kinds = {motion.name: str(getattr(motion, "kind", "")) for motion in recipe.motions}
    hidden = set(recipe.settings.unseen)
    require(bool(set(kinds) - hidden), "unseen: names every motion, so that no recording is left: leave one out")
    with whole_folder(out, MARKER) as work:
        made = tuple(_write(work, seen, kinds[seen.name], seen.name in hidden) for seen in record_runs(recipe))
        write_text(work / "arm.yaml", yaml.safe_dump(recipe.arm.document(), sort_keys=False, allow_unicode=True))
        write_text(work / "recipe.yaml", yaml.safe_dump(_self_contained(recipe, work), sort_keys=False, allow_unicode=True))
        write_json(work / MARKER, {"schema": recipe.settings.schema_, "name": recipe.settings.name, "seed": recipe.settings.seed,
                                   "versions": _versions(), "files": {recording.file: recording.rows for recording in made}})
    return made
