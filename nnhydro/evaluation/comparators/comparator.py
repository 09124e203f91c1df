"""Comparators: regressions of general use on the same recordings, to show how much the physics in network and hybrid gains.

A file in this folder is one comparator. It is fitted to at most so many rows, evenly thinned, and makes an ordinary model that cannot be
stored. On features it learns torque over Morison scale and multiplies back; the mirror symmetry of the rig it has to find itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.features.feature_set import features
from nnhydro.fitting.config import TrainingConfig
from nnhydro.fitting.linear.several_arms import arm_of
from nnhydro.fitting.network.rows import torque_rms, training_rows
from nnhydro.models.learned.learned import view_of
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.splitting import Unit
from nnhydro.runtime.registry import Registry

Array = NDArray[np.float64]
Regression = Callable[[Array], tuple[Array, Array | None]]  # inputs (n, k) to outputs and their std, (n, joints)
Inputs = Callable[[Arm, Motion], tuple[Array, Array]]  # inputs (n, k) and the scale of the outputs (n, joints) N m


@final
@dataclass(frozen=True, eq=False)
class ComparatorTorque(TorqueModel):
    """Sensor torque from a fitted regression; `inputs` says what it looks at."""

    kind: ClassVar[str] = "comparator"
    name: str
    inputs: Inputs
    regression: Regression

    def torque(self, motion: Motion) -> Tensor:
        """Return the sensor torques (n, joints) N m."""
        x, scale = self.inputs(self.arm, motion)
        return torch.from_numpy(np.ascontiguousarray(scale * self.regression(x)[0]))

    def std(self, motion: Motion) -> Tensor | None:
        """Return the regression's own standard deviation (n, joints) N m, None where it knows none."""
        x, scale = self.inputs(self.arm, motion)
        std = self.regression(x)[1]
        return None if std is None else torch.from_numpy(np.ascontiguousarray(scale * std))

    def document(self) -> dict[str, Any]:
        """Return the name alone: a comparator is for comparison and is not stored."""
        return {"name": self.name}


FitComparator = Callable[[Sequence[Unit], Arm, Preparation, TrainingConfig], TorqueModel]


@final
@dataclass(frozen=True)
class Comparator:
    """A comparator by name, with its meaning in a sentence and the way to fit it to units."""

    name: str
    meaning: str
    fit: FitComparator


_COMPARATORS: Registry[Comparator] = Registry("nnhydro.evaluation.comparators")


def comparator(name: str, meaning: str) -> Callable[[FitComparator], FitComparator]:
    """Declare the decorated function as the comparator `name`."""

    def declare(function: FitComparator) -> FitComparator:
        _COMPARATORS.enter(name, Comparator(name, meaning, function))
        return function

    return declare


def comparators() -> dict[str, Comparator]:
    """Return every declared comparator by name."""
    return _COMPARATORS.members()


def thin_rows(count: int, most: int) -> slice:
    """Return every k-th of `count` rows so that at most `most` remain."""
    return slice(None, None, -(-count // most))


def feature_rows(chosen: Sequence[Unit], arm: Arm, config: TrainingConfig, most: int) -> tuple[Inputs, Array, Array]:
    """Return the inputs of network and hybrid, and at most `most` rows: features (n, k) and torque / scale (n, joints)."""
    floor = config.floor * torque_rms(chosen)
    rows = training_rows(chosen, arm, config, floor, None)
    few = thin_rows(len(rows.x), most)

    def inputs(arm: Arm, motion: Motion) -> tuple[Array, Array]:
        view = view_of(arm, motion, floor)
        return features(view, config.features).matrix().numpy(), view.scale.numpy()

    return inputs, rows.x[few].double().numpy(), (rows.target[few].double() / rows.scale[few].double()).numpy()


def raw_states(arm: Arm, motion: Motion) -> tuple[Array, Array]:
    """Return q, qd, qdd, u0, du0 (n, 3 joints + 2) in SI and the scale 1."""
    x = torch.cat([motion.q, motion.qd, motion.qdd, motion.u0[:, None], motion.du0[:, None]], dim=1).numpy()
    return x, np.ones((len(x), arm.n_links))


def raw_rows(chosen: Sequence[Unit], arm: Arm, config: TrainingConfig, most: int) -> tuple[Array, Array]:
    """Return at most `most` rows of raw states (n, k) and torques (n, joints) N m."""
    parts = [(raw_states(arm_of(unit, arm), Motion.of(segment))[0][segment.keep], segment.tau[segment.keep])
             for unit in chosen for segment in unit.segments() if segment.tau is not None]
    x, tau = (np.concatenate(column) for column in zip(*parts, strict=True))
    few = thin_rows(len(x), most)
    return x[few], tau[few]
