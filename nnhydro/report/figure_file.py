"""A figure on disk: the same picture as PNG and SVG, and beside them a CSV of exactly what is drawn."""

import csv
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from nnhydro.runtime.files import write_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

KINDS = (".png", ".svg")
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

    written = []
    for kind in KINDS:
        path = stem.with_suffix(kind)
        temporary = path.with_name(f".{path.name}")
        with rc_context({"svg.hashsalt": "nnhydro", "svg.fonttype": "none"}):  # same figure, same file; its text stays text
            figure.savefig(temporary, dpi=130, format=kind[1:], metadata={"Date": None} if kind == ".svg" else None)
        temporary.replace(path)
        written.append(path)
        figure.set_layout_engine(None)  # the layout stays as it was found for the first kind: finding it takes most of the time
    write_text(stem.with_suffix(".csv"), figure_csv(figure))
    return [*written, stem.with_suffix(".csv")]
