"""The page's small charts as SVG: errors with intervals, weights of alternatives, reliability of intervals, error over a count."""

from collections.abc import Mapping, Sequence
from math import log2, log10
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from nnhydro.report.diagnosis.finding_law import DrawnLaw
from nnhydro.report.widgets.svg import Scale, rule, svg_image, tag, upright, words, x_axis, y_axis

WIDTH, LEFT, RIGHT, ROW = 760.0, 150.0, 70.0, 30.0
NAMES = 220.0  # where names end in charts of numbers and weights
SIZE, SQUARE = 330.0, 370.0  # bottom and right end of a square chart
MOST = 2.0  # an error beyond 200 % is drawn at the edge
DECADES = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200)
DOTS = 600  # single rows behind a law
Ends = tuple[float, float]
Array = NDArray[np.float64]


def _dot(style: int, x: float, y: float, radius: float = 5) -> Markup:
    return tag("circle", class_=f"m{style} dot", cx=x, cy=y, r=radius)


def error_chart(title: str, rows: Sequence[tuple[str, float, Ends | None]], styles: Mapping[str, int], floor: float | None) -> Markup:
    """Return one row a model: error as a dot, its 95 % interval as a bar, the noise floor as a line."""
    ends = [x for _, error, interval in rows for x in (error, *(interval or ()))] + [floor or 0.0]
    top, bottom = 22.0, 22.0 + ROW * len(rows)
    across = Scale(0.0, 108 * min(max(ends), MOST) or 1.0, LEFT, WIDTH - RIGHT)
    parts = [x_axis(across, top, bottom, "error on held-out recordings: sum |measured \N{MINUS SIGN} modelled| / sum |measured|  [%]")]
    for number, (name, error, interval) in enumerate(rows):
        y, style = top + (number + 0.5) * ROW, styles[name]
        x, low, high = (min(across(100 * e), WIDTH - RIGHT) for e in (error, *(interval or (error, error))))
        parts += [words(name, LEFT - 10, y + 4, anchor="end"), rule(f"m{style} bar", low, y, high, y), _dot(style, x, y),
                  words(f"{100 * error:.1f} %", max(high, x) + 9, y + 4, "value")]
    if floor is not None:
        x = across(100 * floor)
        parts += [rule("floor", x, top - 4, x, bottom), words(f"noise alone: {100 * floor:.1f} %", x, top - 8, "tick")]
    return svg_image(WIDTH, bottom + 40, title, parts, "errors")


def bars(title: str, rows: Sequence[tuple[str, float]]) -> Markup:
    """Return one bar a row, from 0 to 1."""
    across, parts = Scale(0.0, 1.0, NAMES + 10, WIDTH - RIGHT), []
    for k, (name, weight) in enumerate(rows):
        parts += [words(name, NAMES, 18 + 24 * k, anchor="end"), words(f"{weight:.2f}", across(weight) + 6, 18 + 24 * k, "value"),
                  tag("rect", class_="weight", x=NAMES + 10, y=6 + 24 * k, width=across(weight) - NAMES - 10, height=14)]
    return svg_image(WIDTH, 24 * len(rows) + 8, title, parts, "bars")


def intervals(title: str, rows: Sequence[tuple[str, float, Ends, str]]) -> Markup:
    """Return one row a number, each on its own scale with zero marked: value as a dot, 95 % interval as a bar."""
    parts = []
    for k, (name, value, (low, high), unit) in enumerate(rows):
        scale, y = Scale.around(np.array([value, low, high]), NAMES + 10, WIDTH - 280, zero=True), 18.0 + 30 * k
        parts += [words(name, NAMES, y + 4, anchor="end"), rule("axis", scale(0.0), y - 10, scale(0.0), y + 10),
                  rule("m0 bar", scale(low), y, scale(high), y), _dot(0, scale(value), y),
                  words(f"{value:.4g} ({low:.4g} to {high:.4g}) {'' if unit == '1' else unit}", WIDTH - 270, y + 4, "value")]
    return svg_image(WIDTH, 30 * len(rows) + 8, title, parts, "intervals")


