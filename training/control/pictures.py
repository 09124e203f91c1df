"""What run.py found, as tables, and as marks that can be told apart in grey; on a logarithmic axis a bar would have no foot to stand on."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

MARKS = {"computed torque": "o", "sliding mode": "s", "pd": "D", "pid": "D"}


def draw(results, truths, path):
    """Write a panel a truth to `path`: rms error of every controller, its range over the seeds, on a logarithmic scale."""
    rows = list(results[truths[0]])[::-1]
    figure, axes = plt.subplots(1, len(truths), figsize=(2.6 + 3.4 * len(truths), 5.4), sharex=True, sharey=True, layout="constrained",
                                squeeze=False)
    names = [row.replace("_", " ") for row in rows]
    for panel, truth in zip(axes[0], truths, strict=True):
        for place, (row, name) in enumerate(zip(rows, names, strict=True)):
            one = results[truth].get(row)
            panel.axhline(place, color="0.9", linewidth=0.8, zorder=0)
            if one is None:
                continue
            weak = "too weak" in row
            low, high, mark = min(one["rms_mrad_by_seed"]), max(one["rms_mrad_by_seed"]), MARKS[name.split(" (")[0]]
            panel.plot([low, high], [place, place], color="black", linewidth=1.4)
            panel.plot(one["rms_mrad"], place, mark, color="black", markersize=7, markerfacecolor="white" if weak else "0.3")
            panel.annotate(f"{one['rms_mrad']:.3g}", (high, place), (8, 0), textcoords="offset points", va="center", fontsize=8)
        panel.set(title=truth, xscale="log", xlabel="tracking error, rms [mrad]\n(line: from seed to seed)")
        panel.margins(x=0.15)
        panel.spines[["top", "right"]].set_visible(False)
    axes[0, 0].set_yticks(range(len(rows)), names, fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def error(result):
    """Return the tracking error of a row as text."""
    seeds = result["rms_mrad_by_seed"]
    return f"{result['rms_mrad']:.3g} ({min(seeds):.3g} to {max(seeds):.3g}) | {result['peak_mrad']:.3g}"


def effort(result):
    """Return the rms torque of each joint as text."""
    return ", ".join(f"{x:.3g}" for x in result["torque_rms_Nm"])


def tables(results, truths):
    """Return the files of tracking errors and of torques as {name: text}; a row that was not reached to its end is empty."""
    found, kinds = {}, (("table.md", "{}: rms, mrad (by seed) | peak", error, "- | -"), ("effort.md", "{}: torque, N m", effort, "-"))
    for name, head, cell, empty in kinds:
        columns = " | ".join(head.format(t) for t in truths)
        cells = {row: [empty if results[t].get(row) is None else cell(results[t][row]) for t in truths] for row in results[truths[0]]}
        lines = [f"| controller | {columns} |", "| --- " * (2 + columns.count("|")) + "|",
                 *(f"| {row} | {' | '.join(texts)} |" for row, texts in cells.items())]
        found[name] = "\n".join([*lines, ""])
    return found
