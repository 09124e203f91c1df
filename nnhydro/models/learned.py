"""The learned models: `network` (all of the torque) and `hybrid` (a calibrated baseline plus a bounded residual)."""

from dataclasses import dataclass
from typing import Any, ClassVar, final

import torch
from torch import Tensor

from nnhydro.features.feature_set import View, features
from nnhydro.features.scaling import morison_scale
from nnhydro.models.baselines import BASELINES
from nnhydro.models.network import Ensemble, bounded, mirrored
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.physics.transmission import to_drives
from nnhydro.recordings.arm import Arm


def reference_terms(arm: Arm, motion: Motion) -> dict[str, Tensor]:
    """Return the textbook's torques at the drives, term by term, (n, joints) N m: inputs of the learner, nothing fitted."""
    loads = BASELINES["rigid" if arm.dry else "textbook"].start(arm)
    return {name: to_drives(tau, arm) for name, tau in loads.by_term(Flow(arm, motion)).items()}


def view_of(arm: Arm, motion: Motion, floor: Tensor) -> View:
    """Return what the features look at; `floor` (joints,) N m is the scale's."""
    flow = Flow(arm, motion)
    scale = morison_scale(flow, floor)
    terms = torch.stack(list(reference_terms(arm, motion).values()), dim=2)
    return View(flow, scale, terms / scale[..., None])


@final
@dataclass(frozen=True, eq=False)
class LearnedTorque(TorqueModel):
    """An ensemble on dimensionless features; with a `baseline`, a hybrid. Tensors are float64, single rows are cheap."""

    kind: ClassVar[str] = "learned"
    feature_names: tuple[str, ...]
    bound: float
    floor: Tensor  # (joints,) N m
    centre: Tensor  # (features,)
    spread: Tensor  # (features,)
    parity: Tensor  # (features,)
    lowest: Tensor  # (features,) of the standardised inputs seen in training, mirror images included
    highest: Tensor  # (features,)
    ensemble: Ensemble
    baseline: StripTheory | None

    @property
    def name(self) -> str:
        """`hybrid` with a baseline, else `network`."""
        return "network" if self.baseline is None else "hybrid"

    def inputs(self, view: View) -> Tensor:
        """Return the standardised features (n, k), held within the range of the training recordings."""
        x = (features(view, self.feature_names).joined() - self.centre) / self.spread
        return torch.minimum(torch.maximum(x, self.lowest), self.highest)

    def members(self, motion: Motion) -> Tensor:
        """Return the sensor torques (E, n, joints) N m of each member of the ensemble."""
        view = view_of(self.arm, motion, self.floor)
        correction = view.scale * bounded(mirrored(self.ensemble, self.inputs(view), self.parity), self.bound)
        return correction if self.baseline is None else self.baseline.torque(motion) + correction

    def torque(self, motion: Motion) -> Tensor:
        """Return the mean of the members, (n, joints) N m."""
        return self.members(motion).mean(dim=0)

    def std(self, motion: Motion) -> Tensor | None:
        """Return the scatter of the members, (n, joints) N m: their disagreement, not a calibrated interval."""
        return self.members(motion).std(dim=0) if len(self.ensemble.skip) > 1 else None

    def document(self) -> dict[str, Any]:
        """Return names, bound, layout and the baseline."""
        return {"features": list(self.feature_names), "bound": self.bound, "layers": len(self.ensemble.weights),
                "baseline": None if self.baseline is None else self.baseline.document()}

    def arrays(self) -> dict[str, Tensor]:
        """Return scaling and weights."""
        named = {f"ensemble.{i}": tensor for i, tensor in enumerate(self.ensemble.tensors())}
        return named | {key: getattr(self, key) for key in ("floor", "centre", "spread", "parity", "lowest", "highest")}
