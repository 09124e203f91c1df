"""A figure on disk and in a page: one drawing as PNG, as SVG and in HTML, and beside the files a CSV of exactly what is drawn."""

import csv
import re
from functools import cache
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from zlib import crc32

import numpy as np
from markupsafe import Markup

from nnhydro.report.widgets.svg import tag
from nnhydro.runtime.files import write_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

KINDS = (".png", ".svg")
DPI = 130  # dots per inch
SVG: dict[Any, Any] = {"svg.hashsalt": "nnhydro", "svg.fonttype": "none"}  # same figure, same file; its text stays text
INK, GRID = "#111111", "#ebebeb"
# Okabe and Ito's colour-blind safe palette, darkest first, then further dark hues; each with a dash of its own
STYLES: tuple[dict[str, Any], ...] = tuple(
    {"color": color, "linestyle": "-" if dash is None else (0, dash), "linewidth": width} for color, dash, width in (
        ("#D55E00", None, 1.3), ("#0072B2", (5, 2), 1.3), ("#009E73", (1, 1.2), 1.6), ("#A3467F", (7, 2, 1.5, 2), 1.3),
        ("#7A5C00", (4, 1.5), 1.3), ("#5340A8", (9, 3), 1.3), ("#0B7D8C", (2, 1.5), 1.3), ("#8A3324", (7, 1.5, 1.5, 1.5, 1.5, 1.5), 1.3),
        ("#4D4D4D", (1, 1), 1.3)))
MARKS: tuple[dict[str, Any], ...] = tuple(
    {"color": style["color"], "linestyle": "", "marker": marker, "markersize": 6, "fillstyle": "none"}
    for style, marker in zip(STYLES, "x+1s^D<>p", strict=True))
MEASURED_LINE: dict[str, Any] = {"color": INK, "linewidth": 2.4, "alpha": 0.75}
MEASURED_MARK: dict[str, Any] = {"color": INK, "linestyle": "", "marker": "o", "markersize": 7, "fillstyle": "none"}
# a page's colours follow its theme: ink, the models' and the grid's
THEME = {INK: "currentColor", "#000000": "currentColor", "#cccccc": "var(--line)", GRID: "var(--grid)",
         **{style["color"].lower(): f"var(--c{number})" for number, style in enumerate(STYLES)}}
CURVE, LEGEND = "curve", "legend"  # an artist's id in a figure: this, a number and the name of its series
POINT = 10  # steps to a point of 1/72 inch, of the curves of a page
HEAD = ("panel", "x_label", "y_label", "series", "x", "y", "value")


def stroke(number: int) -> str:
    """Return the line style `number` as a style of a page's own line."""
    dash = "none" if STYLES[number]["linestyle"] == "-" else " ".join(f"{STYLES[number]['linewidth'] * x / 0.75:.3g}"
                                                                       for x in STYLES[number]["linestyle"][1])
    return f"stroke: var(--c{number}); stroke-dasharray: {dash}"


def new_figure(width: float, height: float, layout: Literal["constrained"] | None = "constrained") -> "Figure":
    """Return an empty figure of width x height inches that needs no screen; `layout` None leaves its axes where they are put."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure


def _rows(number: int, axes: "Axes") -> list[tuple[object, ...]]:
    """Every line, bar and filled cell of one panel, one row per point."""
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


@cache
def _step(tenths: int) -> str:
    """A step of 1/POINT point as short text."""
    text = f"{tenths / POINT:g}"
    return text.replace("0.", ".") if abs(tenths) < POINT else text


def _short_path(found: re.Match[str]) -> str:
    """The lines of a path as steps of 1/POINT point from corner to corner: a third of the characters."""
    parts = []
    for line in found[1].split("M")[1:]:
        corners = np.rint(np.fromstring(line.replace("L", " "), sep=" ").reshape(-1, 2) * POINT).astype(int)
        steps = " ".join(map(_step, np.diff(corners, axis=0).ravel().tolist()))
        parts.append(f"M{_step(int(corners[0][0]))} {_step(int(corners[0][1]))}l{steps}".replace(" -", "-"))
    return f'd="{"".join(parts)}"'


def _short_marks(found: re.Match[str]) -> str:
    """The marks of a series with their style once, at places of 1/POINT point."""
    style = re.search(r' style="[^"]*"', found[2])
    places = re.sub(r' style="[^"]*"|(?<=\.\d)\d+(?=")', "", found[2])
    return f"<g{found[1]}{style[0] if style else ''}>{places}</g>"


def _short(inside: str) -> str:
    """Less text for the same drawing: no comments, no list of fonts (the page's is inherited), paths and marks by short numbers."""
    inside = re.sub(r'd="(M[ML\d\s.-]+)"', _short_path, inside)
    inside = re.sub(r"<!--.*?-->|font-family: [^;\"]*; ?| transform=\"rotate\(-0 [^\"]*\"", "", inside)
    return re.sub(r"<g([^>]*)>((?:<use [^>]*/>)+)</g>", _short_marks, re.sub(r">\s+<", "><", inside))


def page_figure(figure: "Figure", title: str, kind: str = "", **attributes: Any) -> Markup:
    """Return the figure as an element of a page, called `title` by screen readers: the same drawing in the colours of its theme.

    A curve or legend entry with an id of CURVE or LEGEND carries its series, which the page's switches hide, and its panel (from 0).
    """
    from matplotlib import rc_context

    made = BytesIO()
    with rc_context(SVG):
        figure.savefig(made, format="svg", transparent=True, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = made.getvalue().decode("utf-8")
    inside = _short(re.sub(r"<defs>\s*<style.*?</defs>", "", text[text.index(">", text.index("<svg")) + 1:text.rindex("</svg>")], count=1,
                           flags=re.DOTALL))
    inside = re.sub(rf'<g id="({CURVE}|{LEGEND})(\d+):([^"]*)"', r'<g data-\1="\2" data-series="\3"', inside)
    inside, key = re.sub(r'<g id="[^"]*"', "<g", inside).replace("xlink:href=", "href="), f"f{crc32(title.encode()):x}"
    names = {name: f"{key}{number}" for number, name in enumerate(dict.fromkeys(re.findall(r'\bid="([^"]+)"', inside)))}
    inside = re.sub(r'(\bid="|url\(#|href="#)([^")]+)', lambda found: found[1] + names[found[2]], inside)  # an id stands once in a page
    inside = re.sub("#[0-9a-f]{6}", lambda found: THEME.get(found[0], found[0]), inside)
    width, height = figure.get_size_inches() * 72
    return tag("svg", Markup(inside), class_=f"figure {kind}".strip(), viewBox=f"0 0 {width:.0f} {height:.0f}", width=round(width / 0.75),
               role="img", aria_label=title, **attributes)
