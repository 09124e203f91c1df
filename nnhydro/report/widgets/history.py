"""Torque against time of one recording as SVG: measured and every model, what each leaves below; the page's switches hide models.

Every line carries its panel; the panel carries the scales, so that the page's script can read values back from the drawing itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from nnhydro.conventions import joint_text
from nnhydro.recordings.segment import Segment
from nnhydro.report.widgets.svg import FINE, Scale, join, path, rule, svg_image, tag, thin, x_axis, y_axis
from nnhydro.report.widgets.trace import Trace

Array = NDArray[np.float64]
WIDTH, LEFT, RIGHT = 920.0, 62.0, 10.0
TALL, LOW, GAP, TOP, BOTTOM = 150.0, 70.0, 14.0, 8.0, 40.0
BUDGET = 1_500_000  # characters of all lines of a page
FEWEST, POINTS = 120, 600  # points of a line
PER_POINT = 6.5  # characters
DIFFERENT = 1e-3  # rad, rad/s, m/s: runs of a steady table that differ less do not vary


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


def _marks(x: Array, y: Array, across: Scale, up: Scale, half: float, beside: float) -> str:
    """Single runs of a steady table as path data: dashes of `half` pixels to each side, `beside` pixels off."""
    return " ".join(f"M{round(FINE * (a + beside - half))} {round(FINE * b)}h{round(2 * half * FINE)}"
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
    first: Sequence[str]  # models shown at first: the scale is theirs, others are cut off where they leave the panel

    def panel(self, joint: int, residual: bool, top: float) -> Markup:
        """Return one panel: torques of a joint, or what the models leave. The first model is drawn last, on top."""
        trace, bottom, steady = self.trace, top + (LOW if residual else TALL), self.trace.segment.steady
        curves = {} if residual else {"measured": trace.tau[:, joint]}
        curves |= {name: (trace.residual(name) if residual else trace.models[name])[:, joint] for name in reversed(list(self.styles))}
        telling = [y for name, y in curves.items() if name == "measured" or name in self.first] or list(curves.values())
        compared = [y[trace.segment.keep] for y in telling]  # at the ends the filter makes curves leave the panel
        up = Scale.around(np.concatenate(compared), bottom, top, zero=residual)
        kind = {name: f"m{number}" for name, number in self.styles.items()} | {"measured": "measured"}
        lines = [tag("path", class_=f"{kind[name]} marks" if steady else kind[name], data_series=name,
                     d=self.runs(name, y, up) if steady else _line(self.x, y, self.across, up, self.most)) for name, y in curves.items()]
        label = joint_text(f"{'left' if residual else 'torque'} {joint + 1} [N m]", trace.segment.sliding)
        axis = y_axis(up, LEFT, WIDTH - RIGHT, label, 3 if residual else 6)
        zero = rule("axis", LEFT, up(0.0), WIDTH - RIGHT, up(0.0)) if residual else Markup("")
        inside = tag("svg", tag("g", *lines, transform=f"scale({1 / FINE})"), y=top, width=WIDTH, height=bottom - top,
                     viewBox=f"0 {top} {WIDTH} {bottom - top}")
        return tag("g", axis, zero, inside, class_="panel",
                   data_label=f"{'residual' if residual else 'torque'} {joint + 1}", data_y=f"{bottom} {top} {up.high:.6g} {up.low:.6g}")

    def runs(self, name: str, y: Array, up: Scale) -> str:
        """Return steady runs as path data: measured ones wide, models side by side right of them."""
        if name == "measured":
            return _marks(self.x, y, self.across, up, 7.0, 0.0)
        return _marks(self.x, y, self.across, up, 3.0, 12.0 + 7.0 * list(self.styles).index(name))

    def ends(self, bottom: float) -> Markup:
        """Shade the ends that the filter touches and no comparison uses."""
        compared, across = np.flatnonzero(self.trace.segment.keep), self.across
        pairs = () if self.trace.segment.steady else ((self.x[0], self.x[compared[0]]), (self.x[compared[-1]], self.x[-1]))
        return join([tag("rect", class_="ends", x=across(a), y=TOP, width=across(b) - across(a), height=bottom - TOP)
                       for a, b in pairs if b > a])


def _picture(trace: Trace, x: Array, over: str, label: str, styles: Mapping[str, int], most: int, first: Sequence[str]
             ) -> History:
    """One recording: torque and residual of each joint, one panel below the other."""
    across = Scale.around(x, LEFT, WIDTH - RIGHT) if trace.segment.steady else Scale(float(x[0]), float(x[-1]), LEFT, WIDTH - RIGHT)
    frame, panels, top = _Frame(trace, x, across, styles, most, first), list[Markup](), TOP
    for joint in range(trace.segment.n_links):
        panels += [frame.panel(joint, False, top), frame.panel(joint, True, top + TALL + GAP)]
        top += TALL + LOW + 2.5 * GAP
    bottom, steady = top - 1.5 * GAP, trace.segment.steady
    title = f"Measured torque of {label} against {over}, and each model's, joint by joint; below each what the models leave"
    parts = [frame.ends(bottom), x_axis(across, TOP, bottom, over), *panels, rule("cursor", 0, TOP, 0, bottom)]
    picture = svg_image(WIDTH, bottom + BOTTOM, title, parts, "history steady" if steady else "history", tabindex=None if steady else 0,
                      data_x=f"{LEFT} {WIDTH - RIGHT} {across.low:.6g} {across.high:.6g}")
    return History(trace.recording, label, picture, {name: trace.error(name) for name in styles}, steady)


def varied_column(segment: Segment) -> dict[str, Array]:
    """What a steady table varies, by its name."""
    found = {"towing speed [m/s]": segment.u0}
    for j in range(segment.n_links):
        found |= {f"rate of joint {j + 1} [rad/s]": segment.qd[:, j], f"angle of joint {j + 1} [rad]": segment.q[:, j]}
    return {joint_text(name, segment.sliding): x for name, x in found.items() if np.ptp(x) > DIFFERENT}


def history(trace: Trace, styles: Mapping[str, int], most: int, first: Sequence[str], part: str = "") -> list[History]:
    """Return the pictures of one trace: against time, or of a steady table against everything that it varies.

    `styles` gives each model the number of its line style, `most` the points of a line, `first` the models that set the scale.
    """
    if not trace.segment.steady:
        return [_picture(trace, trace.segment.t, "time [s]", f"{trace.recording}{part}", styles, most, first)]
    return [_picture(trace, x, name, f"{trace.recording} against {name.split(' [')[0]}", styles, most, first)
            for name, x in varied_column(trace.segment).items()]


def histories(traces: Sequence[Trace], styles: Mapping[str, int], first: Sequence[str]) -> list[History]:
    """Return one picture a trace, as many as fit the page; the models `first` set the scales."""
    most = points_a_line(traces, len(styles))
    fit = max(int(BUDGET / max(PER_POINT * FEWEST * (2 * len(styles) + 1) * traces[0].segment.n_links, 1)), 1) if traces else 0
    shown, seen, made = traces[:fit], list[str](), list[History]()
    for trace in shown:
        seen.append(trace.recording)
        count = sum(t.recording == trace.recording for t in shown)
        made += history(trace, styles, most, first, f", part {seen.count(trace.recording)}" if count > 1 else "")
    return made
