"""Effective gains as a figure, a table and a sentence."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import joint_text
from nnhydro.models.gains.sweeps import Sweep
from nnhydro.report.figure_file import new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STYLES: dict[str, dict[str, Any]] = {
    "model": {"color": "#111111", "linestyle": "-", "linewidth": 1.9, "zorder": 3},
    "baseline": {"color": "#D55E00", "linestyle": (0, (5, 2)), "linewidth": 1.5},
    "textbook": {"color": "#0072B2", "linestyle": (0, (1, 1.2)), "linewidth": 1.7},
    "dry arm": {"color": "#777777", "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.2},
}
AXIS = {"speed_rad_s": "speed of joint {} [rad/s]", "angle_rad": "angle of joint {} [rad]"}
USUAL = 0.97  # of the values are no larger than what is usual
PEAK = 1.6  # times the height outside the narrow peak that dry friction makes at rest: taller peaks are cut off


def _panel(ax: "Axes", sweep: Sweep, quantity: str, name: str) -> None:
    """One quantity, `damping` or `inertia`, of all models along a sweep."""
    for label, style in STYLES.items():
        if label in sweep.gains and not (label == "dry arm" and quantity == "damping"):
            ax.plot(sweep.values, getattr(sweep, quantity)(label), label=name if label == "model" else label, **style)
    unit = "N m s/rad" if quantity == "damping" else "kg m²"
    ax.set_ylabel(f"effective {quantity} {sweep.joint + 1} [{unit}]")
    moving = sweep.joint + 1 if sweep.over == "speed_rad_s" else sweep.states.q.shape[1]
    ax.set_xlabel(AXIS[sweep.over].format(moving))
    ax.margins(x=0)
    ax.grid(color="0.92")
    _limit(ax, [line.get_ydata() for line in ax.lines], quantity)


def _usual(values: NDArray[np.float64]) -> float:
    """The largest of the sorted values (n,) but for a narrow peak."""
    return float(values[int(USUAL * (len(values) - 1))])


def _damping_text(sweep: Sweep, label: str, at: int) -> str:
    """The damping at row `at` of a sweep; at rest, the slope of dry friction is marked as such."""
    values = np.asarray(sweep.damping(label), dtype=float)
    peak = at == (len(values) - 1) // 2 and values[at] > PEAK * max(_usual(np.sort(values)), 0.0)
    return f"{values[at]:.4g}{' (slope of dry friction)' if peak else ''}"


def _limit(ax: "Axes", lines: Sequence[Any], quantity: str) -> None:
    """Show zero, and cut off the peak of dry friction at rest where it dwarfs the rest."""
    values: NDArray[np.float64] = np.sort(np.concatenate([np.asarray(line, dtype=float) for line in lines]))
    top, usual = float(values[-1]), _usual(values)
    low = min(0.0, float(values[0]))
    if quantity == "damping" and usual > 0 and top > PEAK * usual:
        ax.annotate(f"peak {top:.2g} at rest\n(dry friction) cut off", (0.47, 0.97), xycoords="axes fraction", ha="right", va="top",
                    fontsize=7)
        top = PEAK * usual
    ax.set_ylim(1.05 * low, 1.08 * top if top > low else 1.0)


def gain_figure(made: Sequence[Sweep], name: str, stem: Path, sliding: bool = False) -> list[Path]:
    """Draw the sweeps, one row per joint: damping and inertia over speed and, where there is an elbow, inertia over its angle.

    Of a linear axis (`sliding`) in its own units.
    """
    joints = max(sweep.joint for sweep in made) + 1
    panels = [[("speed_rad_s", "damping"), ("speed_rad_s", "inertia")] + [("angle_rad", "inertia")] * (joints > 1)] * joints
    figure = new_figure(4.1 * len(panels[0]), 2.9 * joints + 0.7)
    axes = figure.subplots(joints, len(panels[0]), squeeze=False)
    for joint, row in enumerate(panels):
        for ax, (over, quantity) in zip(axes[joint], row, strict=True):
            _panel(ax, next(sweep for sweep in made if sweep.joint == joint and sweep.over == over), quantity, name)
            ax.set(xlabel=joint_text(ax.get_xlabel(), sliding), ylabel=joint_text(ax.get_ylabel(), sliding))
    handles, labels = axes[0, 1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=4, frameon=False)
    return save_figure(figure, stem)


SHARES = (0.0, 0.25, 0.5, 1.0)  # of the greatest speed


def gain_rows(made: Sequence[Sweep]) -> tuple[list[str], list[list[str]]]:
    """Return the columns and rows of the table, one row per joint and speed; the slope of dry friction at rest is marked."""
    by_speed = [sweep for sweep in made if sweep.over == "speed_rad_s"]
    labels = list(by_speed[0].gains)
    wet = [label for label in labels if label != "dry arm"]
    columns = ["joint", "speed [rad/s]", *(f"damping, {label} [N m s/rad]" for label in wet), *(f"inertia, {x} [kg m²]" for x in labels)]
    rows = []
    for sweep in by_speed:
        middle = (len(sweep.values) - 1) // 2
        for share in SHARES:
            at = middle + round(share * middle)
            rows.append([str(sweep.joint + 1), f"{float(sweep.values[at]):.2f}", *(_damping_text(sweep, x, at) for x in wet),
                         *(f"{float(sweep.inertia(x)[at]):.4g}" for x in labels)])
    return columns, rows


def gain_verdict(made: Sequence[Sweep]) -> str:
    """Return damping and inertia of every joint at half its greatest speed, in one sentence."""
    parts = []
    for sweep in (sweep for sweep in made if sweep.over == "speed_rad_s"):
        middle = (len(sweep.values) - 1) // 2
        at, label = middle + round(0.5 * middle), next(iter(sweep.gains))
        parts.append(f"joint {sweep.joint + 1} has an effective damping of {float(sweep.damping(label)[at]):.3g} N m s/rad and an "
                     f"inertia of {float(sweep.inertia(label)[at]):.3g} kg m²")
    speed = float(made[0].values[-1]) / 2
    return f"At {speed:.3g} rad/s, {'; '.join(parts)}."
