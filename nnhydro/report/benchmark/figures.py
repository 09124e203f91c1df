"""The benchmark's pictures: measured against modelled torque for the worst, the median and the best recording, and the errors.

Lines differ in dash and width as well as in colour, so that they can be distinguished in grey and by colour-blind readers.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from nnhydro.evaluation.benchmark_result import BenchmarkResult
from nnhydro.report.figure_file import INK, STYLES, new_figure, save_figure
from nnhydro.report.torque_panels import torque_file
from nnhydro.report.widgets.trace import benchmark_traces, with_whole_tables

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def typical_recordings(result: BenchmarkResult, by: str) -> dict[str, str]:
    """Return {"worst", "median", "best": recording} by the error of the model `by`, over recordings that were held out."""
    steady = {unit.name for unit in result.units if unit.steady}
    misfit = result.standings[by].misfit
    ranked = sorted((name for name in misfit if name not in steady), key=lambda name: misfit[name].error, reverse=True)
    if not ranked:
        return {}
    chosen = {"worst": ranked[0], "median": ranked[len(ranked) // 2], "best": ranked[-1]}
    return {label: name for label, name in chosen.items() if list(chosen.values()).index(name) == list(chosen).index(label)}


def shown_models(result: BenchmarkResult) -> list[str]:
    """Return at most three models to draw: the winner, the best physics baseline and the runner-up."""
    ranking = result.ranking()
    physics = [name for name in ranking if name not in ("network", "hybrid")]
    return list(dict.fromkeys([ranking[0], *physics[:1], *ranking[1:]]))[:3]


def torque_history(result: BenchmarkResult, recording: str, label: str, models: Sequence[str]) -> "Figure":
    """Return measured and held-out modelled torque of one recording."""
    trace = max(benchmark_traces(result, [recording]), key=lambda trace: len(trace.segment))
    labels = {name: f"{name} ({100 * result.standings[name].misfit[recording].error:.1f} %)" for name in models}
    return torque_file(trace, labels, f"{label} held-out recording: {recording}")


def error_figure(result: BenchmarkResult) -> "Figure":
    """Draw each model's pooled error with its interval, the best on top, and the noise floor."""
    document = result.document()["models"]
    names = result.ranking()[::-1]
    figure = new_figure(7.5, 0.42 * len(names) + 1.5)
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
    return figure


def learning_curves(result: BenchmarkResult) -> "Figure":
    """Draw each model's error against the number of recordings fitted, and the noise floor."""
    count = [result.fitted_count(fold) for fold in result.split.folds]
    figure = new_figure(7.5, 4.6)
    axes = figure.subplots()
    for number, name in enumerate(result.ranking()):
        errors = [100 * result.fold_errors(k)[name] for k in range(len(count))]
        axes.plot(count, errors, marker="osv^D<>pX"[number % 9], label=name, **STYLES[number % len(STYLES)])
    if result.noise_floor is not None:
        axes.axhline(100 * result.noise_floor, color=INK, linestyle="--", linewidth=1.0, label="noise floor")
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    axes.set_xticks(count, [str(n) for n in count])
    axes.set_xlabel("recordings fitted")
    axes.set_ylabel("error on the same held-out recordings  [%]")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def reliability_figure(covered: Mapping[str, Mapping[str, float]]) -> "Figure":
    """Draw the share of held-out torques inside the intervals against the share that they promise, one line per model.

    `covered` holds the share by the promised one in per cent, by model; on the diagonal a model's doubt is honest.
    """
    figure = new_figure(4.6, 4.6)
    axes = figure.subplots()
    axes.plot([0, 100], [0, 100], color=INK, linestyle="--", linewidth=1.0, label="honest")
    for number, (name, shares) in enumerate(covered.items()):
        axes.plot([float(level) for level in shares], [100 * share for share in shares.values()], marker="osv^D<>pX"[number % 9],
                  label=name, **STYLES[number % len(STYLES)])
    axes.set(xlabel="promised  [%]", ylabel="held-out torques inside  [%]", xlim=(0, 100), ylim=(0, 100), aspect="equal")
    axes.legend(frameon=False, loc="upper left")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def coverage_shares(result: BenchmarkResult) -> dict[str, dict[str, float]]:
    """Return of each model with intervals the share of held-out torques inside them, by the share that they promise."""
    return {name: model["coverage"]["shares"] for name, model in result.document()["models"].items() if "coverage" in model}


def benchmark_figures(result: BenchmarkResult, out: Path) -> list[Path]:
    """Draw every picture of a benchmark into the folder `out`, each as PNG and SVG with its data; returns their paths."""
    paths = save_figure(error_figure(result), out / "errors")
    if result.split.curve:
        paths += save_figure(learning_curves(result), out / "learning_curve")
    if covered := coverage_shares(result):
        paths += save_figure(reliability_figure(covered), out / "reliability")
    models = shown_models(result)
    for label, recording in typical_recordings(result, models[0]).items():
        paths += save_figure(torque_history(result, recording, label, models), out / f"torque_{label}")
    steady = with_whole_tables(benchmark_traces(result, [unit.name for unit in result.units if unit.steady]))
    if steady:
        paths += save_figure(torque_file(steady[0], {name: name for name in models}, steady[0].recording), out / "torque_steady")
    return paths
