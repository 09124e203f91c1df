"""Small pieces of SVG, and the bars and intervals that only a page has.

Colours come from the page's style, which knows the theme.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ends = tuple[float, float]
WIDTH, RIGHT = 760.0, 70.0  # of bars and intervals
NAMES = 220.0  # where names end


def tag(name: str, *inside: Any, **attributes: Any) -> Markup:
    """Return an element; `class_` stands for class, `_` in other names for a hyphen; everything is escaped, numbers are rounded to 0.1."""
    written = [f' {key.rstrip("_").replace("_", "-")}="{escape(f"{value:.5g}" if isinstance(value, float) else value)}"'
               for key, value in attributes.items() if value is not None]
    content = "".join(str(escape(part)) for part in inside)
    return Markup(f"<{name}{''.join(written)}>{content}</{name}>" if inside else f"<{name}{''.join(written)}/>")


def words(text: str, x: float, y: float, kind: str = "name", anchor: str = "start", **more: Any) -> Markup:
    """Return text that starts (or ends, or has its middle) at x."""
    return tag("text", text, class_=kind, x=x, y=y, text_anchor=anchor, **more)


def rule(kind: str, x1: float, y1: float, x2: float, y2: float) -> Markup:
    """Return a straight line."""
    return tag("line", class_=kind, x1=x1, y1=y1, x2=x2, y2=y2)


def around(values: Array, zero: bool = False) -> Ends:
    """Return limits that hold all finite `values` with a little room, and zero where asked."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    if zero:
        low, high = min(low, 0.0), max(high, 0.0)
    room = 0.05 * (high - low) or 0.5 * abs(high) or 1.0
    return low - room, high + room


@final
@dataclass(frozen=True)
class Scale:
    """From values low..high to pixels start..stop."""

    low: float
    high: float
    start: float
    stop: float

    def __call__(self, value: float) -> float:
        return self.start + (value - self.low) / (self.high - self.low) * (self.stop - self.start)


def svg_image(width: float, height: float, title: str, parts: Sequence[Markup], kind: str, **more: Any) -> Markup:
    """Return a whole picture that a screen reader calls `title`."""
    return tag("svg", *parts, class_=kind, viewBox=f"0 0 {width:.0f} {height:.0f}", role="img", aria_label=title, **more)


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
        scale, y = Scale(*around(np.array([value, low, high]), zero=True), NAMES + 10, WIDTH - 280), 18.0 + 30 * k
        parts += [words(name, NAMES, y + 4, anchor="end"), rule("axis", scale(0.0), y - 10, scale(0.0), y + 10),
                  rule("m0 bar", scale(low), y, scale(high), y), tag("circle", class_="m0 dot", cx=scale(value), cy=y, r=5.0),
                  words(f"{value:.4g} ({low:.4g} to {high:.4g}) {'' if unit == '1' else unit}", WIDTH - 270, y + 4, "value")]
    return svg_image(WIDTH, 30 * len(rows) + 8, title, parts, "intervals")
