"""The page of a diagnosis: the verdict first, then findings and their rivals, where, the curves, what remains."""

from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

from markupsafe import Markup

from nnhydro.diagnosis.findings.sheets import place, rivals_sheet
from nnhydro.diagnosis.result import NEXT, DiagnosisResult
from nnhydro.models.storage import save_model
from nnhydro.recordings.campaign import Campaign
from nnhydro.report.diagnosis.figures import FOUND, UNNAMED, diagnosis_figures, law_figure, laws_of
from nnhydro.report.diagnosis.finding_law import DrawnLaw
from nnhydro.report.diagnosis.tables import errors_sheet, location_sheet, nearest_sheet, recalibrated_sheet
from nnhydro.report.diagnosis.unexplained_law import unknown_laws
from nnhydro.report.figure_file import page_figure
from nnhydro.report.widgets.history import histories
from nnhydro.report.widgets.render import render
from nnhydro.report.widgets.residual_map import ResidualMap, largest, residual_maps
from nnhydro.report.widgets.svg import bars, intervals
from nnhydro.report.widgets.trace import BASELINE, CORRECTED, Trace, by_change, diagnosis_traces
from nnhydro.runtime.files import json_text, whole_folder
from nnhydro.sheet import Sheet

Document = dict[str, Any]
LEAST_WEIGHT = 0.005  # weight of a rival that is drawn; the table has all


def _finding(f: Document, law: DrawnLaw | None) -> tuple[Document, Markup | None, Markup | None, Markup | None, Sheet]:
    """The finding, the chart of its law, of its numbers, of its rivals and what these leave, and the rivals as a sheet."""
    numbers = [(name, p["value"], (p["ci95"][0], p["ci95"][1]), p["unit"]) for name, p in f["parameters"].items()]
    rows = [(f"{r['effect']} ({place(r.get('joint'))})", r["support"]) for r in f["rivals"] if r["support"] >= LEAST_WEIGHT]
    left = max(1.0 - sum(r["support"] for r in f["rivals"]), 0.0)
    chart = intervals(f"Parameters of {f['effect']} with 95 % intervals", numbers) if numbers else None
    rivals = bars(f"Weight of {f['effect']} and of its rivals", [(f"{f['effect']} or unlisted", left), *rows]) if rows else None
    title = "" if law is None else f"Torque of {f['effect']} at joint {law.joint} over {law.driver}"
    return f, None if law is None else page_figure(law_figure([("", law)], FOUND), title), chart, rivals, rivals_sheet(f)


def _rest(document: Document) -> str:
    """What is left, in words."""
    left = document["unexplained"]
    if not left["detected"]:
        return "These recordings cannot distinguish the residual from noise."
    on = ", ".join(str(x) for x in left.get("depends_on") or [])
    return "A systematic residual remains that no effect of the catalogue explains" + (f"; it depends on {on}." if on else ".")


def _next(experiment: Any) -> str:
    return "" if experiment is None else f"{experiment['statement']} The file {experiment['file']} holds this motion, ready to run."


def diagnosis_page(document: Document, verdict: str, campaign: Campaign, traces: Sequence[Trace], maps: Sequence[ResidualMap],
                   laws: Sequence[DrawnLaw | None] = (), unnamed: Sequence[DrawnLaw] = ()) -> str:
    """Return the page as HTML text; `document` is what diagnosis.json holds, `traces` and `maps` are the campaign's.

    `laws` are those of the findings, `unnamed` those of what no finding explains.
    """
    styles = {CORRECTED: 0, BASELINE: 1} if document["findings"] else {BASELINE: 1}
    errors = errors_sheet(document)
    return render(
        "diagnosis.html", arm=campaign.arm.name, verdict=verdict, d=document, styles=styles,
        ladder=list(zip(errors.columns[0].values, errors.columns[1].values, strict=True)),
        findings=[_finding(f, law) for f, law in zip_longest(document["findings"], laws)], location=location_sheet(document), maps=maps,
        heat=largest(maps),
        shown=len({trace.recording for trace in traces if not trace.segment.steady}), of=len(campaign.names),
        first=document["location"][0]["joint"] if document["location"] else 1,
        histories=histories(by_change(traces), styles, list(styles)), shown_first=list(styles), rest=_rest(document),
        unnamed=[(law.joint, law.driver, page_figure(law_figure([("", law)], UNNAMED), f"Residual of joint {law.joint} over {law.driver}"))
                 for law in unnamed],
        near=nearest_sheet(document),
        recalibrated=recalibrated_sheet(document),
        next=_next(document.get("next_experiment")))


RESULT = "diagnosis.json"
SHOWN = ("", ".json", ".html", ".png")  # what is worth a line: folders, and of each figure the picture


def write_diagnosis(result: DiagnosisResult, campaign: Campaign, out: Path) -> list[Path]:
    """Write the diagnosis to the folder `out` and return the paths of its parts."""
    document = result.document()
    with whole_folder(out, RESULT) as work:
        (work / RESULT).write_text(json_text(document), encoding="utf-8")
        save_model(result.corrected, work / "model")
        save_model(result.baseline, work / "baseline")
        if result.following is not None:
            result.following.write(work / NEXT)
        traces = diagnosis_traces(campaign, result.baseline, result.corrected)
        maps = residual_maps(traces, [BASELINE, CORRECTED] if result.findings else [BASELINE])
        laws = laws_of(result, traces)
        unnamed = unknown_laws(result)
        page = diagnosis_page(document, result.verdict(), campaign, traces, maps, laws, unnamed)
        (work / "report.html").write_text(page, encoding="utf-8")
        figures = [path.name for path in diagnosis_figures(result, traces, maps, laws, work, unnamed)]
    following = [NEXT] if result.following is not None else []
    return [out / name for name in (RESULT, "report.html", "model", "baseline", *figures, *following)]
