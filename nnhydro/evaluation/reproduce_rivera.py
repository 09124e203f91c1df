"""Rivera's identifier as a study: inputs, layers, neurons, recordings, the gain matrix, and an arm of another L/D.

The text of Rivera (1995) that we have ends in section 4.2: his input sets, networks and results (sections 4.3 to 5) are lost, and no
figure of his can be compared. The study asks his questions of a campaign. Errors are sum |tau - network| / sum |tau| on recordings that
no network was shown.

    measured torques     inputs x layers, neurons x layers, training set
    analytic torques     of the campaign's motions: gain matrix against the analytic one, and arms of another L/D held out

An analytic torque is that of fitted constants; on arms of another diameter its coefficients follow Wieselsberger's C_D(L/D).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nnhydro.evaluation.rivera import Identifier, TrainingSet, train_network
from nnhydro.fitting.linear.several_arms import calibrated_on
from nnhydro.models.baselines import BASELINES
from nnhydro.models.gains.matrix import gain_matrix
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.coefficients.aspect_ratio import added_mass_coefficient, drag_coefficient
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.loads.normal_drag import NormalDrag
from nnhydro.physics.loads.rigid_body import RigidBody
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.repeats import group_names
from nnhydro.recordings.splitting import Unit, folds, units
from nnhydro.sheet import percent

Array = NDArray[np.float64]
Say = Callable[[str], None]
INPUT_SETS: Final = {
    "states": ("raw",),
    "dimensional": ("dimensional",),
    "dimensional, angle": ("dimensional", "angles"),
    "groups": ("groups",),
    "groups, angle, h/D": ("groups", "angles", "arm"),
    "and friction": ("groups", "angles", "arm", "rates"),
    "and Morison's torques": ("groups", "angles", "arm", "rates", "morison"),
}
USUAL: Final = "and friction"  # dimensionless inputs, planar angle, parallel distance and friction: as near as the text comes
LAYERS: Final = ("common", "parallel")
NEURONS: Final = (4, 8, 16, 32, 64)
SHARES: Final = (0.25, 0.5, 0.75, 1.0)  # of the recordings
SLENDER: Final = (0.7, 1.0, 1.4)  # times the campaign's L/D
FOLDS: Final = 5
STATES: Final = 200  # at which gains are compared
GAINS: Final = ("qd", "qdd")
NOT_IN_TEXT: Final = (
    "sections 4.3 to 5: his input sets, his networks and the figures 5-1 to 5-24: no number and no figure of his can be compared",
    "his measurements: a campaign stands in for them, by default the synthetic one that ships with the package",
)


@final
@dataclass(frozen=True, eq=False)
class RiveraReproduction:
    """Errors by choice, gains (n, joints, links) of network and analytic model by input, and one recording held out."""

    inputs: dict[str, dict[str, float]]  # set, layers
    neurons: dict[int, dict[str, float]]  # neurons, layers
    training: dict[int, float]  # recordings and groups of steady runs trained on
    constant: float  # error of fitted constants on the same recordings
    gains: dict[str, tuple[Array, Array]]  # network, analytic
    gain_error: dict[str, float]
    slenderness: dict[float, float]  # factor on L/D of the arm held out
    held_out: str
    t: Array
    measured: Array
    network: Array

    def document(self) -> dict[str, Any]:
        """Return the numbers for programs."""
        return {"inputs": self.inputs, "neurons": {str(n): e for n, e in self.neurons.items()},
                "training_set": {str(n): e for n, e in self.training.items()}, "constant": self.constant, "gain_error": self.gain_error,
                "slenderness_left_out": {f"{x:g}": e for x, e in self.slenderness.items()}, "not_in_the_text": list(NOT_IN_TEXT)}


def of_slenderness(arm: Arm, factor: float) -> Arm:
    """Return the arm with its L/D times `factor`: other diameters, the same links."""
    links = tuple(link.model_copy(update={"diameter_m": link.diameter_m / factor}) for link in arm.links)
    return arm.model_copy(update={"links": links})


def analytic(model: StripTheory, arm: Arm) -> StripTheory:
    """Return fitted constants on another arm: C_D and C_M times what Wieselsberger and DNV give for its L/D over that of their own."""
    fitted, other = (torch.tensor([link.length_m / link.diameter_m for link in links], dtype=torch.float64)
                     for links in (model.arm.links, arm.links))
    drag, mass = model.loads.terms["normal_drag"], model.loads.terms["added_mass"]
    assert isinstance(drag, NormalDrag)
    assert isinstance(mass, AddedMass)
    C_D, C_M = (tuple((torch.tensor(values, dtype=torch.float64) * law(other) / law(fitted)).tolist())
                for values, law in ((drag.C_D, drag_coefficient), (mass.C_M, added_mass_coefficient)))
    loads = Loads({"rigid_body": RigidBody.of_arm(arm), "normal_drag": NormalDrag(C_D), "added_mass": AddedMass(C_M)})
    return StripTheory(arm, model.preparation, {}, "constant", loads)


def states_of(chosen: Sequence[Unit], count: int = STATES) -> Motion:
    """Return at most `count` states of the recordings among `chosen`, evenly spaced."""
    motions = [Motion.of(segment) for unit in chosen if not unit.steady for segment in unit.segments()]

    def every(name: str) -> Tensor:
        whole: Tensor = torch.cat([getattr(m, name) for m in motions])
        return whole[::len(whole) // count + 1]

    return Motion.at(*(every(name) for name in ("q", "qd", "qdd", "u0", "du0")))


def _gains(network: Any, truth: Any, at: Motion) -> dict[str, tuple[Array, Array]]:
    found = [gain_matrix(model, at) for model in (network, truth)]
    return {name: (getattr(found[0], name).numpy(), getattr(found[1], name).numpy()) for name in GAINS}


def _slenderness(choice: Identifier, fitted: Sequence[Unit], left: Sequence[Unit], base: StripTheory) -> dict[float, float]:
    """Error on each arm held out of the training, on motions held out too."""
    arms = {factor: of_slenderness(base.arm, factor) for factor in SLENDER}

    def training_set(chosen: Sequence[Unit], factor: float) -> TrainingSet:
        arm = arms[factor]
        return TrainingSet([replace(unit, arm=arm) for unit in chosen], arm, analytic(base, arm))

    found = {}
    for factor in SLENDER:
        network = train_network(choice, [training_set(fitted, other) for other in SLENDER if other != factor], base.preparation)
        found[factor] = training_set(left, factor).error(network)
    return found


def reproduce(campaign: Campaign, seed: int = 0, epochs: int = 150, say: Say = lambda text: None) -> RiveraReproduction:
    """Return the study on `campaign`, two links and water; some thirty trainings, each reported by `say`."""
    how, arm = campaign.plan(), campaign.arm
    every = units(campaign, how, seed, group_names(campaign))
    out = folds(every, FOLDS, seed)[0]
    left, fitted = [every[i] for i in out], [unit for i, unit in enumerate(every) if i not in out]
    judge, usual = TrainingSet(left, arm), Identifier(INPUT_SETS[USUAL], epochs=epochs, seed=seed)

    def error(choice: Identifier, chosen: Sequence[Unit] = fitted) -> float:
        """Return the error of a network trained with `choice` on the units `chosen`, and print it."""
        found = judge.error(train_network(choice, [TrainingSet(chosen, arm)], how))
        say(f"{', '.join(choice.inputs)}; {choice.layers}; {choice.neurons} neurons; {len(chosen)} units: {100 * found:.1f} %")
        return found

    inputs = {name: {kind: error(replace(usual, inputs=sets, layers=kind)) for kind in LAYERS} for name, sets in INPUT_SETS.items()}
    neurons = {n: {kind: error(replace(usual, neurons=n, layers=kind)) for kind in LAYERS} for n in NEURONS}
    order = np.random.default_rng(seed).permutation(len(fitted))
    sizes = [max(2, round(share * len(fitted))) for share in SHARES]
    training = {size: error(usual, [fitted[i] for i in sorted(order[:size])]) for size in sizes}
    base = calibrated_on(BASELINES["constant"], fitted, arm, how)
    taught = train_network(usual, [TrainingSet(fitted, arm, base)], how)
    gains = _gains(taught, base, states_of(left))
    gain_error = {name: float(np.abs(a - b).sum() / np.abs(b).sum()) for name, (a, b) in gains.items()}
    best = train_network(usual, [TrainingSet(fitted, arm)], how)
    unit = next(unit for unit in left if not unit.steady)
    segment = unit.segments()[0]
    assert segment.tau is not None
    return RiveraReproduction(inputs, neurons, training, judge.error(base), gains, gain_error, _slenderness(usual, fitted, left, base),
                              unit.name, segment.t, segment.tau, segment.filter(best.torque(Motion.of(segment)).numpy()))


def table(result: RiveraReproduction) -> list[tuple[str, str, str]]:
    """Return rows (what, common layers, parallel layers) for the screen."""
    rows = [(f"inputs: {name}", percent(e["common"]), percent(e["parallel"])) for name, e in result.inputs.items()]
    rows += [(f"{n} neurons", percent(e["common"]), percent(e["parallel"])) for n, e in result.neurons.items()]
    rows += [(f"trained on {n} recordings or groups of runs", percent(e), "") for n, e in result.training.items()]
    rows.append(("fitted constants, for comparison", percent(result.constant), ""))
    rows += [(f"gain matrix d tau/d {name} off the analytic one", percent(e), "") for name, e in result.gain_error.items()]
    return rows + [(f"arm of {x:g} times the L/D held out", percent(e), "") for x, e in result.slenderness.items()]
