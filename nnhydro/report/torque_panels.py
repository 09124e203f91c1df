"""Torque against time: measured and modelled curves of one recording, and what the models leave, a pair of panels a joint.

Lines differ in dash and width as well as in colour, so that they can be told apart in grey and by colour-blind readers.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

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


def draw_joint_panels(figure: "Figure", segment: Segment, lines: dict[str, Array]) -> None:
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
