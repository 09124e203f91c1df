"""Pictures of the reproduction of McLain & Rock (1998), numbered as in the paper; lines differ in dash as well as colour."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from nnhydro.evaluation.mclain.reproduce import IMPLIED, TRAVELS, McLainReproduction
from nnhydro.physics.coefficients import aspect_ratio
from nnhydro.physics.motion import tensor
from nnhydro.report.figure_file import new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
INK = "#111111"
# Okabe and Ito's colour-blind safe palette, each with a dash of its own
STYLES: Final[dict[str, dict[str, Any]]] = {
    "Levesque & Richard": {"color": "#0072B2", "linestyle": (0, (1, 1.5)), "linewidth": 1.6},
    "textbook": {"color": "#009E73", "linestyle": (0, (5, 2)), "linewidth": 1.4},
    "fitted constants": {"color": "#E69F00", "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.6},
    "state-dependent": {"color": "#D55E00", "linestyle": "-", "linewidth": 1.8},
}
LABELS: Final = {"Levesque & Richard": "Levesque & Richard: $C_D$ 1.1, $C_M$ 0", "textbook": "textbook: $C_D$ 1.2, $C_M$ 1",
                 "fitted constants": "fitted constants", "state-dependent": "state-dependent, identified"}
QUOTED: Final = {"C_D": ((0.0, 3.7, 8.0), (0.0, 1.0, 0.78)), "C_M": ((0.0, 4.2, 8.0), (1.0, 0.2, 0.36))}
MEASURED = f"“measured”: curves of the text + {100 * IMPLIED:.1f} % deviation"


def _coefficient_axes(figure: "Figure") -> dict[str, "Axes"]:
    """Two axes, C_D and C_M over the travel, scaled as in the paper."""
    axes = dict(zip(("C_D", "C_M"), figure.subplots(1, 2), strict=True))
    for name, ax in axes.items():
        ax.set(xlabel="travel $s/D$ [diameters]", ylabel=f"${name[0]}_{name[2]}$ [-]", xlim=(0, TRAVELS[-1]),
               ylim=(0, 1.2) if name == "C_D" else (-0.1, 1.1))
        ax.grid(color="0.92")
    axes["C_D"].set_title("drag coefficient", fontsize=10)
    axes["C_M"].set_title("added-mass coefficient", fontsize=10)
    return axes


def curves(result: McLainReproduction, stem: Path) -> list[Path]:
    """Figure 7: the identified curves with their 95 % bands, three groups of four slews and the values the text quotes."""
    from nnhydro.physics.travel.state_model import added_mass_curve, drag_curve

    figure = new_figure(9.5, 4.2)
    axes, s = _coefficient_axes(figure), tensor(TRAVELS)
    for name, ax in axes.items():
        low, high = result.bands[name]
        ax.fill_between(TRAVELS, low, high, color="0.85", label="95 % over motions")
        ax.plot(TRAVELS, result.curves[name], **STYLES["state-dependent"], label="identified from twelve slews")
        curve = drag_curve if name == "C_D" else added_mass_curve
        for k, group in enumerate(result.groups):
            every = slice(6 + 2 * k, None, 12)
            ax.plot(TRAVELS[every], curve(group.loads, s).numpy()[every], "+", color=INK, markersize=6, markeredgewidth=0.9,
                    label="three groups of four slews" if k == 0 else None)
        ax.plot(*QUOTED[name], "o", color="white", markeredgecolor=INK, markersize=7, label="quoted in the paper's text")
    figure.legend(*axes["C_D"].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8.5)
    return save_figure(figure, stem)


def slews(result: McLainReproduction, stem: Path) -> list[Path]:
    """Figures 9 to 11: the torque of three slews and four models."""
    figure = new_figure(11, 4.2)
    for ax, slew, number in zip(figure.subplots(1, 3), result.slews, (9, 10, 11), strict=True):
        ax.plot(slew.t, -slew.measured, color="0.78", linewidth=3.4, label=MEASURED)
        for name, tau in slew.models.items():
            ax.plot(slew.t, -tau, **STYLES[name], label=LABELS[name])
        ax.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
        ax.set(xlabel="time [s]", ylabel="torque of the water on the arm [N m]", xlim=(0, slew.t[-1]))
        ax.set_title(f"figure {number}: {slew.degrees:g}° in {slew.t[-1]:g} s", fontsize=10)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8.5)
    return save_figure(figure, stem)


def errors(result: McLainReproduction, stem: Path) -> list[Path]:
    """The pooled errors as bars: curves of the text as the truth, and with the deviation that the paper's claim implies."""
    figure = new_figure(7.5, 3.8)
    ax = figure.subplots()
    names = list(result.errors)
    place = np.arange(len(names))
    light: dict[str, Any] = {"color": "0.75", "label": "the text's curves are the truth"}
    dark: dict[str, Any] = {"color": "0.35", "hatch": "//", "edgecolor": "white", "label": f"with {100 * IMPLIED:.1f} % deviation"}
    for shift, values, style in ((-0.2, result.errors, light), (0.2, result.errors_measured, dark)):
        bars = ax.bar(place + shift, [100 * values[name] for name in names], 0.38, **style)
        ax.bar_label(bars, fmt="%.1f", fontsize=8.5, padding=2)
    ax.set_xticks(place, names)
    ax.set(ylabel="pooled error $\\Sigma|\\Delta\\tau| / \\Sigma|\\tau|$ [%]", ylim=(0, 62))
    ax.legend(frameon=False, fontsize=9)
    return save_figure(figure, stem)


