"""The benchmark's pictures: measured against modelled torque for the worst, the median and the best recording, and the errors.

Lines differ in dash and width as well as in colour, so that they can be told apart in grey and by colour-blind readers.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nnhydro.evaluation.benchmark import Benchmark, modelled
from nnhydro.recordings.segment import Segment

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
INK = "#111111"
# Okabe and Ito's colour-blind safe palette, darkest first, each with a dash of its own
STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#D55E00", "linestyle": "-", "linewidth": 1.3},
    {"color": "#0072B2", "linestyle": (0, (5, 2)), "linewidth": 1.3},
    {"color": "#009E73", "linestyle": (0, (1, 1.2)), "linewidth": 1.6},
)


def _figure(width: float, height: float) -> "Figure":
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _save(figure: "Figure", path: Path) -> Path:
    temporary = path.with_name(f".{path.name}")
    figure.savefig(temporary, dpi=130, format=path.suffix.removeprefix("."))
    temporary.replace(path)
    return path


def told_recordings(result: Benchmark, by: str) -> dict[str, str]:
    """Return {"worst", "median", "best": recording} by the error of the model `by`, over recordings that were held out."""
    steady = {unit.name for unit in result.units if unit.steady}
    misfit = result.standings[by].misfit
    ranked = sorted((name for name in misfit if name not in steady), key=lambda name: misfit[name].error, reverse=True)
    if not ranked:
        return {}
    chosen = {"worst": ranked[0], "median": ranked[len(ranked) // 2], "best": ranked[-1]}
    return {label: name for label, name in chosen.items() if list(chosen.values()).index(name) == list(chosen).index(label)}


def shown_models(result: Benchmark) -> list[str]:
    """Return at most three models worth a line: the winner, the best physics baseline and the runner-up."""
    ranking = result.ranking()
    physics = [name for name in ranking if name not in ("network", "hybrid")]
    return list(dict.fromkeys([ranking[0], *physics[:1], *ranking[1:]]))[:3]


def _joint_panels(figure: "Figure", segment: Segment, lines: dict[str, Array]) -> None:
    """Two panels a joint: torques above, what the models leave below."""
    assert segment.tau is not None
    joints = segment.n_links
    axes = figure.subplots(2 * joints, 1, sharex=True, height_ratios=[3, 1.4] * joints, squeeze=False)[:, 0]
    for joint in range(joints):
        above, below = axes[2 * joint], axes[2 * joint + 1]
        above.plot(segment.t, segment.tau[:, joint], color=INK, linewidth=2.4, alpha=0.75, label="measured")
        for (name, tau), style in zip(lines.items(), STYLES, strict=False):
            above.plot(segment.t, tau[:, joint], label=name, **style)
            below.plot(segment.t, (segment.tau - tau)[:, joint], **style)
        above.set_ylabel(f"torque {joint + 1} [N m]")
        below.set_ylabel("residual\n[N m]")
        below.axhline(0, color=INK, linewidth=0.6)
        _shade_ends(above, segment)
        _shade_ends(below, segment)
    axes[0].legend(ncols=4, loc="lower left", bbox_to_anchor=(0, 1.0), frameon=False)
    axes[-1].set_xlabel("time [s]" if not segment.steady else "run")


def _shade_ends(axes: "Axes", segment: Segment) -> None:
    """Grey the ends that the filter touches and the comparison leaves out."""
    kept = np.flatnonzero(segment.keep)
    if len(kept):
        axes.axvspan(segment.t[0], segment.t[kept[0]], color="#000000", alpha=0.06, linewidth=0)
        axes.axvspan(segment.t[kept[-1]], segment.t[-1], color="#000000", alpha=0.06, linewidth=0)
    axes.margins(x=0)


def torque_history(result: Benchmark, recording: str, label: str, models: Sequence[str], path: Path) -> Path:
    """Draw measured and held-out modelled torque of one recording to `path` (PNG or SVG)."""
    index = next(i for i, unit in enumerate(result.units) if unit.name == recording)
    fold = next(k for k, held_out in enumerate(result.folds) if index in held_out)
    segment = max(result.units[index].segments(), key=len)
    standings = {name: result.standings[name] for name in models}
    lines = {f"{name} ({100 * s.misfit[recording].error:.1f} %)": modelled(s.models[fold], segment) for name, s in standings.items()}
    figure = _figure(9.0, 2.6 * segment.n_links + 1.4)
    _joint_panels(figure, segment, lines)
    low_pass = segment.low_pass
    filtered = "" if low_pass is None else f"; all curves low-passed at {low_pass.cutoff_hz:g} Hz, shaded ends not compared"
    figure.suptitle(f"{label} held-out recording: {recording}{filtered}", x=0.01, ha="left", fontsize=10)
    return _save(figure, path)


def error_chart(result: Benchmark, path: Path) -> Path:
    """Draw each model's pooled error with its interval, the best on top, and the noise floor."""
    document = result.document()["models"]
    names = result.ranking()[::-1]
    figure = _figure(7.5, 0.42 * len(names) + 1.5)
    axes = figure.subplots()
    for row, name in enumerate(names):
        low, high = (100 * x for x in document[name]["error_ci95"])
        axes.plot([low, high], [row, row], color=INK, linewidth=1.5)
        axes.plot([100 * document[name]["error"]], [row], "o", color=INK, markersize=7)
        axes.annotate(f"{100 * document[name]['error']:.1f} %", (high, row), xytext=(8, 0), textcoords="offset points", va="center")
    if result.noise_floor is not None:
        axes.axvline(100 * result.noise_floor, color="#0072B2", linestyle="--", linewidth=1.2)
        axes.annotate("noise floor", (100 * result.noise_floor, len(names) - 0.45), xytext=(4, 0), textcoords="offset points",
                      color="#0072B2")
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(-0.6, len(names) - 0.2)
    axes.set_xlim(left=0)
    axes.margins(x=0.15)
    axes.set_xlabel("error on held-out recordings: sum |measured - modelled| / sum |measured|  [%]")
    axes.spines[["top", "right"]].set_visible(False)
    return _save(figure, path)


def benchmark_figures(result: Benchmark, out: Path) -> list[Path]:
    """Draw every picture of a benchmark into the folder `out`; returns their paths."""
    paths = [error_chart(result, out / "errors.png")]
    models = shown_models(result)
    for label, recording in told_recordings(result, models[0]).items():
        paths.append(torque_history(result, recording, label, models, out / f"torque_{label}.png"))
    return paths
