"""`nnhydro train`: train a network or a hybrid on a campaign; Ctrl-C stops it, --resume goes on."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from nnhydro.cli.terminal.output import (
    JSON,
    MAP,
    QUIET,
    conclude,
    emit,
    note,
    nothing_to_hold_out,
    say,
    shell_words,
    show,
    use_of,
    warn_of_errors,
    without_bulk,
)

if TYPE_CHECKING:
    from nnhydro.models.learned.learned import LearnedTorque


def _stoppable(work: Callable[[], "LearnedTorque"], again: str, checkpoint: Path, record: Path) -> "LearnedTorque":
    """Do `work`; where it is interrupted, say the command that goes on. Without a checkpoint, its record goes, too."""
    try:
        return work()
    except KeyboardInterrupt:
        note(f"stopped; go on with: {again} --resume" if checkpoint.exists() else
             f"stopped before the first checkpoint, so there is nothing to resume; start anew with: {again}")
        raise
    finally:
        if not checkpoint.exists():
            record.unlink(missing_ok=True)


def _is_identity(record: Path) -> bool:
    """Whether the file says which training a checkpoint beside it belongs to."""
    from nnhydro.errors import ConfigError
    from nnhydro.runtime.files import read_json

    try:
        return {"config", "campaign_sha256"} <= set(read_json(record, ConfigError))
    except ConfigError:
        return False


def _begin(resume: bool, out: Path, checkpoint: Path, record: Path, identity: dict[str, object]) -> None:
    """Make sure that a checkpoint belongs to this training, or that none is in the way of a new one."""
    from nnhydro.errors import ConfigError, require
    from nnhydro.runtime.files import json_text, write_json

    if resume:
        require(checkpoint.exists(), f"--resume: {checkpoint} does not exist: no interrupted training to continue: omit --resume")
        require(record.is_file() and record.read_bytes() == json_text(identity).encode(), f"--resume: {record} belongs to another "
                "configuration or to other recordings: start anew without --resume", ConfigError)
        return
    for path in (checkpoint, record) if not _is_identity(record) else ():
        require(not path.exists(), f"--out {out}: {path} lies where the training keeps its state, and no training wrote it: move it "
                "away, or name another place", ConfigError)
    checkpoint.unlink(missing_ok=True)
    write_json(record, identity)


def train(
    campaign: Path = typer.Argument(help="Folder of the campaign."),
    out: Path = typer.Option(..., "--out", help="Folder to write the model to."),
    config: Path | None = typer.Option(None, "--config", help="TOML file with training options; the defaults are those of benchmark."),
    resume: bool = typer.Option(False, "--resume", help="Continue an interrupted training."),
    tensorboard: Path | None = typer.Option(None, "--tensorboard", help="Folder for a TensorBoard log (extra: tensorboard)."),
    column_map: Path | None = MAP,
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Train a network or a hybrid on a campaign.

    Some of the recordings serve for early stopping only.
    """
    from contextlib import ExitStack

    from nnhydro.cli.terminal.progress import epochs_in_tensorboard, epochs_on_screen
    from nnhydro.dynamics.inertia_check import inertia_check
    from nnhydro.fitting.config import TrainingConfig, read_config
    from nnhydro.fitting.network.train import train as fit
    from nnhydro.models.storage import DIGEST, save_model
    from nnhydro.recordings.campaign import verify_campaign
    from nnhydro.report.models.parameter_sheet import model_sentence, parameter_sheet
    from nnhydro.runtime.files import check_folder
    from nnhydro.runtime.stamp import refuse_among_recordings, refuse_inputs
    from nnhydro.runtime.workers import keep_freed_memory

    keep_freed_memory()
    check_folder(out, DIGEST)
    if tensorboard is not None:
        refuse_among_recordings(tensorboard, "--tensorboard")
    chosen = read_config(config) if config is not None else TrainingConfig()
    refuse_inputs(out, [Path(chosen.baseline)])  # a model folder, perhaps
    opened = verify_campaign(campaign, column_map)
    unusable = warn_of_errors(opened)
    if nothing_to_hold_out(len(opened.names), len(opened.steady)):
        note("warning: one recording: none is left to watch for early stopping, and nothing tells whether what is learned holds for "
             "another: record more, or use nnhydro identify")
    checkpoint, record = out.with_name(f"{out.name}.checkpoint.safetensors"), out.with_name(f"{out.name}.checkpoint.json")
    _begin(resume, out, checkpoint, record, {"config": chosen.model_dump(mode="json"), "campaign_sha256": opened.sha256()})
    with ExitStack() as open_:
        listeners = [open_.enter_context(epochs_on_screen())]
        listeners += [] if tensorboard is None else [open_.enter_context(epochs_in_tensorboard(tensorboard))]

        def progress(epoch: int, epochs: int, error: float) -> None:
            for listen in listeners:
                listen(epoch, epochs, error)

        again = f"nnhydro train {shell_words(campaign, column_map)} --out {shell_words(out)}"
        options = {"--config": config, "--tensorboard": tensorboard}
        again += "".join(f" {name} {shell_words(path)}" for name, path in options.items() if path)
        model = _stoppable(lambda: fit(opened, chosen, checkpoint, progress), again, checkpoint, record)
    save_model(model, out)
    checkpoint.unlink(missing_ok=True)
    record.unlink(missing_ok=True)
    if json:
        emit({"model": str(out), **without_bulk(model.fit)})
        return
    show(parameter_sheet(model))
    if (checked := inertia_check(model)) is not None:
        say(checked.sentence())
    conclude(model_sentence(model), [out], f"nnhydro check {shell_words(campaign, column_map)}   (it names errors)" if unusable else
             use_of(out, campaign, column_map))
