"""`nnhydro demo`: the main job on the campaigns that ship with the package, offline."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from nnhydro.cli.terminal.output import JSON, QUIET, conclude, emit, note, show

if TYPE_CHECKING:
    from nnhydro.diagnosis.result import DiagnosisResult
    from nnhydro.evaluation.benchmark_result import BenchmarkResult

Json = dict[str, Any]


def demo(
    out: Path = typer.Option(Path("nnhydro_demo"), "--out", help="Folder for the results."),
    seed: int = typer.Option(0, "--seed", help="Seed of folds, networks and bootstraps."),
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Run the whole task on two campaigns that ship with nnhydro.

    Trains a network and a hybrid, and compares them with the physics on recordings held out of every fit. Then finds the effect that is
    hidden in a second campaign.
    """
    from nnhydro.cli.terminal.output import print_benchmark
    from nnhydro.diagnosis.findings.sheets import parameters_sheet
    from nnhydro.report.diagnosis.page import SHOWN
    from nnhydro.report.diagnosis.tables import findings_sheet, location_sheet

    result, paths = _compare(out, seed)
    if not json:
        print_benchmark(result, [path for path in paths if path.suffix not in (".svg", ".csv") or path.parent.name == "torques"], "")
    found, score, answer, written = _diagnose(out / "diagnosis", seed)
    diagnosis = found.document()
    if json:
        emit({**result.document(), "verdict": result.verdict(), "diagnosis": {**diagnosis, "verdict": found.verdict()},
              "score": score, "written": [str(path) for path in (*paths, *written)]})
        return
    for sheet in (findings_sheet(diagnosis), parameters_sheet(diagnosis["findings"]), location_sheet(diagnosis)):
        if len(sheet):
            show(sheet)
    conclude(found.verdict(), [path for path in written if path.suffix in SHOWN])
    conclude(_open_answer(answer, score), following="nnhydro check MY_CAMPAIGN   (your own folder of recordings), then nnhydro benchmark "
             "MY_CAMPAIGN --out RESULTS and nnhydro diagnose MY_CAMPAIGN --out FOUND")


def _compare(out: Path, seed: int) -> tuple["BenchmarkResult", list[Path]]:
    """Train and compare; return the benchmark and the files written."""
    from nnhydro.cli.terminal.progress import steps_on_screen
    from nnhydro.demo import CAMPAIGN, EXPECTED, FOLDS, MEMBERS
    from nnhydro.evaluation.benchmark import BenchmarkOptions
    from nnhydro.evaluation.entries import default_names
    from nnhydro.fitting.config import TrainingConfig
    from nnhydro.fitting.network.train import train
    from nnhydro.models.prediction import predict, write_prediction
    from nnhydro.models.storage import save_model
    from nnhydro.recordings.campaign import open_campaign
    from nnhydro.recordings.readers.files import read_recording
    from nnhydro.report.benchmark.page import write_benchmark

    campaign = open_campaign(CAMPAIGN)
    note(f"Reading {EXPECTED}.")
    config = TrainingConfig(seed=seed, members=MEMBERS)
    with steps_on_screen(FOLDS * len(default_names(campaign.arm))) as report:
        result = BenchmarkOptions((), FOLDS, seed, config).benchmark(campaign, report)
    paths = write_benchmark(result, out / "benchmark")
    note("training the hybrid on all recordings")
    model = train(campaign, config)
    paths.append(save_model(model, out / "hybrid"))
    for file in sorted((CAMPAIGN / "unseen").glob("*.csv")):
        prediction = predict(model, read_recording(file, campaign.arm, torque=False))
        paths.append(write_prediction(prediction, out / "torques" / file.name))
    return result, paths


def _diagnose(out: Path, seed: int) -> tuple["DiagnosisResult", Json, Json, list[Path]]:
    """Diagnose the concealed campaign, and only then open its answer; return diagnosis, its score, the answer and the files written."""
    from nnhydro.blind_tests.reveal import read_suite, reveal
    from nnhydro.blind_tests.seal import KEY_FILE, open_sealed, read_key
    from nnhydro.cli.terminal.progress import steps_on_screen
    from nnhydro.demo import CONCEALED, CONCEALED_EXPECTED, CONCEALED_NAME
    from nnhydro.diagnosis.diagnose import diagnose
    from nnhydro.recordings.campaign import verify_campaign
    from nnhydro.report.diagnosis.page import write_diagnosis

    note(f"Reading {CONCEALED_EXPECTED}.")
    public, campaign = read_suite(CONCEALED)[CONCEALED_NAME], verify_campaign(CONCEALED / CONCEALED_NAME)
    with steps_on_screen() as report:
        found = diagnose(campaign, public["baseline"], seed, progress=report)
    paths = write_diagnosis(found, campaign, out / CONCEALED_NAME)
    (score,) = reveal(CONCEALED, out)["campaigns"]
    sealed = CONCEALED / "answers" / f"{CONCEALED_NAME}.sealed"
    return found, score, open_sealed(sealed, read_key(CONCEALED / KEY_FILE), public["commitment"]), paths


def _open_answer(answer: Json, score: Json) -> str:
    """Return what was hidden and whether the diagnosis was right, in words."""
    (hidden,) = answer["effects"]
    numbers = ", ".join(f"{name} {p['value']:.4g} {p['unit']}" for name, p in hidden["parameters"].items())
    named = ", ".join(score["named"]) or "nothing"
    verdict = "was right" if score["right"] and score["joint"] else f"was wrong (it named {named})"
    text = f"The sealed answer, opened only now: {hidden['effect']} at joint {hidden['joint']}, {numbers}. The diagnosis {verdict}."
    if score["error_before"] is None or score["error_after"] is None:
        return text
    truth = score["error_true"]
    known = "" if truth is None else f" From the recorded motions, the true model itself has {100 * truth:.1f} %."
    return (f"{text} On unseen motions, the corrected model has an error of {100 * score['error_after']:.1f} %, "
            f"the baseline {100 * score['error_before']:.1f} %.{known}")
