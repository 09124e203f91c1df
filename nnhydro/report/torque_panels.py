"""Torque against time: measured and modelled curves of one recording, and what the models leave, a pair of panels a joint.

Lines differ in dash and width as well as in colour, so that they can be told apart in grey and by colour-blind readers.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import joint_text
from nnhydro.recordings.segment import Segment
from nnhydro.report.figure_file import new_figure, save_figure
from nnhydro.report.widgets.history import varied_column

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
INK = "#111111"
# Okabe and Ito's colour-blind safe palette, darkest first, each with a dash of its own
STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#D55E00", "linestyle": "-", "linewidth": 1.3},
    {"color": "#0072B2", "linestyle": (0, (5, 2)), "linewidth": 1.3},
    {"color": "#009E73", "linestyle": (0, (1, 1.2)), "linewidth": 1.6},
)


def draw_joint_panels(figure: "Figure", segment: Segment, lines: dict[str, Array]) -> None:
    """Two panels a joint: torques above, what the models leave below."""
    assert segment.tau is not None
    joints = segment.n_links
    axes = figure.subplots(2 * joints, 1, sharex=True, height_ratios=[3, 1.4] * joints, squeeze=False)[:, 0]
    for joint in range(joints):
        above, below = axes[2 * joint], axes[2 * joint + 1]
        above.plot(segment.t, segment.tau[:, joint], color=INK, linewidth=2.4, alpha=0.75, label="measured")
        for (name, tau), style in zip(lines.items(), STYLES, strict=False):
            above.plot(segment.t, tau[:, joint], label=name, **style)
            below.plot(segment.t, (segment.tau - tau)[:, joint], **style)
        above.set_ylabel(joint_text(f"torque {joint + 1} [N m]", segment.sliding))
        below.set_ylabel(joint_text("residual\n[N m]", segment.sliding))
        below.axhline(0, color=INK, linewidth=0.6)
        _fit_residuals(below, np.concatenate([(segment.tau - tau)[segment.keep, joint] for tau in lines.values()]))
        _shade_ends(above, segment)
        _shade_ends(below, segment)
    axes[0].legend(ncols=4, loc="lower left", bbox_to_anchor=(0, 1.0), frameon=False)
    axes[-1].set_xlabel("time [s]" if not segment.steady else "run")


def draw_steady(segment: Segment, models: Mapping[str, Array], stem: Path) -> list[Path]:
    """Draw the torque of steady runs against everything that they vary, measured and modelled, a row a joint."""
    assert segment.tau is not None
    over = varied_column(segment)
    figure = new_figure(3.6 * len(over) + 0.6, 2.7 * segment.n_links + 0.5)
    axes = figure.subplots(segment.n_links, len(over), squeeze=False, sharey="row")
    for (joint, column), ax in np.ndenumerate(axes):
        name, x = list(over.items())[column]
        ax.plot(x, segment.tau[:, joint], "o", color=INK, fillstyle="none", markersize=7, label="measured")
        for (model, tau), style, marker in zip(models.items(), STYLES, "x+1", strict=False):
            ax.plot(x, tau[:, joint], marker, color=style["color"], markersize=6, label=model)
        ax.set_xlabel(name)
        ax.set_ylabel(joint_text(f"torque {joint + 1} [N m]", segment.sliding) if column == 0 else "")
        ax.spines[["top", "right"]].set_visible(False)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=4, frameon=False)
    return save_figure(figure, stem)


def _fit_residuals(axes: "Axes", compared: Array) -> None:
    """Scale a residual's axis by the rows that are compared: at the ends the filter leaves more than any model does."""
    low, high = min(float(compared.min(initial=0.0)), 0.0), max(float(compared.max(initial=0.0)), 0.0)
    if high > low:
        axes.set_ylim(low - 0.15 * (high - low), high + 0.15 * (high - low))


def _shade_ends(axes: "Axes", segment: Segment) -> None:
    """Grey the ends that the filter touches and the comparison leaves out."""
    compared = np.flatnonzero(segment.keep)
    if len(compared):
        axes.axvspan(segment.t[0], segment.t[compared[0]], color="#000000", alpha=0.06, linewidth=0)
        axes.axvspan(segment.t[compared[-1]], segment.t[-1], color="#000000", alpha=0.06, linewidth=0)
    axes.margins(x=0)
