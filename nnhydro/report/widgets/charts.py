"""The small charts that only a page has: weights of alternatives, parameters with intervals."""

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from nnhydro.report.widgets.svg import Scale, rule, svg_image, tag, words

WIDTH, RIGHT = 760.0, 70.0
NAMES = 220.0  # where names end
Ends = tuple[float, float]


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
                  rule("m0 bar", scale(low), y, scale(high), y), tag("circle", class_="m0 dot", cx=scale(value), cy=y, r=5.0),
                  words(f"{value:.4g} ({low:.4g} to {high:.4g}) {'' if unit == '1' else unit}", WIDTH - 270, y + 4, "value")]
    return svg_image(WIDTH, 30 * len(rows) + 8, title, parts, "intervals")
