"""The pictures of a diagnosis: torque against time, the residual map of baseline and corrected model, the laws that were found.

Each is written as PNG and SVG with its data beside it, and can be distinguished in grey and by colour-blind readers.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from nnhydro.diagnosis.result import DiagnosisResult
from nnhydro.report.diagnosis.finding_law import DrawnLaw, law_of
from nnhydro.report.figure_file import INK, STYLES, new_figure, save_figure
from nnhydro.report.torque_panels import torque_file
from nnhydro.report.widgets.residual_map import ResidualMap, largest
from nnhydro.report.widgets.trace import BASELINE, CORRECTED, Trace, by_change, spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_RECORDINGS = 15  # that a law is drawn from
DOTS = 600  # single rows in a panel
OVER = "angle and rate"
SHADES = 64  # of the colour scale


def map_figure(maps: Sequence[ResidualMap], stem: Path) -> list[Path]:
    """Draw the residual maps over angle and rate: one row per joint, one column per model, one colour scale per joint."""
    from matplotlib import colormaps

    shown = [grid for grid in maps if grid.over == OVER]
    joints, models = sorted({grid.joint for grid in shown}), list(dict.fromkeys(grid.model for grid in shown))
    heat, colors = largest(shown), colormaps["cividis"].resampled(SHADES)
    width, height = 4.4 * len(models) + 1.8, 3.4 * len(joints) + 0.3
    figure = new_figure(width, height, layout=None)
    axes = figure.subplots(len(joints), len(models), squeeze=False, sharex="row", sharey="row")
    figure.subplots_adjust(0.7 / width, 0.55 / height, 1 - 0.7 / width, 1 - 0.35 / height, 0.12, 0.35)
    for grid in shown:
        ax = axes[joints.index(grid.joint), models.index(grid.model)]
        values = np.array([[np.nan if cell is None else cell.rms for cell in row] for row in grid.cells])[::-1]
        mesh = ax.pcolormesh(grid.across_edges, grid.down_edges, values, cmap=colors, vmin=0.0, vmax=heat[grid.joint] or 1.0,
                             label=grid.model)
        ax.set(xlabel=grid.across, ylabel=grid.down, title=f"joint {grid.joint}, {grid.model}", facecolor="0.93")
        if grid.model == models[-1]:
            figure.colorbar(mesh, ax=axes[joints.index(grid.joint)], label=f"rms residual of joint {grid.joint} [N m], on its own scale",
                            pad=0.03, fraction=0.07)
    return save_figure(figure, stem)


FOUND = ("measured minus the rest of the model", "its mean over a bin", "law found")
UNNAMED = ("what no finding explains, on held-out recordings", "its mean over a bin", "the mean, joined")


def _law(ax: "Axes", law: DrawnLaw, title: str, labels: tuple[str, str, str]) -> None:
    """One law: single rows, their means, the law with its interval."""
    dots = law.rows[np.unique(np.linspace(0, len(law.rows) - 1, DOTS).astype(int))]
    ax.plot(*dots.T, ".", color="0.8", markersize=2, zorder=0, label=labels[0])
    ax.plot(law.x, law.rest, "o", color=INK, fillstyle="none", markersize=5, label=labels[1])
    ax.plot(law.x, law.law, **STYLES[0], label=labels[2])
    for sign, label in ((-1, "95 % interval"), (1, None)):
        ax.plot(law.x, law.law + sign * law.half, color=STYLES[0]["color"], linestyle=(0, (4, 2)), linewidth=0.8, label=label)
    ax.fill_between(law.x, law.law - law.half, law.law + law.half, color=STYLES[0]["color"], alpha=0.2, linewidth=0)
    low, high = np.quantile(np.concatenate([dots[:, 1], law.law, law.rest]), [0.005, 0.995])
    ax.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
    margin = 0.03 * np.ptp(law.x) or 1.0  # of one place, in a table at one speed
    ax.set_xlim(law.x.min() - margin, law.x.max() + margin)
    ax.set(xlabel=law.driver, ylabel=f"torque {law.joint} [N m]")
    ax.set_title(title, fontsize=9, loc="left", wrap=True)
    ax.grid(color="0.92")
    ax.spines[["top", "right"]].set_visible(False)


def law_figure(laws: Sequence[tuple[str, DrawnLaw]], labels: tuple[str, str, str] = FOUND) -> "Figure":
    """Return laws, each with its statement, one below the other; `labels` name rows, means and line."""
    figure = new_figure(8.0, 3.6 * len(laws) + 0.5)
    axes = figure.subplots(len(laws), 1, squeeze=False)[:, 0]
    for ax, (statement, law) in zip(axes, laws, strict=True):
        _law(ax, law, statement, labels)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False, fontsize=8.5, markerscale=1.5)
    return figure


def laws_of(result: DiagnosisResult, traces: Sequence[Trace]) -> list[DrawnLaw | None]:
    """Return the law of each finding; `traces` are the campaign's, of the models BASELINE and CORRECTED."""
    names = spread(list(dict.fromkeys(trace.recording for trace in traces)), MOST_RECORDINGS)
    some = [trace for trace in traces if trace.recording in names]
    return [law_of(finding, result.corrected, some, CORRECTED) for finding in result.findings]


def diagnosis_figures(result: DiagnosisResult, traces: Sequence[Trace], maps: Sequence[ResidualMap], laws: Sequence[DrawnLaw | None],
                      out: Path, unnamed: Sequence[DrawnLaw] = ()) -> list[Path]:
    """Draw every picture of a diagnosis into the folder `out`, each as PNG and SVG with its data; returns their paths."""
    paths, models = list[Path](), [CORRECTED, BASELINE] if result.findings else [BASELINE]
    for trace in by_change(traces):
        stem = out / ("torque_steady" if trace.segment.steady else "torque_history")
        if not stem.with_suffix(".png").exists():  # the first of its kind is where the correction helps most
            labels = {name: f"{name} ({trace.error_text(name)})" for name in models}
            paths += save_figure(torque_file(trace, labels, trace.recording), stem)
    if maps:
        paths += map_figure(maps, out / "residual_map")
    drawn = [(finding.statement, law) for finding, law in zip(result.findings, laws, strict=True) if law is not None]
    left = [(f"Joint {law.joint}: residual that no finding explains", law) for law in unnamed]
    paths += save_figure(law_figure(drawn), out / "laws") if drawn else []
    return paths + (save_figure(law_figure(left, UNNAMED), out / "unexplained") if left else [])
