"""Small pieces of SVG: scales with round ticks, lines as compact paths, axes, and the bars and intervals that only a page has.

Colours come from the page's style, which knows the theme.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import Any, final

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ends = tuple[float, float]
WIDTH, RIGHT = 760.0, 70.0  # of bars and intervals
NAMES = 220.0  # where names end
FINE = 2  # a path is drawn on a grid of 1/FINE pixel


def tag(name: str, *inside: Any, **attributes: Any) -> Markup:
    """Return an element; `class_` stands for class, `_` in other names for a hyphen; everything is escaped, numbers are rounded to 0.1."""
    written = [f' {key.rstrip("_").replace("_", "-")}="{escape(f"{value:.5g}" if isinstance(value, float) else value)}"'
               for key, value in attributes.items() if value is not None]
    content = "".join(str(escape(part)) for part in inside)
    return Markup(f"<{name}{''.join(written)}>{content}</{name}>" if inside else f"<{name}{''.join(written)}/>")


def join(parts: Sequence[Markup]) -> Markup:
    """Return the parts one after the other."""
    return Markup("").join(parts)


def words(text: str, x: float, y: float, kind: str = "name", anchor: str = "start", **more: Any) -> Markup:
    """Return text that starts (or ends, or has its middle) at x."""
    return tag("text", text, class_=kind, x=x, y=y, text_anchor=anchor, **more)


def rule(kind: str, x1: float, y1: float, x2: float, y2: float) -> Markup:
    """Return a straight line."""
    return tag("line", class_=kind, x1=x1, y1=y1, x2=x2, y2=y2)


def round_step(span: float, about: int) -> float:
    """Return 1, 2 or 5 times a power of ten so that `span` holds at most `about` steps."""
    raw = span / max(about, 1)
    power = 10.0 ** floor(log10(raw))
    return next(m * power for m in (1, 2, 5, 10) if m * power >= raw * (1 - 1e-9))


@final
@dataclass(frozen=True)
class Scale:
    """From values low..high to pixels start..stop."""

    low: float
    high: float
    start: float
    stop: float

    @staticmethod
    def around(values: Array, start: float, stop: float, zero: bool = False) -> "Scale":
        """Return a scale that holds all finite `values` with a little room, and zero where asked."""
        finite = values[np.isfinite(values)]
        low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
        if zero:
            low, high = min(low, 0.0), max(high, 0.0)
        room = 0.05 * (high - low) or 0.5 * abs(high) or 1.0
        return Scale(low - room, high + room, start, stop)

    def __call__(self, value: float) -> float:
        return self.start + (value - self.low) / (self.high - self.low) * (self.stop - self.start)

    def pixels(self, values: Array) -> Array:
        """Return `values` in pixels."""
        return self.start + (values - self.low) / (self.high - self.low) * (self.stop - self.start)

    def ticks(self, about: int = 5) -> list[float]:
        """Return round values within the scale."""
        step = round_step(self.high - self.low, about)
        return [k * step for k in range(ceil(self.low / step - 1e-9), floor(self.high / step + 1e-9) + 1)]


def thin(x: Array, y: Array, most: int) -> tuple[Array, Array]:
    """Return at most `most` points of a curve: lowest and highest of every stretch, so that no peak is lost."""
    if len(x) <= most:
        return x, y
    edges = np.linspace(0, len(x), max(most // 2, 1) + 1).astype(int)
    first, last = edges[:-1], edges[1:] - 1
    stretches = y[np.minimum(first[:, None] + np.arange((last - first).max() + 1), last[:, None])]  # a shorter one repeats its last point
    keep = np.unique(np.concatenate([first + stretches.argmin(axis=1), first + stretches.argmax(axis=1)]))
    return x[keep], y[keep]


def path(x: Array, y: Array) -> str:
    """Return the line through pixels (x, y) as path data on a grid of 1/FINE pixel: steps from point to point, whole numbers."""
    points = np.column_stack([np.rint(x * FINE), np.rint(y * FINE)]).astype(int)
    steps = np.diff(points, axis=0)
    moved = "".join(f"{dx}{'' if dy < 0 else ' '}{dy} " for dx, dy in steps.tolist()).rstrip()
    return f"M{points[0][0]} {points[0][1]}l{moved}" if len(steps) else f"M{points[0][0]} {points[0][1]}h1"


def number(value: float) -> str:
    """Return a tick's number without needless digits."""
    text = f"{value:.6g}"
    return "0" if text in ("-0", "0") else text.replace("-", "\N{MINUS SIGN}")


def y_axis(scale: Scale, left: float, right: float, label: str, about: int = 4) -> Markup:
    """Return grid lines, ticks and label of a vertical axis."""
    lines = [rule("grid", left, scale(v), right, scale(v)) + words(number(v), left - 5, scale(v) + 4, "tick", "end")
             for v in scale.ticks(about)]
    return join(lines) + upright(label, (scale.start + scale.stop) / 2)


def upright(label: str, middle: float) -> Markup:
    """Return the label of a vertical axis."""
    return tag("text", label, class_="label", transform=f"translate(13,{middle:.1f}) rotate(-90)", text_anchor="middle")


def x_axis(scale: Scale, top: float, bottom: float, label: str, about: int = 8) -> Markup:
    """Return grid lines, ticks and label of a horizontal axis."""
    lines = [rule("grid", scale(v), top, scale(v), bottom) + words(number(v), scale(v), bottom + 15, "tick", "middle")
             for v in scale.ticks(about)]
    return join(lines) + words(label, (scale.start + scale.stop) / 2, bottom + 32, "label", "middle")


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
        scale, y = Scale.around(np.array([value, low, high]), NAMES + 10, WIDTH - 280, zero=True), 18.0 + 30 * k
        parts += [words(name, NAMES, y + 4, anchor="end"), rule("axis", scale(0.0), y - 10, scale(0.0), y + 10),
                  rule("m0 bar", scale(low), y, scale(high), y), tag("circle", class_="m0 dot", cx=scale(value), cy=y, r=5.0),
                  words(f"{value:.4g} ({low:.4g} to {high:.4g}) {'' if unit == '1' else unit}", WIDTH - 270, y + 4, "value")]
    return svg_image(WIDTH, 30 * len(rows) + 8, title, parts, "intervals")
