"""Torque against time of one recording as SVG: measured and every model, what each leaves below; the page's switches hide models.

Every line carries its panel; the panel carries the scales, so that the page's script can read values back from the drawing itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from nnhydro.report.widgets.panels import MEASURED, Panel, panels, shaded_ends, varied_columns
from nnhydro.report.widgets.svg import FINE, Scale, join, path, rule, svg_image, tag, thin, x_axis, y_axis
from nnhydro.report.widgets.trace import Trace

Array = NDArray[np.float64]
WIDTH, LEFT, RIGHT = 920.0, 62.0, 10.0
TALL, LOW, GAP, TOP, BOTTOM = 150.0, 70.0, 14.0, 8.0, 40.0
BUDGET = 1_500_000  # characters of all lines of a page
FEWEST, POINTS = 120, 600  # points of a line
PER_POINT = 6.5  # characters


@final
@dataclass(frozen=True, eq=False)
class History:
    """One recording's picture, its name, each model's error on it, and whether it is a steady table."""

    recording: str
    label: str
    drawing: Markup
    errors: Mapping[str, float]
    steady: bool


def points_a_line(traces: Sequence[Trace], models: int) -> int:
    """Return how many points a line may have so that the page stays small."""
    lines = sum(trace.segment.n_links * (2 * models + 1) for trace in traces)
    return int(np.clip(BUDGET / max(lines * PER_POINT, 1), FEWEST, POINTS))


def _line(x: Array, y: Array, across: Scale, up: Scale, most: int) -> str:
    """A curve as path data."""
    finite = np.isfinite(y)
    a, b = thin(x[finite], y[finite], most)
    return path(across.pixels(a), up.pixels(b)) if len(a) else ""


def _marks(x: Array, y: Array, across: Scale, up: Scale, half: float, offset: float) -> str:
    """Single runs of a steady table as path data: dashes of `half` pixels to each side, `offset` pixels off."""
    return " ".join(f"M{round(FINE * (a + offset - half))} {round(FINE * b)}h{round(2 * half * FINE)}"
                    for a, b in zip(across.pixels(x), up.pixels(y), strict=True))


@final
@dataclass(frozen=True, eq=False)
class _Frame:
    """What the panels of one picture share: values across, their scale, line styles, the most points of a line."""

    trace: Trace
    x: Array
    across: Scale
    styles: Mapping[str, int]
    most: int

    def panel(self, shown: Panel, top: float) -> Markup:
        """Return one panel as a group of curves with its axis."""
        bottom, steady = top + (LOW if shown.residual else TALL), self.trace.segment.steady
        up = Scale(*shown.limits, bottom, top)
        kind = {name: f"m{number}" for name, number in self.styles.items()} | {MEASURED: MEASURED}
        lines = [tag("path", class_=f"{kind[name]} marks" if steady else kind[name], data_series=name,
                     d=self.runs(name, y, up) if steady else _line(self.x, y, self.across, up, self.most))
                 for name, y in shown.curves.items()]
        axis = y_axis(up, LEFT, WIDTH - RIGHT, shown.label, 3 if shown.residual else 6)
        zero = rule("axis", LEFT, up(0.0), WIDTH - RIGHT, up(0.0)) if shown.residual else Markup("")
        inside = tag("svg", tag("g", *lines, transform=f"scale({1 / FINE})"), y=top, width=WIDTH, height=bottom - top,
                     viewBox=f"0 {top} {WIDTH} {bottom - top}")
        return tag("g", axis, zero, inside, class_="panel", data_label=shown.label.split(" [")[0],
                   data_y=f"{bottom} {top} {up.high:.6g} {up.low:.6g}")

    def runs(self, name: str, y: Array, up: Scale) -> str:
        """Return steady runs as path data: measured ones wide, models side by side right of them."""
        if name == MEASURED:
            return _marks(self.x, y, self.across, up, 7.0, 0.0)
        return _marks(self.x, y, self.across, up, 3.0, 12.0 + 7.0 * list(self.styles).index(name))

    def ends(self, bottom: float) -> Markup:
        """Shade the ends that the filter touches and no comparison uses."""
        return join([tag("rect", class_="ends", x=self.across(a), y=TOP, width=self.across(b) - self.across(a), height=bottom - TOP)
                     for a, b in shaded_ends(self.trace.segment)])


def _picture(trace: Trace, x: Array, over: str, label: str, styles: Mapping[str, int], most: int, first: Sequence[str]
             ) -> History:
    """One recording: torque and residual of each joint, one panel below the other."""
    across = Scale.around(x, LEFT, WIDTH - RIGHT) if trace.segment.steady else Scale(float(x[0]), float(x[-1]), LEFT, WIDTH - RIGHT)
    frame, drawn, top = _Frame(trace, x, across, styles, most), list[Markup](), TOP
    for shown in panels(trace, list(styles), first):
        drawn.append(frame.panel(shown, top))
        top += LOW + 1.5 * GAP if shown.residual else TALL + GAP
    bottom, steady = top - 1.5 * GAP, trace.segment.steady
    title = f"Measured and modelled torques of {label} against {over}, joint by joint, with the residuals below"
    parts = [frame.ends(bottom), x_axis(across, TOP, bottom, over), *drawn, rule("cursor", 0, TOP, 0, bottom)]
    picture = svg_image(WIDTH, bottom + BOTTOM, title, parts, "history steady" if steady else "history", tabindex=None if steady else 0,
                      data_x=f"{LEFT} {WIDTH - RIGHT} {across.low:.6g} {across.high:.6g}")
    return History(trace.recording, label, picture, {name: trace.error(name) for name in styles}, steady)


def history(trace: Trace, styles: Mapping[str, int], most: int, first: Sequence[str], part: str = "") -> list[History]:
    """Return the pictures of one trace: against time, or of a steady table against everything that it varies.

    `styles` gives each model the number of its line style, `most` the points of a line, `first` the models that set the scale.
    """
    if not trace.segment.steady:
        return [_picture(trace, trace.segment.t, "time [s]", f"{trace.recording}{part}", styles, most, first)]
    return [_picture(trace, x, name, f"{trace.recording} against {name.split(' [')[0]}", styles, most, first)
            for name, x in varied_columns(trace.segment).items()]


def histories(traces: Sequence[Trace], styles: Mapping[str, int], first: Sequence[str]) -> list[History]:
    """Return one picture a trace, as many as fit the page; the models `first` set the scales."""
    most = points_a_line(traces, len(styles))
    fit = max(int(BUDGET / max(PER_POINT * FEWEST * (2 * len(styles) + 1) * traces[0].segment.n_links, 1)), 1) if traces else 0
    shown, seen, made = traces[:fit], list[str](), list[History]()
    for trace in shown:
        seen.append(trace.recording)
        count = sum(other.recording == trace.recording for other in shown)
        made += history(trace, styles, most, first, f", part {seen.count(trace.recording)}" if count > 1 else "")
    return made
