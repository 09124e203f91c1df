"""The pages under test: a small benchmark, and a diagnosis whose document is written by hand, so that no search has to run."""

from dataclasses import replace

from campaigns import GIVEN, TINY, campaign, planted, recording, steady_table
from rigs import arm

import nnhydro
from nnhydro.models.strip_theory import StripTheory
from nnhydro.report.benchmark.page import benchmark_page
from nnhydro.report.diagnosis.page import diagnosis_page
from nnhydro.report.widgets.residual_map import residual_maps
from nnhydro.report.widgets.trace import BASELINE, CORRECTED, diagnosis_traces

HOSTILE = "<script>alert('arm')</script> & 'arm'"


def small_campaign(name):
    """Six runs, one of them with a name that HTML must not believe, and a steady table."""
    a = arm().model_copy(update={"name": name})
    runs = list(campaign(a, planted(a), count=5, noise=0.02).recordings())
    runs.append(recording(a, planted(a), "<img src=x onerror=alert(1)>", seed=9, noise=0.02))
    return nnhydro.Campaign.of(a, runs, (steady_table(a, planted(a), rows=30),))


def finding(effect, joint, confidence, alternatives=()):
    """One entry of diagnosis.json."""
    rivals = [{"effect": "buoyancy_tilt", "joint": None, "support": 0.02}, {"effect": "torque_bias", "joint": 2, "support": 0.1}]
    return {"effect": effect, "family": "restoring", "class": [effect, *alternatives], "joint": joint, "confidence": confidence,
            "statement": f"Joint {joint} is pulled back by 0.50 +- 0.03 N m/rad: {HOSTILE}.",
            "parameters": {"stiffness": {"value": 0.5, "unit": "N m/rad", "ci95": [0.44, 0.56]}},
            "heldout": {"error_before": 0.21, "error_after": 0.03}, "rivals": rivals}


def diagnosis_document(findings, detected=True):
    """What diagnosis.json holds."""
    location = [{"joint": 2, "share": 0.93, "where": "depends on q2_rad, most at 0.8 to 1.6", "conditions": {"q2_rad": [0.8, 1.6]},
                 "band_hz": [0.0, 1.0], "recordings": []}]
    return {"schema": "nnhydro/diagnosis/1", "baseline": "constant", "seconds": 8.1,
            "mismatch": {"detected": detected, "p_value": 0.001, "error": 0.21, "noise_floor": 0.012},
            "location": location if detected else [], "findings": findings, "indistinguishable": [],
            "unexplained": {"detected": False, "share": 0.02, "depends_on": []}, "recalibrated": {"cd": [0.98, 0.91], "cm": [0.83, 0.80]},
            "next_experiment": None, "versions": {"nnhydro": "0", "campaign_sha256": "0" * 64}}


def write_diagnosis_page(path, findings=None, detected=True):
    """Write the page of a diagnosis whose baseline lacks half of the drag of link 2."""
    c = small_campaign(HOSTILE)
    whole = StripTheory(c.arm, GIVEN, {}, "constant", planted(c.arm))
    drag = whole.loads.terms["normal_drag"]
    poor = replace(whole, loads=type(whole.loads)({**whole.loads.terms, "normal_drag": replace(drag, C_D=(drag.C_D[0], drag.C_D[1] / 2))}))
    told = [finding("umbilical_stiffness", 2, 0.97, ("torque_drift",))] if findings is None else findings
    traces = diagnosis_traces(c, poor, whole)
    maps = residual_maps(traces, [BASELINE, CORRECTED])
    page = diagnosis_page(diagnosis_document(told, detected), "Joint 2 is pulled back.", c, traces, maps)
    path.write_text(page, encoding="utf-8")
    return path


def write_benchmark_page(path):
    """Write the page of a benchmark of physics and a tiny network."""
    result = nnhydro.benchmark(small_campaign("test arm"), ["textbook", "constant", "network"], folds=2, config=TINY).result
    path.write_text(benchmark_page(result), encoding="utf-8")
    return path
