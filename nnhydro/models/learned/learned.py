"""The learned models: `network` (all of the torque) and `hybrid` (a calibrated baseline plus a bounded residual).

What is learned is a linear part, solved in closed form, and the ensemble of networks for what it leaves:

    tau = base + free + (1 - k w) shrink( phi g S bounded( law / S + x_odd K + y(x) ) ) + k w phi (rigid + net - base)

`free` (free_part.py) is what the mirror image of the rig need not repeat, as the pull of a line that is fixed to the tank; all else changes
sign with it. It stands beside the baseline: what it is worth does not depend on the water, whose scale S bounds the rest. `net`
(strip_net.py) is a memory of the strips that was trained as a whole: it stands for baseline and all that is learned beside it, by the
share w that recordings held out of both confirm. k falls from 1 to 0 where the base moves faster than in its training. A network has no
base, and neither shrinks nor fades.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, final

import torch
from torch import Tensor

from nnhydro.features.feature_set import View, features
from nnhydro.features.scaling import acceleration_scale, morison_scale, speed_scale
from nnhydro.features.strip_law.neurons import COUNT, LENGTH
from nnhydro.features.wake import LASTING, SWINGING, TRAVEL
from nnhydro.models.baselines import BASELINES
from nnhydro.models.learned.linear_parts import FreePart, StripLaw
from nnhydro.models.learned.network import Ensemble, odd_output, soft_bound
from nnhydro.models.learned.shrinkage import jackknife, shrink
from nnhydro.models.learned.strip_inputs import rigid_torque
from nnhydro.models.learned.strip_net import StripNet
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion
from nnhydro.physics.transmission import to_drives
from nnhydro.recordings.arm import Arm

WIDENING = 3.0  # a feature a third of its half range outside, or a link a third faster than ever, doubles the deviation
FAR = 3.0  # half ranges outside: beyond them all that can be said is that it is far
FILTERS = [list(TRAVEL), list(LASTING), list(SWINGING), [COUNT, LENGTH]]  # what the strips' water remembers: a model has one such set
LEFT_OUT = "left_out"  # in the record of the fit: the share of the recordings that each member left out of it
CAUTION = "caution"  # there: how much of the members' disagreement counts
BASELINE, LAW, FREE, WATER = "baseline.", "law.", "free.", "water."  # before the names of a part's tensors


def memory_filters(trained: bool) -> list[Any]:
    """Return what the strips' water remembers, with a trained memory beside the filters or without."""
    return [*FILTERS, "trained, with surroundings"] if trained else FILTERS


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


def swiftness(flow: Flow) -> Tensor:
    """Return the speed and the acceleration scale of every link (n, 2 links) m/s, m/s^2."""
    return torch.cat([speed_scale(flow), acceleration_scale(flow)], dim=1)


