"""Tracking errors of run.py as bars that can be told apart in grey."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def draw(results, truths, path):
    """Write a panel a truth to `path`: rms error of every controller, its range over the seeds, on a logarithmic scale."""
    figure, axes = plt.subplots(1, len(truths), figsize=(4.2 * len(truths), 5.2), sharey=True, layout="constrained")
    rows = list(results["strips"])[::-1]
    for panel, truth in zip(axes, truths, strict=True):
        for place, row in enumerate(rows):
            one = results[truth].get(row)
            if one is None:
                continue
            grey = "0.85" if "too weak" in row else "0.25" if row.startswith("computed") else "0.55"
            panel.barh(place, one["rms_mrad"], color=grey, edgecolor="black", linewidth=0.6, hatch="///" if "too weak" in row else "")
            seeds = one.get("rms_mrad_by_seed", [one["rms_mrad"]])
            low, high = min(seeds), max(seeds)
            panel.plot([low, high], [place, place], color="black", linewidth=1.2, marker="|", markersize=7)
            panel.text(max(high, one["rms_mrad"]) * 1.12, place, f"{one['rms_mrad']:.3g}", va="center", fontsize=8)
        panel.set(title=truth, xscale="log", xlabel="tracking error, rms [mrad]")
        panel.margins(x=0.25)
        panel.spines[["top", "right"]].set_visible(False)
    axes[0].set_yticks(range(len(rows)), rows, fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)
