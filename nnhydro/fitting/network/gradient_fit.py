"""Fit an ensemble by AdamW with early stopping on recordings that are neither trained on nor tested on; can be stopped and resumed.

    loss = mean over training rows of sum_j [ (S_j r_j y_j - left_j) / s_j ]^2,     left = target - S linear,   s_j = rms target_j

The networks y learn what the linear part (linear_part.py) leaves of the targets, in units r of its own size, so that their steps fit a
small remainder as well as a large one. The order of rows is drawn anew each epoch from (seed, epoch), so a resumed run takes the very same
steps.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import cos, pi
from pathlib import Path
from typing import final

import torch
from torch import Tensor

from nnhydro.errors import ModelError
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.network.rows import Rows
from nnhydro.models.learned.network import Ensemble, odd_output
from nnhydro.runtime.files import write_bytes

BETA1, BETA2, TINY = 0.9, 0.99, 1e-8
RISE = 0.05  # of the way to the last step
Progress = Callable[[int, int, float], None]  # epoch, epochs, rms validation error in units of the rms torque that is to be learned


@final
@dataclass
class TrainingState:
    """Everything that a resumed training needs: weights, AdamW's moments, the best weights of each member and when they were found."""

    weights: list[Tensor]
    first: list[Tensor]
    second: list[Tensor]
    best: list[Tensor]
    best_error: Tensor  # (members,)
    best_epoch: Tensor  # (members,)
    epoch: int = 0
    steps: int = 0
    history: list[float] = field(default_factory=list)

    @staticmethod
    def fresh(ensemble: Ensemble) -> "TrainingState":
        """Return the state before the first epoch."""
        weights = ensemble.tensors()
        members = ensemble.members
        return TrainingState([w.clone() for w in weights], [torch.zeros_like(w) for w in weights], [torch.zeros_like(w) for w in weights],
                             [w.clone() for w in weights], torch.full((members,), float("inf")), torch.zeros(members))

    def learning(self, patience: int) -> Tensor:
        """Return which members (members,) still learn: those that have improved within `patience` epochs."""
        return self.epoch - self.best_epoch < patience

    def save(self, path: Path) -> None:
        """Write the state to `path` (safetensors), whole or not at all."""
        from safetensors.torch import save

        groups = {"weights": self.weights, "first": self.first, "second": self.second, "best": self.best}
        tensors = {f"{name}.{i}": t.detach().contiguous() for name, group in groups.items() for i, t in enumerate(group)}
        tensors |= {"best_error": self.best_error, "best_epoch": self.best_epoch, "epoch": torch.tensor(self.epoch),
                    "steps": torch.tensor(self.steps), "history": torch.tensor(self.history, dtype=torch.float64)}
        write_bytes(path, save(tensors))

    @staticmethod
    def load(path: Path) -> "TrainingState":
        """Return the state that `save` wrote; raises ModelError where the file is damaged."""
        from safetensors import SafetensorError
        from safetensors.torch import load_file

        def group(tensors: dict[str, Tensor], name: str) -> list[Tensor]:
            return [tensors[f"{name}.{i}"] for i in range(sum(key.startswith(f"{name}.") for key in tensors))]

        try:
            stored = load_file(path)
            return TrainingState(group(stored, "weights"), group(stored, "first"), group(stored, "second"), group(stored, "best"),
                                 stored["best_error"], stored["best_epoch"], int(stored["epoch"]), int(stored["steps"]),
                                 stored["history"].tolist())
        except (SafetensorError, OSError, KeyError, ValueError, RuntimeError) as cause:
            raise ModelError(f"{path}: is damaged ({cause}): start anew without --resume") from cause


@final
@dataclass(frozen=True, eq=False)
class _Task:
    """What is to be learned: what the linear part leaves of the targets (E or 1, n, joints) N m, its size r (E or 1, 1, joints), and s."""

    rows: Rows
    left: Tensor
    r: Tensor
    s: Tensor

    @staticmethod
    def of(rows: Rows) -> "_Task":
        """Return the task of `rows`."""
        left = rows.target[None] if rows.linear is None else rows.target - rows.scale * rows.linear.transpose(0, 1)
        r = (left / rows.scale).pow(2).mean(dim=1, keepdim=True).sqrt() + 1e-9
        return _Task(rows, left.contiguous(), r, rows.target.pow(2).mean(dim=0).sqrt() + 1e-9)

    def of_members(self, members: Tensor) -> "_Task":
        """Return the task of `members`, numbers or a mask, alone."""
        return self if len(self.left) == 1 else _Task(self.rows, self.left[members], self.r[members], self.s)

    def errors(self, ensemble: Ensemble, index: Tensor) -> Tensor:
        """Squared scaled error (E, m) of the rows `index` (E, m) of each member."""
        rows = index + torch.arange(len(index))[:, None] * (len(self.rows.x) if len(self.left) > 1 else 0)  # among the rows of all members
        x, scale, left = (of.index_select(0, which.ravel()).reshape(*index.shape, -1) for of, which in
                          ((self.rows.x, index), (self.rows.scale, index), (self.left.flatten(0, 1), rows)))
        y = self.r * odd_output(ensemble, x, self.rows.parity)
        return (((scale * y - left) / self.s) ** 2).sum(dim=2)


