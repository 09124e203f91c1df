"""`nnhydro train`: train a network or a hybrid on a campaign; Ctrl-C stops it, --resume goes on."""

from pathlib import Path

import typer

from nnhydro.report.screen import JSON, MAP, emit, note, say


def train(
    campaign: Path = typer.Argument(help="Folder of the campaign."),
    out: Path = typer.Option(..., "--out", help="Folder to write the model to."),
    config: Path | None = typer.Option(None, "--config", help="TOML file with the choices; the defaults are the benchmark's."),
    resume: bool = typer.Option(False, "--resume", help="Go on from where an interrupted training stopped."),
    column_map: Path | None = MAP,
    json: bool = JSON,
) -> None:
    """Train a network or a hybrid on all recordings; a share of them is only watched, for early stopping."""
    from nnhydro.errors import ConfigError, require
    from nnhydro.files import json_text
    from nnhydro.identification.config import TrainingConfig, read_config
    from nnhydro.identification.train import train as fit
    from nnhydro.models.storage import save_model
    from nnhydro.recordings.campaign import verified

    chosen = read_config(config) if config is not None else TrainingConfig()
    opened = verified(campaign, column_map)
    checkpoint, told = out.with_name(f"{out.name}.checkpoint.safetensors"), out.with_name(f"{out.name}.checkpoint.json")
    identity = json_text({"config": chosen.model_dump(mode="json"), "campaign_sha256": opened.sha256()})
    if resume:
        require(checkpoint.exists(), f"--resume: {checkpoint} does not exist: no interrupted training to go on with; leave --resume out")
        require(told.exists() and told.read_text(encoding="utf-8") == identity, f"--resume: {told} belongs to another configuration or to "
                "other recordings: start anew without --resume", ConfigError)
    else:
        checkpoint.unlink(missing_ok=True)
        out.parent.mkdir(parents=True, exist_ok=True)
        told.write_text(identity, encoding="utf-8")

    def progress(epoch: int, epochs: int, error: float) -> None:
        if epoch % max(1, epochs // 20) == 0:
            note(f"epoch {epoch}/{epochs}: validation error {error:.3g}")

    try:
        model = fit(opened, chosen, checkpoint, progress)
    except KeyboardInterrupt:
        note(f"stopped; go on with: nnhydro train {campaign} --out {out} --resume" + (f" --config {config}" if config else ""))
        raise
    save_model(model, out)
    checkpoint.unlink(missing_ok=True)
    told.unlink(missing_ok=True)
    if json:
        emit({"model": str(out), **model.fit})
        return
    say(f"{model.name}: {model.fit['epochs']} epochs, best at {', '.join(f'{e:g}' for e in model.fit['best_epoch'])} (one a member).")
    say(f"Model: {out}")
    say(f"Next: nnhydro predict {out} {campaign}/unseen/*.csv --out torques")
