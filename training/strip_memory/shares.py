"""Nets used as the package's hybrid uses its members: how much of them, and what is left."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import torch
from net import train
from rows import Run
from torch import Tensor

from nnhydro.features.scaling import morison_scale
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.linear.several_arms import calibrated_on
from nnhydro.fitting.network.rows import torque_rms, watched_units
from nnhydro.fitting.network.stacking import SHARES, credit, held_out, stack
from nnhydro.models.baselines import baseline
from nnhydro.models.learned.shrinkage import jackknife, shrink
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit

Known = dict[str, Run]
Model = Callable[[Unit], Tensor]  # what a model leaves of a recording's torques (t, joints) N m


def shares(runs: list[tuple[Run, Tensor]], nets: list[Callable[[Run], Tensor]], watched: Tensor, left_out: float) -> tuple[Tensor, Tensor]:
    """The share of each joint that a hybrid chooses on what its members left out, and the one that leaves least N m there."""
    unit = torch.cat([torch.full((int(run.keep.sum()),), k) for k, (run, _) in enumerate(runs)])
    members = torch.cat([torch.stack([net(run)[run.keep] for net in nets]) for run, _ in runs], dim=1).double()
    target, scale = (torch.cat(z).double() for z in ([run.y[run.keep] for run, _ in runs], [scale[run.keep] for run, scale in runs]))
    seen = watched.any(dim=0)[unit]
    target, unit, watching = target[seen], unit[seen], watched[:, unit[seen]]
    shrunk, mean = (held_out(members[:, seen], watching, scale[seen], part) for part in (left_out, None))
    least = torch.stack([(target - t * mean).abs().sum(dim=0) for t in SHARES]).argmin(dim=0)
    return tuple(credit(t, 1 - left_out) for t in (stack(target, {1.0: shrunk}, unit)[1], torch.tensor(SHARES).double()[least]))


def hybrid(fitted: Sequence[Unit], known: Known, arm: Arm, how: Preparation, config: dict[str, Any]) -> dict[str, Model]:
    """Nets beside the calibrated constants, shrunk and trusted as members of the package's hybrid are."""
    base, floor, stride = calibrated_on(baseline("constant"), fitted, arm, how), 0.1 * torque_rms(fitted), config["stride"]
    watched = watched_units(fitted, TrainingConfig(), arm)
    left_out = float(watched.double().mean())

    def beside(unit: Unit) -> tuple[Run, Tensor]:
        segment = unit.segments()[0]
        motion = Motion.of(segment)
        torque = torch.from_numpy(segment.filter(base.torque(motion).numpy()))[::stride].float()
        return replace(known[unit.name], y=known[unit.name].tau - torque), morison_scale(Flow(arm, motion), floor)[::stride].float()

    runs = [beside(unit) for unit in fitted]
    mine = [[run for (run, _), left in zip(runs, member, strict=True) if not left] for member in watched]
    *nets, whole = [train(some, False, seed, config) for seed, some in enumerate([*mine, [run for run, _ in runs]])]
    own, share = shares(runs, nets, watched, left_out)

    def left(one: Unit, of_all: bool) -> Tensor:
        run, scale = beside(one)
        members = own * torch.stack([net(run) for net in nets]).double()
        mean = own * whole(run).double() if of_all else members.mean(dim=0)
        return run.y - shrink(mean, jackknife(members, left_out), scale.double())

    def unshrunk(one: Unit, share: Tensor) -> Tensor:
        run, _ = beside(one)
        return run.y - share * whole(run).double()

    return {"": lambda one: left(one, False), "+whole": lambda one: left(one, True), "+trusted": lambda one: unshrunk(one, own),
            "+gain": lambda one: unshrunk(one, share)}
