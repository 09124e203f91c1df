"""How much of a strip net is used in place of all else that was learned: judged on recordings that neither has seen.

    share_j = t_j / (t_j + (1 - t_j) f),    t_j maximises   mean(g) - sd(g)/sqrt(n),    g = ln sum |r|_j - ln sum |r - t (net - learned)|_j

Each of THIRDS nets leaves out a third of the recordings, whole groups. r is what members leave of recordings that they watch, `learned`
what they add to the baseline, `net` what the net without these recordings puts in place of the baseline, as far as the motion is familiar.
g is the gain on each of the n groups, of which one that is halved makes up for one that is doubled, however large their torques; f is the
part of them that a net has seen. The largest gain less one standard error is one that new recordings would likely confirm. Of few
recordings, or where the net is no better, no share is left, and no net is kept.
A network has no baseline: its net stands for the whole torque, and the recordings that it is judged on are those that a member watches.
Otherwise the mean of NETS nets of all recordings is used: chance in what a single one has learned falls out of it (mean.py).
Source: stacking, Wolpert (1992), Neural Networks 5, 241; one standard error, Breiman et al. (1984), section 3.4.3; credit: stacking.py.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from nnhydro.fitting.linear.several_arms import arm_of, on_arm
from nnhydro.fitting.network.predictive_std import out_of_fold, sample_rows
from nnhydro.fitting.network.rows import Rows, row_numbers
from nnhydro.fitting.network.stacking import credit
from nnhydro.fitting.network.strip_net.latest_nets import trained_net
from nnhydro.fitting.network.strip_net.mean import mean_of
from nnhydro.fitting.network.strip_net.rows import runs_of
from nnhydro.models.learned.learned import LearnedTorque
from nnhydro.models.learned.strip_inputs import rigid_torque
from nnhydro.models.learned.strip_net import StripNet
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.splitting import Unit

THIRDS = 3
NETS = 3  # of all recordings, of which the mean is used
TINY = 1e-9  # N m
SHARES = torch.linspace(0, 1, 11, dtype=torch.float64)  # t


def thirds(chosen: Sequence[Unit], seed: int) -> list[list[bool]]:
    """Return which units each net leaves out: a third of the groups, drawn; none of fewer than THIRDS groups."""
    groups = sorted({unit.group for unit in chosen})
    if len(groups) < THIRDS:
        return []
    order = np.random.default_rng(seed).permutation(len(groups))
    return [[groups.index(unit.group) in set(order[third::THIRDS].tolist()) for unit in chosen] for third in range(THIRDS)]


def share_of(gain: Tensor, fitted: float) -> Tensor:
    """Return the share (joints,) where each of SHARES gains `gain` (shares, groups, joints)."""
    sure = gain.mean(dim=1) - gain.std(dim=1) / gain.shape[1] ** 0.5
    return credit(SHARES[sure.argmax(dim=0)], fitted)


def gains(r: Tensor, apart: Tensor, group: Tensor) -> Tensor:
    """Return g (shares, groups, joints) of r and apart (m, joints) N m, whose rows are of the groups `group` (m,), for SHARES."""
    names, place = torch.unique(group, return_inverse=True)
    none = torch.full((len(names), r.shape[1]), TINY, dtype=torch.float64)
    left = torch.stack([none.index_add(0, place, (r - t * apart).abs()) for t in SHARES])
    return (left[0] / left).log()


def _replacement(net: StripNet, base: TorqueModel | None, unit: Unit, arm: Arm) -> Tensor:
    """What a net puts in place of the base in the rows of a unit, as the sensor sees it, and how far it may be used, (n, joints + 1)."""
    unit_arm, parts = arm_of(unit, arm), []
    for segment in unit.segments():
        motion = Motion.of(segment)
        flow = Flow(unit_arm, motion)
        apart = rigid_torque(flow) + net.torque(flow) - (0 if base is None else on_arm(base, unit_arm).torque(motion))
        both = torch.cat([tensor(segment.filter(apart.numpy())), net.validity(flow)], dim=1)
        parts.append(both[torch.from_numpy(row_numbers(segment))])
    return torch.cat(parts).float()


def with_strip_net(model: LearnedTorque, rows: Rows, watched: Tensor, chosen: Sequence[Unit], seed: int) -> tuple[LearnedTorque, Rows]:
    """Return `model` with the mean of NETS nets of all units `chosen`, its share, and the rows with what nets that have not seen them
    replace.

    Both come back as they are where no share is sure to gain, or the nets so far have gained nothing on the groups that they left out.
    """
    parts, base = thirds(chosen, seed), model.baseline
    groups = sorted({member.group for member in chosen})
    seen = {member.group for member, is_watched in zip(chosen, watched.any(dim=0).tolist(), strict=True) if is_watched}
    if not parts or len(seen) < (THIRDS if base is None else len(groups)):
        return model, rows
    runs, index = runs_of(chosen, model.arm), sample_rows(rows.unit, watched)
    r, _, _, _, unit, target = out_of_fold(model, rows, watched)
    used = model.fading(rows.x[index].double())
    group = torch.tensor([groups.index(member.group) for member in chosen])[unit.long()]
    unseen, judged = torch.zeros(len(rows.target), target.shape[1] + 1), torch.zeros(len(chosen), dtype=torch.bool)
    for number, out in enumerate(parts):
        net = trained_net([run for run in runs if not out[run.unit]], seed + 1 + number)
        for k in (k for k, mine in enumerate(out) if mine):
            unseen[rows.unit == k], judged[k] = _replacement(net, base, chosen[k], model.arm), True
        replaced, known = torch.split(unseen[index].double(), [target.shape[1], 1], dim=1)
        so_far = judged[unit.long()]
        gain = gains(*(x[so_far] for x in (r, known * (used * replaced - (target - r)), group)))
        if not bool((gain.mean(dim=1) > 0).any()):
            return model, rows
    share = share_of(gain, 1 - 1 / THIRDS)
    if not bool(share.any()):
        return model, rows
    nets = [trained_net(runs, seed + THIRDS + 1 + number) for number in range(NETS)]
    return replace(model, water=mean_of(nets), share=share), replace(rows, replaced=unseen)