def adamw_step(weights: Sequence[Tensor], gradients: Sequence[Tensor], first: Sequence[Tensor], second: Sequence[Tensor], step: int,
               rate: float, decay: float) -> None:
    """Move `weights` in place, and their moments, by the step of number `step`, from 1 (Loshchilov and Hutter 2019, algorithm 2).

    torch.optim does the same, but its first use loads a compiler, which takes seconds.
    """
    root = (1 - BETA2**step) ** 0.5
    for w, g, m, v in zip(weights, gradients, first, second, strict=True):
        m.lerp_(g, 1 - BETA1)
        v.mul_(BETA2).addcmul_(g, g, value=1 - BETA2)
        w.data.mul_(1 - rate * decay).addcdiv_(m, v.sqrt().div_(root).add_(TINY), value=-rate / (1 - BETA1**step))


def cycle(progress: float) -> float:
    """Return the rate at `progress` 0..1 in units of its peak: a short rise, then half a cosine to 1 %."""
    if progress < RISE:
        return 0.1 + 0.9 * progress / RISE
    return 0.01 + 0.99 * 0.5 * (1 + cos(pi * (progress - RISE) / (1 - RISE)))


def _epoch(state: TrainingState, layout: Ensemble, task: _Task, train: Tensor, config: TrainingConfig, learning: Tensor) -> None:
    """Pass once over the rows with the members `learning`; `train` (members, n) says which rows each member may use."""
    groups = state.weights, state.first, state.second
    at = [learning.repeat_interleave(len(w) // len(learning)) for w in state.weights]  # parallel layers: a stack for each output
    weights, first, second = ([x[on] for x, on in zip(group, at, strict=True)] for group in groups)
    task, train = task.of_members(learning), train[learning]
    generator = torch.Generator().manual_seed(config.seed * 1_000_003 + state.epoch)
    order = torch.randperm(len(task.rows.x), generator=generator)
    batches = torch.split(order, config.batch)
    for number, index in enumerate(batches):
        for w in weights:
            w.requires_grad_(True)
        mine = train[:, index]
        trained = mine.int().argsort(dim=1, descending=True, stable=True)[:, :int(mine.sum(dim=1).max())]  # others fill up, at no weight
        weight = mine.gather(1, trained)
        errors = task.errors(layout.with_tensors(weights), index[trained])
        loss = ((errors * weight).sum(dim=1) / weight.sum(dim=1).clamp(min=1)).sum()
        gradients = torch.autograd.grad(loss, weights, materialize_grads=True)
        for w in weights:
            w.requires_grad_(False)
        state.steps += 1
        rate = config.learning_rate * cycle((state.epoch + number / len(batches)) / config.epochs)
        adamw_step(weights, gradients, first, second, state.steps, rate, config.weight_decay)
    for group, learned in zip(groups, (weights, first, second), strict=True):
        for x, on, y in zip(group, at, learned, strict=True):
            x[on] = y
    state.epoch += 1


def _watch(state: TrainingState, layout: Ensemble, task: _Task, watch: Tensor, learning: Tensor) -> None:
    """Note the error of each member of those `learning` on the rows it watches (members, n) and keep its best weights."""
    error = state.best_error.clone()
    for member in learning.nonzero():
        alone, mine = task.of_members(member), watch[member[0]]
        ensemble = layout.with_tensors([w.chunk(layout.members)[member] for w in state.weights])
        pieces = torch.split(mine.nonzero().ravel(), 65_536)
        error[member] = sum(alone.errors(ensemble, index[None]).sum() for index in pieces) / mine.sum().clamp(min=1)
    better = error < state.best_error
    state.best_error = torch.where(better, error, state.best_error)
    state.best_epoch = torch.where(better, torch.tensor(float(state.epoch)), state.best_epoch)
    for best, w in zip(state.best, state.weights, strict=True):
        improved = better.repeat_interleave(len(w) // len(better))  # parallel layers: a stack for each output of a member
        best[improved] = w[improved]
    if state.epoch:
        state.history.append(float(error.mean()))


def gradient_fit(layout: Ensemble, rows: Rows, watched: Tensor, config: TrainingConfig, state: TrainingState,
                 checkpoint: Callable[[TrainingState], None] | None = None, progress: Progress | None = None) -> Ensemble:
    """Return the ensemble at each member's best epoch; `watched` (members, units); continues from `state`.

    `checkpoint` is called after every epoch; stopping (Ctrl-C) between two calls loses at most one epoch. `progress` hears the errors of
    all joints as one relative rms.
    """
    watch = watched[:, rows.unit]
    seen = watch if bool(watch.any()) else ~watch
    task = _Task.of(rows)
    if not state.epoch:
        _watch(state, layout, task, seen, state.best_epoch == 0)  # the linear part alone is a candidate
    while state.epoch < config.epochs and bool((learning := state.learning(config.patience)).any()):
        _epoch(state, layout, task, ~watch, config, learning)
        _watch(state, layout, task, seen, learning)
        if checkpoint is not None:
            checkpoint(state)
        if progress is not None:
            progress(state.epoch, config.epochs, (state.history[-1] / rows.target.shape[1]) ** 0.5)
    return layout.with_tensors([w.double() for w in state.best]).times(task.r.double().expand(layout.members, 1, -1))
