"""The signature of an effect as a picture: torque without and with it on a demonstration motion, and the difference against what drives it.

The arm, its motion and the size of the effect (a quarter of the largest torque of the joint) are made up for the picture.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.effects.catalogue import candidates
from nnhydro.effects.effect import Effect, InstrumentEffect, LoadEffect
from nnhydro.effects.sensor_view import SensorView
from nnhydro.errors import ConfigError
from nnhydro.models.baselines import baseline
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm, parse_arm
from nnhydro.report.figure_file import new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
SHARE = 0.25  # of the largest torque
RATE = 100.0  # Hz
INK, COLOUR = "#111111", "#D55E00"


def demonstration_arm() -> Arm:
    """Return the arm of the pictures: two links in water."""
    links = [{"length_m": 0.55, "diameter_m": 0.07, "mass_kg": 1.1, "com_m": 0.27, "inertia_kg_m2": 0.026},
             {"length_m": 0.45, "diameter_m": 0.06, "mass_kg": 1.4, "com_m": 0.22, "inertia_kg_m2": 0.024}]
    return parse_arm({"fluid": {"density_kg_m3": 1000.0}, "links": links}, "the picture's arm")


def _strokes(t: Array, times: Array, angles: Array) -> tuple[Array, Array, Array]:
    """Angle, rate and acceleration of rest-to-rest strokes (fifth order) between `times`, with holds where the angle stays."""
    q, qd, qdd = (np.zeros_like(t) for _ in range(3))
    q += angles[0]
    for start, stop, a, b in zip(times[:-1], times[1:], angles[:-1], angles[1:], strict=True):
        span, on = stop - start, (t >= start) & (t <= stop)
        x = (t[on] - start) / span
        q[on], qd[on] = a + (b - a) * (10 * x**3 - 15 * x**4 + 6 * x**5), (b - a) / span * (30 * x**2 - 60 * x**3 + 30 * x**4)
        qdd[on] = (b - a) / span**2 * (60 * x - 180 * x**2 + 120 * x**3)
        q[t > stop] = b
    return q, qd, qdd


def demonstration_motion() -> Motion:
    """Return starts, stops, reversals and pauses of both joints, 10 s."""
    t = np.arange(0, 10, 1 / RATE)
    first = _strokes(t, np.array([0.3, 1.7, 2.3, 4.0, 5.5, 6.5, 8.0, 9.5]), np.array([-0.8, 0.6, 0.6, -0.4, 0.9, 0.9, -0.2, -0.8]))
    second = _strokes(t, np.array([0.8, 2.0, 3.4, 4.2, 6.0, 7.2, 9.0]), np.array([0.3, 1.9, 1.9, 0.4, -1.2, 2.4, 0.3]))
    q, qd, qdd = (tensor(np.stack(pair, axis=1)) for pair in zip(first, second, strict=True))
    still = torch.zeros(len(t), dtype=torch.float64)
    return Motion(tensor(t), q, qd, qdd, still, still)


def illustrate(effect: type[Effect]) -> tuple[Motion, Tensor, Tensor, int]:
    """Return motion, torque without and with the effect (n, joints) N m, and the joint (from 0) where it shows most."""
    arm, motion = demonstration_arm(), demonstration_motion()
    loads = baseline("constant").start(arm)
    place = tensor(np.linspace(-1, 1, len(motion)))
    seen = SensorView.of(loads, Flow(arm, motion), place)
    peak = tuple(seen.tau.abs().amax(0).tolist())
    made = candidates(effect, arm, peak)
    if not made:
        raise ConfigError(f"effect {effect.id!r} cannot act on the picture's two-link arm in water: there is no picture of it")
    middle = len(made) // 2
    best = 0.0, torch.zeros_like(seen.tau)
    for hypothesis in (*made[middle:], *made[:middle]):
        best = max(best, _change(hypothesis, seen, tensor(peak)), key=lambda found: found[0])
        if best[0] > 0.99 * SHARE:  # a clipping takes less: the best that is shows
            break
    change = best[1]
    return motion, seen.tau, seen.tau + change, int((change.abs().amax(0) / tensor(peak)).argmax())


def _change(hypothesis: Effect, seen: SensorView, peak: Tensor) -> tuple[float, Tensor]:
    """What an effect adds to the torque, (n, joints) N m, and its share of the largest torque `peak` (joints,): SHARE where it can."""
    if isinstance(hypothesis, InstrumentEffect):
        columns = hypothesis.columns(seen)
    elif isinstance(hypothesis, LoadEffect):
        columns = hypothesis.columns(seen.flow)
    else:
        raise ConfigError(f"effect {hypothesis.id!r} is neither a load nor an instrument effect")
    values = hypothesis.linear_values()
    if not bool(values.any()):
        values[int(columns.flatten(0, 1).any(0).to(torch.int8).argmax())] = 1.0  # the first that does something

    def share(change: Tensor) -> float:
        """Return the largest of a change over the largest torque of the joint."""
        return float((change.abs().amax(0) / peak).max())

    sized = hypothesis.with_linear(values * SHARE / max(share(columns @ values), 1e-300))
    predicted = sized.for_prediction(0.0) if isinstance(sized, InstrumentEffect) else sized
    change = columns @ (predicted if isinstance(predicted, type(hypothesis)) else sized).linear_values()
    return share(change), change


def _driver(effect: type[Effect], motion: Motion, tau: Tensor, joint: int) -> tuple[str, Array]:
    """What the difference is drawn against: the first of `depends_on` that a motion has."""
    at = max(joint, 0)
    channels: dict[str, tuple[str, Tensor]] = {
        "q": (f"angle $q_{at + 1}$ [rad]", motion.q[:, at]), "qd": (f"rate of joint {at + 1} [rad/s]", motion.qd[:, at]),
        "qdd": (f"acceleration of joint {at + 1} [rad/s$^2$]", motion.qdd[:, at]),
        "tau": (f"torque of joint {at + 1} [N m]", tau[:, at]),
        "tau of the other joint": (f"torque of joint {2 - at} [N m]", tau[:, 1 - at]),
    }
    channels["w"] = channels["dw"] = ("rate of the whole arm [rad/s]", motion.qd.sum(1))
    for word in effect.signature.depends_on:
        if word in channels:
            label, values = channels[word]
            return label, values.numpy()
    return "time [s]", motion.t.numpy()


def _dress(ax: "Axes", **labels: Any) -> None:
    ax.set(**labels)
    ax.grid(color="0.92")
    ax.spines[["top", "right"]].set_visible(False)


def picture(effect: type[Effect]) -> "Figure":
    """Return the figure of `effect`: the torque without and with it, and the difference."""
    motion, without, with_it, joint = illustrate(effect)
    t, before, after = motion.t.numpy(), without[:, joint].numpy(), with_it[:, joint].numpy()
    figure = new_figure(10, 4.2)
    left, right = figure.subplots(1, 2, width_ratios=[1.6, 1])
    left.plot(t, before, color=INK, linewidth=1.2, linestyle=(0, (5, 2)), label="without")
    left.plot(t, after, color=COLOUR, linewidth=1.6, label="with")
    left.legend(frameon=False)
    _dress(left, xlabel="time [s]", ylabel=f"torque of joint {joint + 1} [N m]")
    label, driver = _driver(effect, motion, without, joint)
    right.plot(driver, after - before, ".", color=COLOUR, markersize=3)
    _dress(right, xlabel=label, ylabel="difference [N m]")
    figure.suptitle(f"{effect.name} ({effect.id}), illustrative size", fontsize=11)
    return figure


def draw(effect: type[Effect], path: Path) -> Path:
    """Write the picture of `effect` to the PNG file `path`, and beside it as SVG and its data as CSV."""
    figure = picture(effect)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        save_figure(figure, path)
    except OSError as cause:
        raise ConfigError(f"--out {path}: cannot be written ({cause.strerror or cause}): name a file that you may write to") from cause
    return path
