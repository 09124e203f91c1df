"""Calibrated constants and a net, and how much of the net is used: decided on recordings that other nets have not seen.

    share_j = t_j / (t_j + (1 - t_j) f),    t_j maximises   mean(g) - z sd(g)/sqrt(n),    g = sum |left|_j - sum |left - t c|_j

c [N m] is what a net adds to the constants, and left what they leave. The net has learned what they leave, or all that a rigid body leaves:
then it stands for them as far as it is used (`stacked`). g is what the share t of a net of the other two thirds gains on each of n
recordings, f = 2/3 the part that this net has seen. z = 0: the largest mean gain. z = 1: the largest that a new set of recordings of this
kind is likely to confirm. The net of all recordings is used. Source: stacking, Wolpert (1992), Neural Networks 5, 241; the rule of one
standard error, Breiman et al. (1984), Classification and Regression Trees, section 3.4.3; credit: nnhydro/fitting/network/stacking.py.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from net import train
from rows import Run
from torch import Tensor

from nnhydro.fitting.linear.several_arms import calibrated_on
from nnhydro.fitting.network.stacking import SHARES, credit
from nnhydro.models.baselines import baseline
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit

Known = dict[str, Run]
Model = Callable[[Unit], Tensor]  # what a model leaves of a recording's torques (t, joints) N m
THIRDS = 3
ERRORS = {"+gain": 0.0, "+sure": 1.0}  # z


def thirds(count: int) -> list[list[bool]]:
    """Which of `count` recordings each net leaves out: a third, drawn."""
    order = np.random.default_rng(0).permutation(count)
    return [[bool(k) for k in np.isin(np.arange(count), order[third::THIRDS])] for third in range(THIRDS)]


def shares(left: Tensor) -> dict[str, Tensor]:
    """The share of each joint by every rule; `left` (recordings, shares, joints) N m is what is left of recordings by nets without them."""
    gain, t = left[:, :1] - left, torch.tensor(SHARES, dtype=torch.float64)
    spread = gain.std(dim=0) / len(gain) ** 0.5
    rules = {name: t[(gain.mean(dim=0) - z * spread).argmax(dim=0)] for name, z in ERRORS.items()}
    return {"": torch.ones(left.shape[2], dtype=torch.float64)} | {name: credit(own, 1 - 1 / THIRDS) for name, own in rules.items()}


def hybrid(fitted: Sequence[Unit], known: Known, arm: Arm, how: Preparation, config: dict[str, Any], stacked: bool) -> dict[str, Model]:
    """The net of all recordings beside the calibrated constants, whole and by every rule's share."""
    base = calibrated_on(baseline("constant"), fitted, arm, how)

    def both(unit: Unit) -> tuple[Run, Tensor, Tensor]:
        """The run with the target of the net, what the constants leave, and what the net's torque exceeds its correction by."""
        segment, run = unit.segments()[0], known[unit.name]
        torque = torch.from_numpy(segment.filter(base.torque(Motion.of(segment)).numpy()))[::config["stride"]]
        left = run.tau - torque.float()
        return (run, left, run.y - left) if stacked else (replace(run, y=left), left, torch.zeros_like(left))

    runs, left = [both(unit) for unit in fitted], []
    for seed, out in enumerate(thirds(len(runs))):
        net = train([run for (run, _, _), mine in zip(runs, out, strict=True) if not mine], False, seed, config)
        for run, rest, other in (three for three, mine in zip(runs, out, strict=True) if mine):
            c = net(run) - other
            left.append(torch.stack([(rest - t * c)[run.keep].abs().sum(dim=0) for t in SHARES]).double())
    whole = train([run for run, _, _ in runs], False, THIRDS, config)

    def used(share: Tensor) -> Model:
        def rest_of(one: Unit) -> Tensor:
            run, rest, other = both(one)
            return rest - share * (whole(run) - other).double()

        return rest_of

    return {name: used(share) for name, share in shares(torch.stack(left)).items()}
