"""What a diagnosis leaves on disk: diagnosis.json, report.html, figures, the corrected model and the baseline, whole or not at all."""

from pathlib import Path

from nnhydro.diagnosis.result import NEXT, Diagnosis
from nnhydro.models.storage import save_model
from nnhydro.recordings.campaign import Campaign
from nnhydro.report.diagnosis.figures import diagnosis_figures, laws_of
from nnhydro.report.diagnosis.page import diagnosis_page
from nnhydro.report.diagnosis.unexplained_law import unknown_laws
from nnhydro.report.widgets.trace import diagnosis_traces
from nnhydro.runtime.files import json_text, whole_folder

RESULT = "diagnosis.json"
SHOWN = ("", ".json", ".html", ".png")  # what is worth a line: folders, and of each figure the picture


def write_diagnosis(result: Diagnosis, campaign: Campaign, out: Path) -> list[Path]:
    """Write the diagnosis to the folder `out` and return the paths of its parts."""
    document = result.document()
    with whole_folder(out, RESULT) as work:
        (work / RESULT).write_text(json_text(document), encoding="utf-8")
        save_model(result.corrected, work / "model")
        save_model(result.baseline, work / "baseline")
        if result.following is not None:
            result.following.write(work / NEXT)
        traces = diagnosis_traces(campaign, result.baseline, result.corrected)
        laws = laws_of(result, traces)
        unnamed = unknown_laws(result)
        page = diagnosis_page(document, result.verdict(), campaign, traces, laws, unnamed)
        (work / "report.html").write_text(page, encoding="utf-8")
        figures = [path.name for path in diagnosis_figures(result, traces, laws, work, unnamed)]
    following = [NEXT] if result.following is not None else []
    return [out / name for name in (RESULT, "report.html", "model", "baseline", *figures, *following)]