@final
@dataclass(frozen=True, eq=False)
class LearnedTorque(TorqueModel):
    """An ensemble on dimensionless features; with a `baseline`, a hybrid. Tensors are float64, single rows are cheap.

    phi = 1 / (1 + h),   h = |support' x|^2

A hybrid uses of the members' mean as much as exceeds their disagreement (shrinkage.py), a network all of it.
    h measures how far the features x lie from those of training, 1 far beyond what recordings held out of it reach: there the residual of
    a hybrid fades and the baseline remains; g (`trust`) is below 1 where recordings held out of it do not confirm it. For a network both
    are 1. std^2 = [(k s)^2 + (c S)^2 + a^2 + (u (1 - phi) S)^2] (1 + 3 e)^2 with s the scatter of the members and `doubt` = (k, c, a, u),
    calibrated on recordings that members did not train on; e, 3 at most, is the largest share of its half range by which a feature lies
    outside the range of training, or by which a link is faster or more accelerated than there.
    """

    kind: ClassVar[str] = "learned"
    feature_names: tuple[str, ...]
    bound: float
    floor: Tensor  # (joints,) N m
    centre: Tensor  # (features,)
    spread: Tensor  # (features,)
    parity: Tensor  # (features,)
    lowest: Tensor  # (features,) of the standardised inputs seen in training, mirror images included
    highest: Tensor  # (features,)
    swiftest: Tensor  # (2 links,) m/s, m/s^2: largest speed and acceleration scale of each link in training
    skip: Tensor  # (E, features, joints): K, zero for even features
    ensemble: Ensemble
    baseline: TorqueModel | None
    law: StripLaw | None = None
    free: FreePart | None = None  # None: exactly odd under the mirror
    support: Tensor | None = None  # (features, r); None: nothing is known of the distance, h = 0
    trust: Tensor | None = None  # (joints,) of a hybrid's residual; None: all of it
    doubt: Tensor | None = None  # (4, joints): k, c [-], a [N m], u [-]; None: std is the members' scatter
    water: StripNet | None = None
    share: Tensor | None = None  # (joints,): w of the strip net; None: 0

    @property
    def name(self) -> str:
        """`hybrid` with a baseline, else `network`."""
        return "network" if self.baseline is None else "hybrid"

    def standardised_features(self, view: View) -> Tensor:
        """Return the standardised features (n, k) as they are, also outside the range of training."""
        return (features(view, self.feature_names).matrix() - self.centre) / self.spread

    def within_range(self, x: Tensor) -> Tensor:
        """Return standardised features (n, k) held within the range of the training recordings."""
        return torch.minimum(torch.maximum(x, self.lowest), self.highest)

    def inputs(self, view: View) -> Tensor:
        """Return the standardised features (n, k), held within the range of the training recordings."""
        return self.within_range(self.standardised_features(view))

    def familiarity(self, x: Tensor) -> Tensor:
        """Return phi (n, 1), 1 among the training recordings to 0 far away, of standardised features x (n, k) as they are."""
        if self.support is None:
            return torch.ones_like(x[:, :1])
        return 1 / (1 + (x @ self.support).pow(2).sum(dim=1, keepdim=True))

    def fading(self, x: Tensor) -> Tensor:
        """Return how much of what is learned is used (n, 1): phi of a hybrid, all of a network, which has nothing to fade to."""
        return torch.ones_like(x[:, :1]) if self.baseline is None else self.familiarity(x)

    def excess(self, view: View, x: Tensor) -> Tensor:
        """Return e (n, 1) of standardised features x (n, k) as they are: 0 within the range of training."""
        half = ((self.highest - self.lowest) / 2).clamp(min=1.0)
        beyond = ((x - self.within_range(x)).abs() / half).amax(dim=1, keepdim=True)
        swifter = (swiftness(view.flow) / self.swiftest - 1).amax(dim=1, keepdim=True)
        return torch.maximum(beyond, swifter).clamp(0.0, FAR)

    def linear(self, view: View, x: Tensor) -> Tensor:
        """Return the linear part (E, n, joints), in units of the scale, for x (n, k) from `within_range`."""
        direct = self.within_range(x) @ self.skip
        return direct if self.law is None else direct + self.law.torque(view.flow) / view.scale

    def correction(self, x: Tensor, scale: Tensor, linear: Tensor) -> Tensor:
        """Return what each member adds to the baseline (E, n, joints) N m.

        x (n, k) from `within_range`, the Morison scale (n, joints) N m, and the linear part (E, n, joints) in units of it.
        """
        learned = scale * soft_bound(linear + odd_output(self.ensemble, self.within_range(x), self.parity), self.bound)
        return self.fading(x) * (learned if self.trust is None else self.trust * learned)

    def replacement(self, view: View, x: Tensor, base: Tensor) -> tuple[Tensor, Tensor] | None:
        """Return what the strip net puts in place of the baseline's torque, phi (rigid + net - base) (n, joints) N m; None without one.

        And how far it may be used, k (n, 1).
        """
        if self.water is None:
            return None
        net = rigid_torque(view.flow) + self.water.torque(view.flow)
        return self.fading(x) * (net - base), self.water.validity(view.flow)

    def blend(self, learned: Tensor, scatter: Tensor, replaced: Tensor, known: Tensor) -> tuple[Tensor, Tensor]:
        """Return what is added to the baseline by the share of a strip net, and the scatter to be expected, (n, joints) N m each."""
        w = known * (torch.zeros_like(learned[0]) if self.share is None else self.share)
        return learned + w * (replaced - learned), (1 - w) * scatter + w * (replaced - learned).abs()

    def members(self, motion: Motion) -> Tensor:
        """Return the sensor torques (E, n, joints) N m of each member of the ensemble, without the strip net."""
        view = view_of(self.arm, motion, self.floor)
        return self._base(motion, view) + sum(self._parts(view, self.standardised_features(view)))

    def torque(self, motion: Motion) -> Tensor:
        """Return the baseline and what is used of the correction, of a network the mean of its members, (n, joints) N m."""
        return self._predict(motion)[0]

    def std(self, motion: Motion) -> Tensor | None:
        """Return the standard deviation (n, joints) N m to be expected of measured minus predicted torque.

        Where it was never calibrated it is the members' disagreement alone; None for a single network without calibration.
        """
        return self.torque_and_std(motion)[1]

    def torque_and_std(self, motion: Motion) -> tuple[Tensor, Tensor | None]:
        """Return both of one evaluation of the members."""
        torque, scatter, view, x = self._predict(motion)
        if self.doubt is None:
            return torque, scatter if len(self.ensemble.weights[0]) > 1 else None
        return torque, (1 + WIDENING * self.excess(view, x)) * spread_of(self.doubt, scatter, view.scale, self.familiarity(x))

    def _base(self, motion: Motion, view: View) -> Tensor:
        return torch.zeros_like(view.scale) if self.baseline is None else self.baseline.torque(motion)

    def _parts(self, view: View, x: Tensor) -> tuple[Tensor, Tensor]:
        """What each member adds to the baseline (E, n, joints) N m, and its free part, (1, n, joints) where there is none."""
        free = torch.zeros_like(view.scale)[None] if self.free is None else self.free.torque(view.flow)
        return self.correction(x, view.scale, self.linear(view, x)), free

    def _predict(self, motion: Motion) -> tuple[Tensor, Tensor, View, Tensor]:
        """Torque and the scatter to be expected (n, joints) N m, the view of the motion, and its standardised features."""
        view = view_of(self.arm, motion, self.floor)
        x, base = self.standardised_features(view), self._base(motion, view)
        odd, free = self._parts(view, x)
        learned, scatter = odd.mean(dim=0), (odd + free).std(dim=0) if len(odd) > 1 else torch.zeros_like(base)
        if self.baseline is not None:
            doubted = (1 + WIDENING * self.excess(view, x)) ** 2 * jackknife(odd, self.fit.get(LEFT_OUT, 0.0), self.fit.get(CAUTION, 1.0))
            learned = shrink(learned, doubted, view.scale)
        replaced = self.replacement(view, x, base)
        if replaced is not None:
            learned, scatter = self.blend(learned, scatter, *replaced)
        return base + free.mean(dim=0) + learned, scatter, view, x

    def document(self) -> dict[str, Any]:
        """Return names, bound, layout and the baseline."""
        base = self.baseline
        return {"features": list(self.feature_names), "bound": self.bound, "layers": len(self.ensemble.weights),
                "law": None if self.law is None else list(self.law.names), "bank": memory_filters(self.water is not None),
                "baseline": None if base is None else {"kind": base.kind, "arm": base.arm.document(), "model": base.document()}}

    def arrays(self) -> dict[str, Tensor]:
        """Return scaling and weights, those of the baseline too."""
        named = {f"ensemble.{i}": tensor for i, tensor in enumerate(self.ensemble.tensors())}
        named |= {key: getattr(self, key) for key in ("floor", "centre", "spread", "parity", "lowest", "highest", "swiftest", "skip")}
        named |= {} if self.law is None else {f"{LAW}{key}": tensor for key, tensor in self.law.arrays().items()}
        named |= {} if self.free is None else {f"{FREE}{key}": tensor for key, tensor in self.free.arrays().items()}
        named |= {} if self.water is None else {f"{WATER}{key}": tensor for key, tensor in self.water.arrays().items()}
        named |= {key: tensor for key in ("support", "trust", "doubt", "share") if (tensor := getattr(self, key)) is not None}
        return named | ({} if self.baseline is None else {f"{BASELINE}{key}": value for key, value in self.baseline.arrays().items()})


def spread_of(doubt: Tensor, scatter: Tensor, scale: Tensor, familiarity: Tensor) -> Tensor:
    """Return sqrt((k s)^2 + (c S)^2 + a^2 + (u (1 - phi) S)^2) N m for scatter s and scale S (n, joints) N m and phi (n, 1)."""
    k, c, a, u = doubt
    return torch.sqrt((k * scatter) ** 2 + (c * scale) ** 2 + a**2 + (u * (1 - familiarity) * scale) ** 2)
