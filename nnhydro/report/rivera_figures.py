"""Pictures of the study of Rivera's identifier; lines differ in dash and marker as well as colour."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from nnhydro.evaluation.reproduce_rivera import LAYERS, RiveraReproduction
from nnhydro.report.figure_file import new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ERROR = "error on held-out recordings [%]"
STYLES: Final[dict[str, dict[str, Any]]] = {
    "common": {"color": "#0072B2", "marker": "o", "linestyle": "-"}, "parallel": {"color": "#D55E00", "marker": "s", "linestyle": "--"}}
HATCHES: Final = {"common": "", "parallel": "//"}
UNITS: Final = {"qd": "N m s/rad", "qdd": "kg m$^2$"}
SYMBOLS: Final = {"qd": "\\dot q", "qdd": "\\ddot q"}


def _constant(ax: "Axes", result: RiveraReproduction) -> None:
    ax.axhline(100 * result.constant, color="0.5", linewidth=1, linestyle=":", label="fitted constants")
    ax.set_ylim(bottom=0)
    ax.grid(color="0.92", axis="y")
    ax.set_axisbelow(True)
    ax.legend(frameon=False, fontsize=9)


def inputs(result: RiveraReproduction, stem: Path) -> list[Path]:
    """The error of every input set with common and parallel layers."""
    figure = new_figure(9.0, 4.0)
    ax = figure.subplots()
    place = np.arange(len(result.inputs))
    for shift, kind in ((-0.2, "common"), (0.2, "parallel")):
        bars = ax.bar(place + shift, [100 * errors[kind] for errors in result.inputs.values()], 0.38, color=STYLES[kind]["color"],
                      hatch=HATCHES[kind], edgecolor="white", label=f"{kind} layers")
        ax.bar_label(bars, fmt="%.1f", fontsize=8, padding=2)
    ax.set_xticks(place, [name.replace(", ", ",\n") for name in result.inputs], fontsize=8.5)
    ax.set_ylabel(ERROR)
    _constant(ax, result)
    return save_figure(figure, stem)


def neurons(result: RiveraReproduction, stem: Path) -> list[Path]:
    """The error against the number of neurons."""
    figure = new_figure(6.0, 3.6)
    ax = figure.subplots()
    for kind in LAYERS:
        ax.plot(list(result.neurons), [100 * errors[kind] for errors in result.neurons.values()], label=f"{kind} layers", **STYLES[kind])
    ax.set(xlabel="tanh neurons [-]", ylabel=ERROR, xscale="log")
    ax.set_xticks(list(result.neurons), [str(n) for n in result.neurons])
    ax.minorticks_off()
    _constant(ax, result)
    return save_figure(figure, stem)


def training_set(result: RiveraReproduction, stem: Path) -> list[Path]:
    """The error against the size of the training set."""
    figure = new_figure(6.0, 3.6)
    ax = figure.subplots()
    ax.plot(list(result.training), [100 * error for error in result.training.values()], label="network", **STYLES["common"])
    ax.set(xlabel="recordings and groups of steady runs trained on [-]", ylabel=ERROR)
    _constant(ax, result)
    return save_figure(figure, stem)


def gains(result: RiveraReproduction, stem: Path) -> list[Path]:
    """Every entry of the gain matrix that the network has learned against the analytic one, state by state."""
    figure = new_figure(9.0, 4.2)
    for ax, (name, (network, analytic)) in zip(figure.subplots(1, len(result.gains)), result.gains.items(), strict=True):
        for j in range(network.shape[1]):
            for i in range(network.shape[2]):
                ax.plot(analytic[:, j, i], network[:, j, i], ".", markersize=4,
                        label=f"$\\partial\\tau_{j + 1}/\\partial {SYMBOLS[name]}_{i + 1}$")
        ends = [float(analytic.min()), float(analytic.max())]
        ax.plot(ends, ends, color="0.4", linewidth=1)
        ax.set(xlabel=f"analytic [{UNITS[name]}]", ylabel=f"network [{UNITS[name]}]")
        ax.set_title(f"{100 * result.gain_error[name]:.0f} % off", fontsize=10)
        ax.legend(frameon=False, fontsize=8.5)
    return save_figure(figure, stem)


def torques(result: RiveraReproduction, stem: Path) -> list[Path]:
    """A recording held out: torque of each joint, measured and by the network."""
    joints = result.measured.shape[1]
    figure = new_figure(9.0, 2.2 * joints)
    for j, ax in enumerate(figure.subplots(joints, 1, sharex=True, squeeze=False)[:, 0]):
        ax.plot(result.t, result.measured[:, j], color="0.7", linewidth=3, label="measured")
        ax.plot(result.t, result.network[:, j], color="#0072B2", linewidth=1.2, label="network")
        ax.set(ylabel=f"$\\tau_{j + 1}$ [N m]")
        ax.grid(color="0.92")
    ax.set_xlabel("time [s]")
    ax.legend(frameon=False, fontsize=9)
    figure.suptitle(f"{result.held_out}, held out of the training", fontsize=10)
    return save_figure(figure, stem)


def slenderness(result: RiveraReproduction, stem: Path) -> list[Path]:
    """The error on an arm of an L/D that was held out."""
    figure = new_figure(5.0, 3.4)
    ax = figure.subplots()
    place = np.arange(len(result.slenderness))
    bars = ax.bar(place, [100 * error for error in result.slenderness.values()], 0.5, color="0.45", label="network")
    ax.bar_label(bars, fmt="%.1f", fontsize=9, padding=2)
    ax.set_xticks(place, [f"{factor:g}" for factor in result.slenderness])
    ax.set(xlabel="L/D of the arm held out, over the campaign's [-]", ylabel="error on analytic torques [%]")
    return save_figure(figure, stem)


FIGURES: Final[dict[str, Callable[[RiveraReproduction, Path], list[Path]]]] = {
    "inputs": inputs, "neurons": neurons, "training_set": training_set, "gains": gains, "torques": torques, "slenderness": slenderness}


def write_figures(result: RiveraReproduction, folder: Path) -> list[Path]:
    """Write every figure into `folder`, as PNG and SVG with its data, and return the paths."""
    return [path for name, draw in FIGURES.items() for path in draw(result, folder / name)]
