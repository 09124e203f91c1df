"""`nnhydro benchmark`: all models on the same held-out recordings."""

from pathlib import Path

import typer

from nnhydro.cli.terminal.output import BACKEND, CUTOFF, JOBS, JSON, MAP, QUIET, SCHEDULER, emit, shell_words, warn_of_errors


def benchmark(
    campaign: Path = typer.Argument(help="Folder of the campaign, or of several campaigns, each with its own arm.yaml."),
    out: Path = typer.Option(..., "--out", help="Folder for benchmark.json and the plots."),
    models: str = typer.Option("", "--models", help="Comma-separated: baselines, network, hybrid, gp, boosted-trees, "
                               "mlp-raw, model folders; or all."),
    protocol: str = typer.Option("leave-recordings-out", "--protocol", help="leave-recordings-out, leave-speed-range-out, "
                                 "leave-angle-sector-out, leave-kind-out, leave-arm-out or learning-curve."),
    folds: int = typer.Option(5, "--folds", min=2, help="Number of folds; each recording is held out once."),
    config: Path | None = typer.Option(None, "--config", help="TOML file with the training options of networks."),
    cutoff: float | None = CUTOFF,
    seed: int | None = typer.Option(None, "--seed", help="Seed of folds, networks and intervals; by default that of --config, or 0."),
    column_map: Path | None = MAP,
    jobs: int = JOBS,
    backend: str = BACKEND,
    scheduler: str = SCHEDULER,
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Compare models on recordings held out of their fits.

    Every model is fitted to some recordings and tested on the others; the protocol says which are held out.
    """
    from nnhydro.cli.terminal.output import note_folders_without_arm, print_benchmark
    from nnhydro.cli.terminal.progress import steps_on_screen
    from nnhydro.evaluation.benchmark import BenchmarkOptions
    from nnhydro.evaluation.entries import default_names
    from nnhydro.evaluation.protocols.protocol import DEFAULT
    from nnhydro.fitting.config import TrainingConfig, read_config
    from nnhydro.recordings.campaign import open_campaigns
    from nnhydro.report.benchmark.page import RESULT, SHOWN, write_benchmark
    from nnhydro.runtime.files import check_folder
    from nnhydro.runtime.workers import Workers, keep_freed_memory

    workers = Workers(jobs, backend, scheduler)
    keep_freed_memory()
    check_folder(out, RESULT)
    given = {"seed": seed, "cutoff_hz": cutoff}
    chosen = read_config(config) if config is not None else TrainingConfig()
    chosen = chosen.model_copy(update={key: value for key, value in given.items() if value is not None})
    names = [name.strip() for name in models.split(",") if name.strip()]
    campaigns = open_campaigns(campaign, column_map)
    note_folders_without_arm(campaign)
    for opened in campaigns:
        opened.verify()
    unusable = [warn_of_errors(opened) for opened in campaigns]
    options = BenchmarkOptions(names, folds, chosen.seed, chosen, protocol)
    total = folds * len(names or default_names(campaigns[0].arm)) if protocol == DEFAULT and names != ["all"] else None
    with steps_on_screen(total) as report:
        result = options.benchmark(campaigns, report, workers)
    paths = write_benchmark(result, out)
    if json:
        emit(result.document())
        return
    folder = shell_words(campaign, column_map)
    print_benchmark(result, [path for path in paths if path.suffix in SHOWN],
                    f"nnhydro check {folder}   (it names errors)" if any(unusable) else result.following(folder))
