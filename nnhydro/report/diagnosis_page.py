"""The diagnosis as one self-contained page: the verdict first, then where, why this and not its rivals, the curves, what remains."""

from base64 import b64encode
from html import escape
from io import BytesIO

import numpy as np

from nnhydro.diagnosis.result import Diagnosis
from nnhydro.evaluation.benchmark import modelled
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.segment import Segment
from nnhydro.report.torque_panels import draw_joint_panels, new_figure

STYLE = """
:root { color-scheme: light dark; --ink: #1b1b1b; --paper: #ffffff; --soft: #5a5a5a; --line: #d0d0d0; }
@media (prefers-color-scheme: dark) {
:root { --ink: #e8e8e8; --paper: #161616; --soft: #a8a8a8; --line: #444; } img { background: #fff } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 60rem;
 margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.4rem } h2 { font-size: 1.1rem; margin-top: 2rem; border-bottom: 1px solid var(--line) }
.verdict { font-size: 1.15rem; border-left: .4rem solid var(--ink); padding: .2rem 1rem }
table { border-collapse: collapse } td, th { text-align: left; padding: .25rem .8rem .25rem 0; border-bottom: 1px solid var(--line);
vertical-align: top } img { max-width: 100% } .soft { color: var(--soft) }
@media print { body { margin: 0; max-width: none } h2 { break-after: avoid } img, table { break-inside: avoid } }
"""


def _table(head: list[str], rows: list[list[str]]) -> str:
    cells = "".join(f"<th scope=col>{escape(name)}</th>" for name in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"


def _telling(result: Diagnosis, campaign: Campaign) -> Segment | None:
    """The longest segment of the recording on which the correction changes most, relative to its torque."""
    best: tuple[float, Segment] | None = None
    for name in campaign.names:
        for segment in campaign.segments(name, result.baseline.preparation):
            if segment.tau is None or not segment.keep.any():
                continue
            change = modelled(result.corrected, segment) - modelled(result.baseline, segment)
            gain = float(np.abs(change[segment.keep]).sum())
            if best is None or gain > best[0]:
                best = (gain, segment)
    return None if best is None else best[1]


def _picture(result: Diagnosis, segment: Segment) -> str:
    figure = new_figure(9.0, 2.6 * segment.n_links + 1.0)
    lines = {"corrected": modelled(result.corrected, segment), "baseline": modelled(result.baseline, segment)}
    draw_joint_panels(figure, segment, lines)
    data = BytesIO()
    figure.savefig(data, dpi=110, format="png")
    return f'<img alt="Measured, baseline and corrected torque of {escape(segment.recording)}" src="data:image/png;base64,' \
           f'{b64encode(data.getvalue()).decode()}">'


def _findings(result: Diagnosis) -> str:
    parts = []
    for f in result.document()["findings"]:
        family = f["family"] or "several families"
        alike = ", ".join(f["class"][1:])
        doubt = f", cannot be told from {escape(alike)}" if alike else ""
        errors = "without it {error_before:.1%}, with it {error_after:.1%}".format(**f["heldout"])
        parts.append(f"<h3>{escape(f['statement'])}</h3><p class=soft>{escape(f['effect'])} ({escape(family)}), confidence "
                     f"{f['confidence']:.2f}{doubt}. Error on left-out recordings {errors}.</p>")
        parts.append(_table(["number", "value", "95 % interval", "unit"], [
            [name, f"{p['value']:.4g}", f"{p['ci95'][0]:.4g} to {p['ci95'][1]:.4g}", p["unit"]] for name, p in f["parameters"].items()]))
        parts.append("<p>What could take its place, and how much speaks for it:</p>" + _table(
            ["rival", "joint", "weight"], [[r["effect"], str(r["joint"] or "arm"), f"{r['support']:.3f}"] for r in f["rivals"]]))
    return "".join(parts) or "<p>No effect is named.</p>"


def page(result: Diagnosis, campaign: Campaign) -> str:
    """Return the page as HTML text; it needs nothing but itself."""
    document = result.document()
    mismatch = document["mismatch"]
    where = [[f"joint {x['joint']}", f"{100 * x['share']:.0f} %", x["where"], f"{x['band_hz'][0]:.2g} to {x['band_hz'][1]:.2g} Hz"]
             for x in document["location"]]
    segment = _telling(result, campaign)
    curves = "" if segment is None else f"<p>Recording {escape(segment.recording)}.</p>" + _picture(result, segment)
    rest = f"After correction the error on recordings that took no part is {result.proof.after:.1%}; noise alone would leave "
    rest += f"{result.noise_floor:.1%}. " + ("Something systematic remains that no known effect explains."
                                             if result.unexplained["detected"] else "What remains shows no further named structure.")
    found = "found" if mismatch["detected"] else "not found"
    return f"""<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content="width=device-width">
<title>Diagnosis: {escape(campaign.arm.name)}</title><style>{STYLE}</style></head><body><main>
<h1>What the model of {escape(campaign.arm.name)} leaves out</h1><p class=verdict>{escape(result.verdict())}</p>
<p class=soft>Baseline {escape(document['baseline'])}; mismatch {found} (p = {mismatch['p_value']:.3f}, over all hypotheses tried);
error of the recalibrated baseline on left-out recordings {mismatch['error']:.1%}.</p>
<h2>Where</h2>{_table(['where', 'share', 'what it depends on', 'band'], where) if where else '<p>Nowhere beyond noise.</p>'}
<h2>What, and why this and not its rivals</h2>{_findings(result)}
<h2>Measured, baseline and corrected torque</h2>{curves}
<h2>What remains</h2><p>{escape(rest)}</p></main></body></html>
"""
