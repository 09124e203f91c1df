"""Tracking errors of run.py as marks that can be told apart in grey; on a logarithmic axis a bar would have no foot to stand on."""

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
