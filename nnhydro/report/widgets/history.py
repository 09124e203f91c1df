"""Torque against time of every recording on a page: the figures of `torque_panels`, with what the page's script reads from them.

The script switches the curves of a model by its name. It reads values under the cursor from the curves' points and the panels' scales.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from markupsafe import Markup

from nnhydro.report.figure_file import page_figure
from nnhydro.report.torque_panels import drawn_over, torque_figure
from nnhydro.report.widgets.trace import Trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BUDGET = 1_500_000  # characters of all lines of a page
FEWEST, POINTS = 120, 600  # points of a line
PER_POINT = 7.5  # characters


@final
@dataclass(frozen=True, eq=False)
class History:
    """One recording's picture, its name, each model's error on it, and whether it is a steady table."""

    recording: str
    label: str
    drawing: Markup
    errors: Mapping[str, str]
    steady: bool


def points_a_line(traces: Sequence[Trace], models: int) -> int:
    """Return how many points per line may have so that the page stays small."""
    lines = sum(trace.segment.n_links * (2 * models + 1) for trace in traces)
    return int(np.clip(BUDGET / max(lines * PER_POINT, 1), FEWEST, POINTS))


def _scales(figure: "Figure") -> str:
    """Each panel as JSON: its label, and its edges across and up in the picture's units, each with the values there."""
    width, height = figure.get_size_inches() * 72
    panels = {ax: ax.get_position() for ax in figure.axes if ax.lines}
    return json.dumps([[ax.get_ylabel().replace("\n", " "), *(float(f"{number:.6g}") for number in (
        place.x0 * width, place.x1 * width, *ax.get_xlim(), (1 - place.y0) * height, (1 - place.y1) * height, *ax.get_ylim()))]
        for ax, place in panels.items()])


def histories(traces: Sequence[Trace], styles: Mapping[str, int], first: Sequence[str]) -> list[History]:
    """Return the pictures of the traces, as many as fit the page: against time, or of a steady table against everything that it varies.

    `styles` gives each model the number of its line style; the models `first` set the scales.
    """
    most, made, frames = points_a_line(traces, len(styles)), list[History](), dict[object, "Figure"]()
    fit = max(int(BUDGET / max(PER_POINT * FEWEST * (2 * len(styles) + 1) * traces[0].segment.n_links, 1)), 1) if traces else 0
    names = [trace.recording for trace in traces[:fit]]
    for number, trace in enumerate(traces[:fit]):
        name, segment = trace.recording, trace.segment
        part = f", part {names[:number + 1].count(name)}" if names.count(name) > 1 else ""
        for column, x in drawn_over(segment).items():
            label = f"{name} against {column.split(' [')[0]}" if segment.steady else f"{name}{part}"
            kind = (segment.n_links, segment.sliding, segment.steady)
            frames[kind] = figure = torque_figure(trace, styles, {column: x}, first, most, frames.get(kind),
                                                  {model: model for model in styles} if segment.steady else {})
            title = f"Measured and modelled torques of {label}{'' if segment.steady else ' against time'}, residuals below"
            drawing = page_figure(figure, title, "history steady" if segment.steady else "history", data_panels=_scales(figure),
                                  tabindex=None if segment.steady else 0)
            made.append(History(name, label, drawing, {model: trace.error_text(model) for model in styles}, segment.steady))
    return made