def segments(result: McLainReproduction, stem: Path) -> list[Path]:
    """Figure 12: the error against the number of segments."""
    figure = new_figure(6.5, 3.8)
    ax = figure.subplots()
    n = list(result.segments)
    ax.plot(n, [100 * result.segments[k][1] for k in n], "s-", color=INK, label=f"with {100 * IMPLIED:.1f} % deviation: level from 4 on")
    ax.plot(n, [100 * result.segments[k][0] for k in n], "o--", color="#0072B2", label="segmentation alone")
    ax.axvline(4, color="0.7", linewidth=1, linestyle=":")
    ax.set(xlabel="number of equal segments [-]", ylabel="pooled error [%]", yscale="log", xlim=(0.5, 20.5))
    ax.set_yticks([0.1, 0.3, 1, 3, 10, 30], ["0.1", "0.3", "1", "3", "10", "30"])
    ax.set_xticks([1, 2, 3, 4, 5, 6, 8, 10, 15, 20])
    ax.grid(color="0.92", which="major")
    ax.legend(frameon=False, fontsize=9)
    return save_figure(figure, stem)


def slenderness(result: McLainReproduction, stem: Path) -> list[Path]:
    """Figure 13: the effective drag coefficient of a steady rotation against L/D."""
    figure = new_figure(6.5, 3.8)
    ax = figure.subplots()
    x = list(result.slenderness)
    ax.plot(x, [result.slenderness[k][1] for k in x], "s-", color=INK, label="curves x finite-span law, fixed at L/D = 9.15")
    ax.plot(x, [result.slenderness[k][0] for k in x], "--", color="0.5", label="curves alone: know no span")
    at, values = zip(*aspect_ratio.C_D[:-1], strict=True)
    ax.plot(at, values, "o", color="white", markeredgecolor="#0072B2", label="Wieselsberger 1922, two free ends, towed")
    ax.axhline(1.2, color="0.7", linewidth=1, linestyle=":", label="1.2: infinite cylinder")
    ax.set(xlabel="slenderness $L/D$ [-]", ylabel="effective $C_D = 8T/(\\rho D L^4 \\omega^2)$ [-]", xscale="log", ylim=(0.5, 1.3))
    ax.set_xticks([2, 5, 10, 20, 50, 100, 1000], ["2", "5", "10", "20", "50", "100", "1000"])
    ax.axvspan(5, 15, color="0.95", zorder=0)
    ax.text(5.2, 0.53, "manipulators", fontsize=8.5, color="0.35")
    ax.legend(frameon=False, fontsize=8.5, loc="upper left")
    return save_figure(figure, stem)


def profile(result: McLainReproduction, stem: Path) -> list[Path]:
    """The residual against the travel scale: why one start is not enough."""
    figure = new_figure(6.5, 3.6)
    ax = figure.subplots()
    for k, fit in enumerate((result.fit, *result.groups)):
        style: dict[str, Any] = {"color": INK, "label": "twelve slews"} if k == 0 else {"color": "0.6", "linestyle": "--"}
        if k == 1:
            style["label"] = "groups of four"
        energy = np.sqrt(fit.search.profile / fit.search.energy)
        ax.plot(fit.search.grid[0], 100 * (energy - 1), **style)
        ax.plot(fit.tau_s[0], 0.0, "v", color=style["color"])
    ax.set(xlabel="travel scale $\\tau_s$ [diameters]", ylabel="rms residual above the best [%]", ylim=(-0.3, 12))
    ax.legend(frameon=False, fontsize=9)
    return save_figure(figure, stem)


FIGURES: Final[dict[str, Callable[[McLainReproduction, Path], list[Path]]]] = {
    "figure_7_curves": curves, "figures_9_to_11_slews": slews, "errors": errors, "figure_12_segments": segments,
    "figure_13_slenderness": slenderness, "travel_scale_profile": profile}


def write_figures(result: McLainReproduction, folder: Path) -> list[Path]:
    """Write every figure into `folder`, as PNG and SVG with its data, and return the paths."""
    return [path for name, draw in FIGURES.items() for path in draw(result, folder / name)]
