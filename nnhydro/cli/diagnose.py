"""`nnhydro diagnose`: what the baseline omits."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from nnhydro.cli.terminal.output import (
    BACKEND,
    CUTOFF,
    JOBS,
    JSON,
    MAP,
    QUIET,
    SCHEDULER,
    conclude,
    emit,
    note,
    note_folders_without_arm,
    say,
    shell_words,
    show,
    table,
    use_of,
    warn_of_errors,
)

if TYPE_CHECKING:
    from nnhydro.diagnosis.result import DiagnosisResult
    from nnhydro.recordings.campaign import Campaign
    from nnhydro.report.diagnosis.batch import BatchOutcome, DiagnosisRequest
    from nnhydro.runtime.workers import Workers


def _links(outcome: "BatchOutcome") -> list[str]:
    """Slenderness of the links and the coefficients of the calibrated baseline, link by link: how drag follows L/D from arm to arm."""
    from nnhydro.recordings.arm import read_arm
    from nnhydro.recordings.campaign import arm_file

    found = {} if outcome.document is None else outcome.document["recalibrated"]
    described = arm_file(outcome.asked.campaign) or outcome.asked.campaign / "arm.yaml"
    slender = [] if outcome.document is None else [link.length_m / link.diameter_m for link in read_arm(described).links]
    return [", ".join(f"{x:.3g}" for x in values) for values in (slender, found.get("cd", []), found.get("cm", []))]


def _many(asked: "list[DiagnosisRequest]", workers: "Workers", json: bool) -> None:
    """Diagnose several campaigns; failures are reported at the end, when all others are done."""
    from nnhydro.errors import CampaignError, count_text
    from nnhydro.report.diagnosis.batch import diagnose_all

    outcomes = []
    for outcome in diagnose_all(asked, workers):
        outcomes.append(outcome)
        note(f"{len(outcomes)} of {len(asked)}: {outcome.asked.campaign.name}: {outcome.verdict}")
    if json:
        emit({"campaigns": {outcome.asked.campaign.name: outcome.document for outcome in outcomes}})
    else:
        rows = [[outcome.asked.campaign.name, *_links(outcome), outcome.verdict] for outcome in outcomes]
        table("Campaigns", ["campaign", "L/D", "C_D", "C_M", "verdict"], rows, (True,) * 5)
    failed = [f"{outcome.asked.campaign}: {outcome.verdict}" for outcome in outcomes if outcome.document is None]
    if failed:
        raise CampaignError(f"{len(failed)} of {count_text(len(outcomes), 'campaign')} could not be diagnosed; the first: {failed[0]}")
    if not json:
        conclude(f"{count_text(len(outcomes), 'campaign')} diagnosed.", [asked[0].out.parent])


def warn_of_seen(baseline: str, campaign: "Campaign") -> None:
    """Say which of the recordings a baseline that is not fitted anew has seen: its error on these is no prediction."""
    from nnhydro.models.seen import seen_names
    from nnhydro.models.storage import MODEL, load_model
    from nnhydro.models.strip_theory import StripTheory

    if not baseline or not (Path(baseline) / MODEL).is_file():
        return
    model = load_model(Path(baseline))
    if isinstance(model, StripTheory) and not model.instruments and model.loads.linear():  # fitted anew to each fold
        return
    seen = seen_names(model, campaign)
    if seen is None:
        note(f"warning: --baseline {baseline} does not say which recordings it has seen: its errors here may be those of its own fit")
    elif seen:
        note(f"warning: --baseline {baseline} has seen {len(seen)} of the {len(campaign.names)} recordings here ({', '.join(seen[:4])}"
             f"{', ...' if len(seen) > 4 else ''}): its errors on these are those of its own fit")


def next_steps(result: "DiagnosisResult", out: Path, campaign: Path, column_map: Path | None) -> str:
    """What comes next: the motion that would settle the matter, what these motions can reveal, a hybrid for what has no name, else use."""
    from nnhydro.diagnosis.experiment.proposal import POOR_CHANCE
    from nnhydro.diagnosis.problem.impossible_coefficients import MOST_LEFT
    from nnhydro.diagnosis.result import NEXT

    folder = shell_words(campaign, column_map)
    if result.following is not None and result.following.chance >= POOR_CHANCE:
        return (f"record the motion in {out / NEXT}, put it into {campaign / 'recordings'}, then nnhydro diagnose {folder} "
                f"--out {shell_words(out)}")
    if not result.detected and not result.findings and result.noise_floor > MOST_LEFT:
        return f"nnhydro power {folder}   (what these motions could reveal)"
    if result.detected and (result.remainder.detected or not result.findings):
        if not result.heldout.driven:
            return f"open {out / 'report.html'}: it shows where the residual lies   (without a torque no model can be trained)"
        return (f"nnhydro train {folder} --out my_model   (a hybrid learns what has no name; {out / 'report.html'} shows where it lies; "
                f"baseline = '{out / 'model'}' in its --config keeps what was found)")
    return use_of(out / "model", campaign, column_map)


def _print(result: "DiagnosisResult", paths: list[Path], then: str) -> None:
    """Print tables, verdict, the files written, and what comes next."""
    from nnhydro.diagnosis.findings.sheets import parameters_sheet
    from nnhydro.report.diagnosis.page import SHOWN
    from nnhydro.report.diagnosis.tables import findings_sheet, location_sheet

    document = result.document()
    for sheet in (findings_sheet(document), parameters_sheet(document["findings"]), location_sheet(document)):
        if len(sheet):
            show(sheet)
    if "+-" in result.verdict():
        say("+- is half of the 95 % interval.")
    conclude(result.verdict(), [path for path in paths if path.suffix in SHOWN], then)


def diagnose(
    campaign: Path = typer.Argument(help="Folder of the campaign, or of several campaigns, which are diagnosed one by one."),
    out: Path = typer.Option(..., "--out", help="Folder for diagnosis.json, report.html, figures, model/ and baseline/."),
    baseline: str = typer.Option("", "--baseline", help="Name of a physics model, folder of a model, or column, which takes "
                                 "tau*_sim_Nm of the recordings; default: constant, or rigid for a dry arm."),
    effects: Path | None = typer.Option(None, "--effects", help="Python file with your own effects."),
    cutoff: float | None = CUTOFF,
    seed: int = typer.Option(0, "--seed", help="Random seed of the subset of recordings and of the simulated "
                             "campaigns that set the threshold."),
    rehearse: int = typer.Option(0, "--rehearse", min=0, max=1000, help="Calibrate the confidence by simulation: inject each finding and "
                                 "its rivals N times into these motions, and repeat the diagnosis."),
    limits: Path | None = typer.Option(None, "--limits", help="YAML file with what the rig can do (q_rad, dq_rad_s, ddq_rad_s2, u0_m_s, "
                                       "tau_Nm, seconds), for the motion to record next; by default the ranges of the recordings."),
    column_map: Path | None = MAP,
    jobs: int = JOBS,
    backend: str = BACKEND,
    scheduler: str = SCHEDULER,
    quiet: bool = QUIET,
    json: bool = JSON,
) -> None:
    """Find the physics that a model omits.

    Says whether model and recordings differ, and where. Names the missing effect, its size, and the error of the corrected model.
    """
    from nnhydro.cli.terminal.progress import steps_on_screen
    from nnhydro.diagnosis.diagnose import DiagnosisOptions
    from nnhydro.diagnosis.experiment.rig_limits import read_limits
    from nnhydro.effects.plugin import load_plugin
    from nnhydro.recordings.campaign import inner_campaigns, verify_campaign
    from nnhydro.report.diagnosis.page import RESULT, write_diagnosis
    from nnhydro.runtime.files import check_folder
    from nnhydro.runtime.workers import Workers

    workers = Workers(jobs, backend, scheduler)
    options = DiagnosisOptions(baseline or None, seed, cutoff, (), rehearse, None if limits is None else read_limits(limits))
    inside = inner_campaigns(campaign)
    for folder in (out / inner.name for inner in inside):
        check_folder(folder, RESULT)
    if inside:
        from nnhydro.report.diagnosis.batch import DiagnosisRequest

        note_folders_without_arm(campaign)
        _many([DiagnosisRequest(inner, out / inner.name, options, effects, column_map) for inner in inside], workers, json)
        return
    check_folder(out, RESULT)
    if not workers.alone:
        note("one campaign runs in one process: --jobs and --backend distribute several campaigns")
    if effects is not None:
        load_plugin(effects)
    opened = verify_campaign(campaign, column_map)
    unusable = warn_of_errors(opened)
    warn_of_seen(baseline, opened)
    with steps_on_screen() as report:
        result = options.diagnose(opened, report)
    paths = write_diagnosis(result, opened, out)
    if json:
        emit(result.document())
        return
    check_first = f"nnhydro check {shell_words(campaign, column_map)}   (it names what to correct)"
    doubtful = unusable or result.checks.get("denied_channels")
    _print(result, paths, check_first if doubtful else next_steps(result, out, campaign, column_map))
