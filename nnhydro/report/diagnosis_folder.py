"""What a diagnosis leaves on disk: diagnosis.json, report.html, the corrected model and the calibrated baseline, whole or not at all."""

from pathlib import Path

from nnhydro.diagnosis.result import NEXT, Diagnosis
from nnhydro.files import json_text, whole_folder
from nnhydro.models.storage import save_model
from nnhydro.recordings.campaign import Campaign
from nnhydro.report.page.diagnosis import diagnosis_page

RESULT = "diagnosis.json"


def write_diagnosis(result: Diagnosis, campaign: Campaign, out: Path) -> list[Path]:
    """Write the diagnosis to the folder `out` and return the paths of its parts."""
    document = result.document()
    with whole_folder(out, RESULT) as work:
        (work / RESULT).write_text(json_text(document), encoding="utf-8")
        save_model(result.corrected, work / "model")
        save_model(result.baseline, work / "baseline")
        if result.following is not None:
            result.following.write(work / NEXT)
        page = diagnosis_page(document, result.verdict(), result.baseline, result.corrected, campaign)
        (work / "report.html").write_text(page, encoding="utf-8")
    return [out / name for name in (RESULT, "report.html", "model", "baseline", *([NEXT] if result.following is not None else []))]
