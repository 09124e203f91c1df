"""A figure on disk and in a page: one drawing as PNG, as SVG and in HTML, and beside the files a CSV of exactly what is drawn."""

import csv
import re
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zlib import crc32

import numpy as np
from markupsafe import Markup, escape

from nnhydro.runtime.files import write_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

KINDS = (".png", ".svg")
DPI = 130  # dots per inch
SVG: dict[Any, Any] = {"svg.hashsalt": "nnhydro", "svg.fonttype": "none"}  # same figure, same file; its text stays text
# a page's colours follow its theme: ink, the models' and the grid's
THEME = {"#111111": "currentColor", "#000000": "currentColor", "#d55e00": "var(--c0)", "#0072b2": "var(--c1)", "#009e73": "var(--c2)",
         "#cccccc": "var(--line)", "#ebebeb": "var(--grid)"}
HEAD = ("panel", "x_label", "y_label", "series", "x", "y", "value")


def new_figure(width: float, height: float) -> "Figure":
    """Return an empty figure of width x height inches that needs no screen."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _rows(number: int, axes: "Axes") -> list[tuple[object, ...]]:
    """Every line, bar and filled cell of one panel, a row a point."""
    from matplotlib.collections import QuadMesh
    from matplotlib.container import BarContainer

    place = (number, axes.get_xlabel(), axes.get_ylabel())
    series = [(str(line.get_label()), np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float))
              for line in axes.lines]
    series += [(str(bars.get_label()), np.array([bar.get_x() + bar.get_width() / 2 for bar in bars]),
                np.array([bar.get_height() for bar in bars])) for bars in axes.containers if isinstance(bars, BarContainer)]
    rows: list[tuple[object, ...]] = [(*place, "" if name.startswith("_") else name, f"{a:.9g}", f"{b:.9g}", "") for name, x, y in series
                                      for a, b in zip(x, y, strict=True)]
    for mesh in (artist for artist in axes.collections if isinstance(artist, QuadMesh) and place[1]):  # a colour bar is no panel of its own
        rows += [(*place, str(mesh.get_label()), f"{a:.9g}", f"{b:.9g}", f"{c:.9g}") for a, b, c in _cells(mesh)]
    return rows


def _cells(mesh: "QuadMesh") -> list[tuple[float, float, float]]:
    """Middle and value of every cell that is filled."""
    corners = np.asarray(mesh.get_coordinates())
    middle = (corners[1:, 1:] + corners[:-1, :-1]) / 2
    values = np.ma.filled(np.ma.asarray(mesh.get_array(), dtype=float), np.nan).reshape(middle.shape[:2])
    return [(float(middle[k][0]), float(middle[k][1]), float(values[k])) for k in np.ndindex(values.shape) if np.isfinite(values[k])]


def figure_csv(figure: "Figure") -> str:
    """Return what the figure draws as CSV: panel (from 1), labels of its axes, series, x, y; of a map's cells the value too."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEAD)
    for number, axes in enumerate(figure.axes, 1):
        writer.writerows(_rows(number, axes))
    return text.getvalue()


def paths_of(stem: Path) -> list[Path]:
    """Return the files that `save_figure` writes, the picture first."""
    return [stem.with_suffix(kind) for kind in (*KINDS, ".csv")]


def save_figure(figure: "Figure", stem: Path) -> list[Path]:
    """Write the figure as `stem`.png, .svg and .csv, each whole or not at all; returns the paths, the picture first."""
    from matplotlib import rc_context

    layout, texts = figure.get_layout_engine(), dict[Path, bytes]()
    figure.set_dpi(DPI)
    if layout is not None:  # found once, and not by a drawing of its own: finding it takes most of the time
        layout.execute(figure)
        figure.set_layout_engine(None)
    for kind in KINDS:
        drawn = BytesIO()
        with rc_context(SVG):
            figure.savefig(drawn, dpi=DPI, format=kind[1:], metadata={"Date": None} if kind == ".svg" else None)
        texts[stem.with_suffix(kind)] = drawn.getvalue()
    texts[stem.with_suffix(".csv")] = figure_csv(figure).encode()
    for path, content in texts.items():
        write_bytes(path, content)
    return list(texts)


def page_figure(figure: "Figure", title: str) -> Markup:
    """Return the figure as an element of a page, called `title` by screen readers: the same drawing in the colours of its theme."""
    from matplotlib import rc_context

    made = BytesIO()
    with rc_context(SVG):
        figure.savefig(made, format="svg", transparent=True, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = made.getvalue().decode("utf-8")
    inside = re.sub(r"<defs>\s*<style.*?</defs>", "", text[text.index(">", text.index("<svg")) + 1:], count=1, flags=re.DOTALL)
    inside, key = re.sub(r'<g id="[^"]*"', "<g", inside), f"f{crc32(title.encode()):x}"
    for pattern in (r'(\bid=")', r"(url\(#)", r'(href="#)'):  # an id stands once in a page
        inside = re.sub(pattern, rf"\1{key}", inside)
    inside = re.sub("|".join(THEME), lambda found: THEME[found[0]], inside)
    width, height = figure.get_size_inches() * 72
    return Markup(f'<svg class="figure" viewBox="0 0 {width:.0f} {height:.0f}" width="{width / 0.75:.0f}" role="img" '
                  f'aria-label="{escape(title)}" xmlns:xlink="http://www.w3.org/1999/xlink">{inside}')
