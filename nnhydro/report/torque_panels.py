"""Torque against time: measured and modelled curves of one recording, and what the models leave, a pair of panels a joint.

Lines differ in dash and width as well as in colour, so that they can be told apart in grey and by colour-blind readers.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nnhydro.report.figure_file import new_figure
from nnhydro.report.widgets.panels import MEASURED, panels, shaded_ends, varied_columns
from nnhydro.report.widgets.trace import Trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK = "#111111"
# Okabe and Ito's colour-blind safe palette, darkest first, each with a dash of its own
STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#D55E00", "linestyle": "-", "linewidth": 1.3},
    {"color": "#0072B2", "linestyle": (0, (5, 2)), "linewidth": 1.3},
    {"color": "#009E73", "linestyle": (0, (1, 1.2)), "linewidth": 1.6},
)
MEASURED_LINE: dict[str, Any] = {"color": INK, "linewidth": 2.4, "alpha": 0.75}


def history_figure(trace: Trace, labels: Mapping[str, str], title: str) -> "Figure":
    """Return torque against time, two panels a joint: torques above, what the models leave below; `labels` by model, the first on top."""
    shown, segment = panels(trace, list(labels)), trace.segment
    styles = dict(zip(labels, STYLES, strict=False)) | {MEASURED: MEASURED_LINE}
    figure = new_figure(9.0, 2.6 * segment.n_links + 1.4)
    axes = figure.subplots(len(shown), 1, sharex=True, height_ratios=[1.4 if panel.residual else 3 for panel in shown])
    for ax, panel in zip(axes, shown, strict=True):
        lines = {name: ax.plot(segment.t, y, label=labels.get(name, name), **styles[name])[0] for name, y in panel.curves.items()}
        if panel is shown[0]:
            ax.legend(handles=[lines[name] for name in (MEASURED, *labels)], ncols=4, loc="lower left", bbox_to_anchor=(0, 1.0),
                      frameon=False)
        if panel.residual:
            ax.axhline(0, color=INK, linewidth=0.6)
        for start, stop in shaded_ends(segment):
            ax.axvspan(start, stop, color="#000000", alpha=0.06, linewidth=0)
        ax.set(ylabel=panel.label.replace(" [", "\n[") if panel.residual else panel.label, ylim=panel.limits)
        ax.margins(x=0)
    axes[-1].set_xlabel("time [s]")
    low_pass = segment.low_pass
    filtered = "" if low_pass is None else f"; all curves low-passed at {low_pass.cutoff_hz:.3g} Hz, shaded ends not compared"
    figure.suptitle(f"{title}{filtered}", x=0.01, ha="left", fontsize=10)
    return figure


def steady_figure(trace: Trace, models: Sequence[str]) -> "Figure":
    """Return the torque of steady runs against everything that they vary, measured and modelled, a row a joint."""
    over, rows = varied_columns(trace.segment), [panel for panel in panels(trace, models) if not panel.residual]
    figure = new_figure(3.6 * len(over) + 0.6, 2.7 * len(rows) + 0.5)
    axes = figure.subplots(len(rows), len(over), squeeze=False, sharey="row")
    for (row, column), ax in np.ndenumerate(axes):
        name, x = list(over.items())[column]
        ax.plot(x, rows[row].curves[MEASURED], "o", color=INK, fillstyle="none", markersize=7, label=MEASURED)
        for model, style, marker in zip(models, STYLES, "x+1", strict=False):
            ax.plot(x, rows[row].curves[model], marker, color=style["color"], markersize=6, label=model)
        ax.set(xlabel=name, ylabel=rows[row].label if column == 0 else "", ylim=rows[row].limits)
        ax.spines[["top", "right"]].set_visible(False)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=4, frameon=False)
    return figure
