"""Named sets of inputs for the learner: a function in a file of this folder, marked by `feature_set`, is one set.

Every feature has a parity under the mirror image of the rig (q_1 -> pi - q_1, all other angles, rates and accelerations negated, carriage
kept), which changes the sign of every torque: odd features change sign with it, even ones do not. All are functions of the flow along the
links, which the half turn of the rig leaves as it is. Velocity reversal is no symmetry (wakes, shielding) and is not used.
A set may be dimensional: SI numbers that have no bound of their own and differ from rig to rig (the network holds them within the range of
training all the same). Source: physics of a rig symmetric about the plane of tow; verified in tests.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from nnhydro.physics.flow import Flow
from nnhydro.runtime.registry import Registry


@final
@dataclass(frozen=True, eq=False)
class View:
    """What a feature may look at: the flow, the Morison scale S (n, joints) N m, and the baseline's torques divided by it."""

    flow: Flow
    scale: Tensor
    scaled_terms: Tensor  # (n, joints, terms) dimensionless


@final
@dataclass(frozen=True, eq=False)
class Features:
    """Features of n rows: `odd` (n, a) change sign in the mirror, `even` (n, b) do not."""

    odd: Tensor
    even: Tensor

    def matrix(self) -> Tensor:
        """Return all features (n, a + b), odd ones first."""
        return torch.cat([self.odd, self.even], dim=1)

    def parity(self) -> Tensor:
        """Return -1 for odd and +1 for even features, (a + b,)."""
        return torch.cat([-torch.ones(self.odd.shape[1]), torch.ones(self.even.shape[1])]).double()


FeatureSet = Callable[[View], Features]
_SETS: Registry[FeatureSet] = Registry("nnhydro.features")
_DIMENSIONAL: set[str] = set()


def feature_set(name: str, dimensional: bool = False) -> Callable[[FeatureSet], FeatureSet]:
    """Declare the decorated function as the feature set `name`."""

    def declare(function: FeatureSet) -> FeatureSet:
        """Enter `function` under its name."""
        _SETS.enter(name, function)
        if dimensional:
            _DIMENSIONAL.add(name)
        return function

    return declare


def dimensional(name: str) -> bool:
    """Return whether the set `name` holds SI numbers instead of dimensionless ones."""
    return name in feature_sets() and name in _DIMENSIONAL


def feature_sets() -> dict[str, FeatureSet]:
    """Return every declared set by name."""
    return _SETS.members()


def features(view: View, names: Sequence[str]) -> Features:
    """Return the sets `names` side by side; raises ConfigError for an unknown name."""
    parts = [of(view) for of in _SETS.choose(names, "feature set")]
    return Features(torch.cat([part.odd for part in parts], dim=1), torch.cat([part.even for part in parts], dim=1))
