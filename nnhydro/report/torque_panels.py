"""Torque against time: measured and modelled curves of one recording, and what the models leave, a pair of panels a joint.

The only drawing of these curves, on a page and in a file. Steady runs are drawn as marks against what their table varies. Lines differ in
dash and width as well as in colour, marks in shape, so that they can be distinguished in grey and by colour-blind readers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import joint_text
from nnhydro.recordings.segment import Segment
from nnhydro.report.figure_file import CURVE, GRID, INK, LEGEND, MARKS, MEASURED_LINE, MEASURED_MARK, STYLES, new_figure
from nnhydro.report.widgets.svg import Ends, around
from nnhydro.report.widgets.trace import Trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
MEASURED = "measured"
DIFFERENT = 1e-3  # rad, rad/s, m/s: runs of a steady table that differ less do not vary
ALONE, COLUMN = 8.5, 3.5  # inches across: a single column of panels, one of several
HIGH, LOW, GAP = 1.75, 0.8, 0.14  # inches: a panel of torques, one of residuals, between two panels
LEFT, RIGHT, TOP, BOTTOM, LINE = 0.97, 0.12, 0.1, 0.5, 0.24  # inches: margins, a line of text above the panels
STEP = 0.08  # inches, from the marks of a steady run to those of a model beside them
NAMES = 4  # in a line of the legend


@final
@dataclass(frozen=True, eq=False)
class Panel:
    """The torques of a joint, measured and modelled, or what the models leave of them; `curves` (n,) N m, the last one on top."""

    joint: int  # from 1
    residual: bool
    label: str
    curves: Mapping[str, Array]
    limits: Ends


def panels(trace: Trace, models: Sequence[str], first: Sequence[str] = ()) -> list[Panel]:
    """Return two panels a joint, torques and residuals; the first of `models` lies on top.

    The limits hold all of the measured torque and of the models `first` (all where none of these is drawn).
    """
    made, limiting = [], {MEASURED, *(set(first) & set(models) or models)}
    for joint, residual in np.ndindex(trace.segment.n_links, 2):
        curves = {} if residual else {MEASURED: trace.tau[:, joint]}
        curves |= {name: (trace.residual(name) if residual else trace.models[name])[:, joint] for name in reversed(models)}
        shown = [y for name, y in curves.items() if name in limiting]
        label = joint_text(f"{'residual' if residual else 'torque'} {joint + 1} [N m]", trace.segment.sliding)
        made.append(Panel(joint + 1, bool(residual), label, curves, around(np.concatenate(shown), zero=bool(residual))))
    return made


def shaded_ends(segment: Segment) -> list[Ends]:
    """Return the times s between which the filter touches the rows, and no comparison uses them."""
    compared = np.flatnonzero(segment.keep)
    if segment.steady or not len(compared):
        return []
    pairs = ((segment.t[0], segment.t[compared[0]]), (segment.t[compared[-1]], segment.t[-1]))
    return [(float(a), float(b)) for a, b in pairs if b > a]


def drawn_over(segment: Segment) -> dict[str, Array]:
    """Return what the torques are drawn against, by its name: time, or what a steady table varies."""
    if not segment.steady:
        return {"time [s]": segment.t}
    found = {"towing speed [m/s]": segment.u0}
    for j in range(segment.n_links):
        found |= {f"rate of joint {j + 1} [rad/s]": segment.qd[:, j], f"angle of joint {j + 1} [rad]": segment.q[:, j]}
    return {joint_text(name, segment.sliding): x for name, x in found.items() if np.ptp(x) > DIFFERENT}


def thin(x: Array, y: Array, most: int) -> tuple[Array, Array]:
    """Return at most `most` points of a curve: lowest and highest of every stretch, so that no peak is lost."""
    if len(x) <= most:
        return x, y
    edges = np.linspace(0, len(x), max(most // 2, 1) + 1).astype(int)
    first, last = edges[:-1], edges[1:] - 1
    stretches = y[np.minimum(first[:, None] + np.arange((last - first).max() + 1), last[:, None])]  # a shorter one repeats its last point
    keep = np.unique(np.concatenate([first + stretches.argmin(axis=1), first + stretches.argmax(axis=1)]))
    return x[keep], y[keep]


def _axes(figure: "Figure", shown: Sequence[Panel], columns: int, head: float) -> None:
    """Give the figure a row of panels for each of `shown`, `head` inches below its top.

    Behind each column of panels lies its axis across, with two ends to shade.
    """
    from matplotlib.patches import Rectangle

    heights = [LOW if panel.residual else HIGH for panel in shown]
    each = COLUMN if columns > 1 else ALONE
    width, high = each * columns + GAP * (columns - 1), sum(heights) + GAP * (len(shown) - 1)
    whole = np.array([width + LEFT + RIGHT, high + head + BOTTOM])
    figure.set_size_inches(*whole)
    for (row, panel), column in product(enumerate(shown), range(columns)):
        corner = [LEFT + (each + GAP) * column, BOTTOM + sum(heights[row + 1:]) + GAP * (len(shown) - row - 1)]
        ax = figure.add_axes((*corner / whole, *[each, heights[row]] / whole))
        ax.xaxis.set_visible(False)
        ax.set_ylabel(panel.label.replace(" [", "\n[") if panel.residual else panel.label, visible=column == 0)
        ax.yaxis.set_label_coords(-0.6 / each, 0.5)
        ax.locator_params(axis="y", nbins=3 if panel.residual else 6, steps=[1, 2, 5, 10])
        ax.tick_params(left=False, labelleft=column == 0)
    for column in range(columns):
        ax = figure.add_axes((*[LEFT + (each + GAP) * column, BOTTOM] / whole, *[each, high] / whole), zorder=-1)
        ax.yaxis.set_visible(False)
        ax.xaxis.set_label_coords(0.5, -0.36 / high)
        ax.locator_params(axis="x", nbins=8)
        ax.tick_params(bottom=False)
        for _ in range(2):
            ax.add_patch(Rectangle((0, 0), 0, 1, transform=ax.get_xaxis_transform(), color=INK, alpha=0.06, linewidth=0))
    for ax in figure.axes:
        ax.grid(color=GRID)
        ax.spines[:].set_visible(False)
        ax.patch.set_visible(False)


def _empty(shown: Sequence[Panel], columns: int, styles: Mapping[str, int], labels: Mapping[str, str], steady: bool, title: str
           ) -> "Figure":
    """Return the picture without values: axes, and each curve in its style under the id by which scripts find it."""
    from matplotlib.transforms import ScaledTranslation

    rows = -(-(len(labels) + 1) // NAMES) if labels else 0
    figure = new_figure(1.0, 1.0, layout=None)
    _axes(figure, shown, columns, TOP + LINE * (rows + bool(title)))
    looks = {name: (MARKS if steady else STYLES)[number] for name, number in styles.items()}
    order = [MEASURED, *styles]
    looks[MEASURED] = MEASURED_MARK if steady else MEASURED_LINE
    for number, (panel, _) in enumerate(product(shown, range(columns))):
        ax = figure.axes[number]
        for name in panel.curves:
            (line,) = ax.plot([], [], label=labels.get(name, name), gid=f"{CURVE}{number}:{name}", **looks[name])
            if steady and name != MEASURED:
                line.set_transform(line.get_transform() + ScaledTranslation(STEP * (order.index(name) + 0.5), 0, figure.dpi_scale_trans))
        if panel.residual:
            ax.axhline(0, color=INK, linewidth=0.6)
    width, height = figure.get_size_inches()
    if title:
        figure.suptitle(title, x=0.1 / width, y=1 - 0.06 / height, ha="left", va="top", fontsize=10)
    if labels:
        curves = dict(zip(shown[0].curves, figure.axes[0].lines, strict=True))
        legend = figure.legend(handles=[curves[name] for name in order], ncols=NAMES, frameon=False, borderaxespad=0.2,
                               loc="upper left", bbox_to_anchor=(LEFT / width, 1 - LINE * bool(title) / height))
        for name, *parts in zip(order, legend.get_lines(), legend.get_texts(), strict=True):
            for number, part in enumerate(parts):
                part.set_gid(f"{LEGEND}{number}:{name}")
    return figure


def torque_figure(trace: Trace, styles: Mapping[str, int], over: Mapping[str, Array] | None = None, first: Sequence[str] = (),
                  most: int | None = None, frame: "Figure | None" = None, labels: Mapping[str, str] = MappingProxyType({}), title: str = ""
                  ) -> "Figure":
    """Return measured and modelled torque, and what the models leave: two rows of panels a joint, a column each of `over` (n,).

    `styles` gives each model the number of its line style, the first on top; `first` are the models that set the limits. A curve has at
    most `most` points. A legend calls the models as `labels` says, where it is given. `frame` is an earlier figure of the same panels,
    models, labels and number of columns to draw into, which takes a quarter of the time.
    """
    segment, shown = trace.segment, panels(trace, list(styles), first)
    columns = drawn_over(segment) if over is None else over
    figure = _empty(shown, len(columns), styles, labels, segment.steady, title) if frame is None else frame
    for ax, (panel, x) in zip(figure.axes, product(shown, columns.values()), strict=False):
        for line, y in zip(ax.lines, panel.curves.values(), strict=False):  # the last line may be zero
            line.set_data(*(x, y) if segment.steady or most is None else thin(x, y, most))
        ax.set_ylim(panel.limits)
    room = STEP * len(styles) / (COLUMN if len(columns) > 1 else ALONE)  # of the marks beside the last run
    behind = figure.axes[len(shown) * len(columns):]
    for number, ax in enumerate(figure.axes):
        name, x = list(columns.items())[number % len(columns)]
        low, high = around(x)
        ax.set(xlabel=name, xlim=(low, high + room * (high - low)) if segment.steady else (x[0], x[-1]))
    for patches in (ax.patches for ax in behind):
        for patch, (start, stop) in zip(patches, [*shaded_ends(segment), (0.0, 0.0), (0.0, 0.0)], strict=False):
            patch.set(x=start, width=stop - start)
    return figure


def torque_file(trace: Trace, labels: Mapping[str, str], title: str) -> "Figure":
    """Return the figure of a file: with its title, and the curves of the models called as `labels` says, the first on top."""
    low_pass = trace.segment.low_pass
    filtered = "" if low_pass is None else f"; all curves low-passed at {low_pass.cutoff_hz:.3g} Hz, shaded ends not compared"
    return torque_figure(trace, {name: number for number, name in enumerate(labels)}, labels=labels, title=f"{title}{filtered}")