def law_chart(law: DrawnLaw, title: str | None = None) -> Markup:
    """Return the law of a finding against what drives it, with its 95 % interval, and what the rest of the model leaves for it.

    `title` is what a screen reader says where it is the law of something without a name.
    """
    bottom, right = 250.0, WIDTH - 20
    low, high = law.law - law.half, law.law + law.half
    across = Scale.around(law.x, 62, right)
    up = Scale.around(np.concatenate([np.quantile(law.rows[:, 1], [0.01, 0.99]), law.rest, low, high]), bottom, 10)
    few = law.rows[np.unique(np.linspace(0, len(law.rows) - 1, DOTS).astype(int))]
    inside = few[(np.abs(few - [(s.low + s.high) / 2 for s in (across, up)]) < [(s.high - s.low) / 2 for s in (across, up)]).all(axis=1)]
    dots = " ".join(f"M{a:.0f} {b:.0f}h1.5" for a, b in zip(across.pixels(inside[:, 0]), up.pixels(inside[:, 1]), strict=True))

    def line(y: Array) -> str:
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across.pixels(law.x), up.pixels(y), strict=True))

    frame = x_axis(across, 10, bottom, law.driver) + y_axis(up, 62, right, f"torque {law.joint} [N m]")
    parts = [frame, tag("path", class_="cloud", d=dots),
             tag("polygon", class_="band", points=f"{line(high)} {' '.join(line(low).split()[::-1])}"),
             tag("polyline", class_="m0", points=line(law.law)),
             *(tag("circle", class_="mean", cx=across(x), cy=up(y), r=3.5) for x, y in zip(law.x, law.rest, strict=True))]
    said = title or f"Torque of the finding against {law.driver}, and what the recordings leave for it"
    return svg_image(WIDTH, bottom + 40, said, parts, "law")


def _curves(lines: Mapping[str, Sequence[Ends]], across: Scale, up: Scale, styles: Mapping[str, int]) -> list[Markup]:
    """Lines with dots and their names at the end, names kept apart."""
    parts, free = [], np.inf
    for name, points in sorted(lines.items(), key=lambda item: -up(item[1][-1][1])):
        at = [(across(x), up(y)) for x, y in points]
        free = min(at[-1][1] + 4, free - 14)
        parts += [tag("polyline", class_=f"m{styles[name]}", points=" ".join(f"{x:.1f},{y:.1f}" for x, y in at)),
                  *(_dot(styles[name], x, y, 4) for x, y in at), words(name, at[-1][0] + 12, free)]
    return parts


def reliability(covered: Mapping[str, Mapping[str, Any]], styles: Mapping[str, int]) -> Markup:
    """Return the share of held-out torques inside each nominal interval, a line a model; on the diagonal the doubt is honest."""
    across, up = Scale(0, 100, 62, SQUARE), Scale(0, 100, SIZE, 10)
    lines = {name: [(float(level), 100 * share) for level, share in coverage["shares"].items()] for name, coverage in covered.items()}
    frame = x_axis(across, 10, SIZE, "promised [%]", 5) + y_axis(up, 62, SQUARE, "inside [%]")
    title = "Reliability: share of held-out torques inside the intervals, against the share that the intervals promise"
    return svg_image(SQUARE + 150, SIZE + 44, title, [frame, rule("floor", across(0), up(0), across(100), up(100)),
                                                          *_curves(lines, across, up, styles)], "square")


def over_count(title: str, counts: Sequence[int], errors: Mapping[str, Sequence[float | None]], styles: Mapping[str, int]) -> Markup:
    """Return error against the number of recordings fitted, both on logarithmic scales, a line a model."""
    across = Scale(log2(min(counts)) - 0.2, log2(max(counts)) + 0.2, 62, SQUARE)
    up = Scale.around(np.log10([100 * e for line in errors.values() for e in line if e]), SIZE, 10)
    frame = [rule("grid", 62, up(log10(v)), SQUARE, up(log10(v))) + words(f"{v:g}", 57, up(log10(v)) + 4, "tick", "end")
             for v in DECADES if up.low <= log10(v) <= up.high]
    frame += [words(str(n), across(log2(n)), SIZE + 15, "tick", "middle") for n in counts]
    frame += [words("recordings fitted", (62 + SQUARE) / 2, SIZE + 34, "label", "middle"), upright("error [%]", SIZE / 2)]
    lines = {name: [(log2(n), log10(100 * e)) for n, e in zip(counts, line, strict=True) if e] for name, line in errors.items()}
    return svg_image(SQUARE + 150, SIZE + 44, title, [*frame, *_curves(lines, across, up, styles)], "square")
