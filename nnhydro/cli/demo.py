"""`nnhydro demo`: the main job on the campaign that ships with the package, offline."""

from pathlib import Path

import typer

from nnhydro.report.screen import JSON, QUIET, emit, note


def demo(
    out: Path = typer.Option(Path("nnhydro_demo"), "--out", help="Folder for the results."),
    seed: int = typer.Option(0, "--seed", help="Seed of folds and networks."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Train a network and a hybrid on a small tow-tank campaign and compare them with the physics on recordings held out of every fit."""
    from nnhydro.demo import CAMPAIGN, EXPECTED, FOLDS
    from nnhydro.evaluation.benchmark import benchmark
    from nnhydro.evaluation.contenders import default_names
    from nnhydro.identification.config import TrainingConfig
    from nnhydro.identification.train import train
    from nnhydro.models.prediction import predict
    from nnhydro.models.prediction_file import write_prediction
    from nnhydro.models.storage import save_model
    from nnhydro.recordings.campaign import open_campaign
    from nnhydro.recordings.readers.files import read_recording
    from nnhydro.report.benchmark_folder import write_benchmark
    from nnhydro.report.benchmark_table import print_benchmark
    from nnhydro.report.progress import steps_on_screen

    campaign = open_campaign(CAMPAIGN)
    note(f"Reading {EXPECTED}.")
    config = TrainingConfig(seed=seed)
    with steps_on_screen(FOLDS * len(default_names(campaign.arm))) as report:
        result = benchmark(campaign, (), FOLDS, seed, config, report)
    paths = write_benchmark(result, out / "benchmark")
    note("training the hybrid on all recordings")
    model = train(campaign, config)
    paths.append(save_model(model, out / "hybrid"))
    for file in sorted((CAMPAIGN / "unseen").glob("*.csv")):
        prediction = predict(model, read_recording(file, campaign.arm, torque=False))
        paths.append(write_prediction(prediction, out / "torques" / file.name))
    if json:
        emit({**result.document(), "verdict": result.verdict(), "written": [str(path) for path in paths]})
        return
    print_benchmark(result, [path for path in paths if path.suffix not in (".svg", ".csv") or path.parent.name == "torques"],
                    "nnhydro check MY_CAMPAIGN   (your own folder of recordings), then nnhydro benchmark MY_CAMPAIGN --out RESULTS")
