"""What a picture of torque against time shows, the same on a page and in a file: panels, curves, labels, limits and shaded ends.

The page draws the panels as SVG of its own that a script reads (history.py), the file by matplotlib (torque_panels.py).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import joint_text
from nnhydro.recordings.segment import Segment
from nnhydro.report.widgets.svg import Ends, Scale
from nnhydro.report.widgets.trace import Trace

Array = NDArray[np.float64]
MEASURED = "measured"
DIFFERENT = 1e-3  # rad, rad/s, m/s: runs of a steady table that differ less do not vary


@final
@dataclass(frozen=True, eq=False)
class Panel:
    """The torques of a joint, measured and modelled, or what the models leave of them; `curves` (n,) N m, the last one on top."""

    joint: int  # from 1
    residual: bool
    label: str
    curves: Mapping[str, Array]
    limits: Ends


def panels(trace: Trace, models: Sequence[str], first: Sequence[str] = ()) -> list[Panel]:
    """Return two panels a joint, torques and residuals; the first of `models` lies on top.

    The limits hold the compared rows of the measured torque and of the models `first` (all where none of these is drawn).
    """
    made, limiting = [], {MEASURED, *(set(first) & set(models) or models)}
    for joint, residual in np.ndindex(trace.segment.n_links, 2):
        curves = {} if residual else {MEASURED: trace.tau[:, joint]}
        curves |= {name: (trace.residual(name) if residual else trace.models[name])[:, joint] for name in reversed(models)}
        # at the ends the filter makes curves leave the panel
        compared = [y[trace.segment.keep] for name, y in curves.items() if name in limiting]
        scale = Scale.around(np.concatenate(compared), 0.0, 1.0, zero=bool(residual))
        label = joint_text(f"{'residual' if residual else 'torque'} {joint + 1} [N m]", trace.segment.sliding)
        made.append(Panel(joint + 1, bool(residual), label, curves, (scale.low, scale.high)))
    return made


def shaded_ends(segment: Segment) -> list[Ends]:
    """Return the times s between which the filter touches the rows, and no comparison uses them."""
    compared = np.flatnonzero(segment.keep)
    if segment.steady or not len(compared):
        return []
    pairs = ((segment.t[0], segment.t[compared[0]]), (segment.t[compared[-1]], segment.t[-1]))
    return [(float(a), float(b)) for a, b in pairs if b > a]


def varied_columns(segment: Segment) -> dict[str, Array]:
    """Return what a steady table varies, by its name."""
    found = {"towing speed [m/s]": segment.u0}
    for j in range(segment.n_links):
        found |= {f"rate of joint {j + 1} [rad/s]": segment.qd[:, j], f"angle of joint {j + 1} [rad]": segment.q[:, j]}
    return {joint_text(name, segment.sliding): x for name, x in found.items() if np.ptp(x) > DIFFERENT}
