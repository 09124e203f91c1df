"""The benchmark on the screen: a table, best model first, and the verdict."""

from nnhydro.evaluation.benchmark import Benchmark
from nnhydro.report.screen import say, table


def print_benchmark(result: Benchmark) -> None:
    """Print the table of all models on held-out recordings and the verdict in a sentence."""
    document = result.document()["models"]
    joints = result.campaign.arm.n_links
    rows = []
    for name in result.ranking():
        m = document[name]
        interval = " to ".join(f"{100 * x:.1f}" for x in m["error_ci95"])
        rows.append([name, f"{100 * m['error']:.1f} %", interval, *(f"{x:.3f}" for x in m["nrmse"]),
                     *(f"{100 * x:.1f} %" for x in m["vaf"]), f"{m['fit_s']:.1f}"])
    if result.noise_floor is not None:
        rows.append(["(a perfect model)", f"{100 * result.noise_floor:.1f} %", "", *[""] * (2 * joints + 1)])
    steady = sum(unit.steady for unit in result.units)
    held = f"{len(result.units) - steady} recordings"
    held += f" and {sum(len(table) for table in result.campaign.steady)} steady runs" if steady else ""
    table(f"Held-out torque error: {held}, each held out once in {len(result.folds)} folds",
          ["model", "error", "95 % interval", *(f"NRMSE {j + 1}" for j in range(joints)), *(f"VAF {j + 1}" for j in range(joints)), "fit [s]"],
          rows)
    say(result.verdict())
