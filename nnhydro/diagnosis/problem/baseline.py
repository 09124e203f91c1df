"""What the recordings are compared with: a physics model by name or from a file, any other model file, or the user's own column.

In each case, physics may be recalibrated with it: the columns of a physics model stand next to every hypothesis. A simulation from outside
stays as it is, and these columns hold changes of it.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.errors import ConfigError, RecordingError, count_text
from nnhydro.fitting.identify import start_terms, versions
from nnhydro.fitting.linear.prior import Prior, against_stated, prior
from nnhydro.models.baselines import BASELINES, NamedBaseline
from nnhydro.models.baselines import baseline as baseline_called
from nnhydro.models.corrected_simulation import CorrectedSimulation
from nnhydro.models.seen import SEEN
from nnhydro.models.stated_terms import STATED_COULOMB
from nnhydro.models.storage import MODEL, load_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.added_mass import AddedMass
from nnhydro.physics.motion import Motion
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit

Array = NDArray[np.float64]
COLUMN = "column"
WIDER = 3.0  # prior deviations of added mass over those of a cylinder: a rolling ship has a C_M of 10


@final
@dataclass(frozen=True, eq=False)
class Baseline:
    """The baseline by `name`: physics whose parameters are theta = mean + F z, z ~ N(0, 1), as `prior` says.

    `simulated` is another model whose torque is compared; `column` says that the recordings hold the simulation themselves. `calibrated`:
    the coefficients of the water are fitted; else they stay.
    """

    name: str
    physics: StripTheory
    prior: Prior
    simulated: TorqueModel | None = None
    column: bool = False

    @property
    def is_physics(self) -> bool:
        """Whether the physics itself is the baseline."""
        return self.simulated is None and not self.column

    def target(self, segment: Segment, Y: Array, c0: Array) -> Array:
        """Return the torque (n, joints) N m less the baseline's at z = 0; `Y` (n, joints, p), `c0` (n, joints): columns and fixed torque.

        Raises RecordingError where the recording holds no simulated torque and should.
        """
        assert segment.tau is not None
        if self.column:
            if segment.tau_sim is None:
                raise RecordingError(f"{segment.recording}: has no column tau1_sim_Nm: --baseline column compares with the simulation that "
                                     "the recordings hold; add it to every one, or name another baseline")
            return segment.tau - segment.tau_sim
        if self.simulated is not None:
            simulated: Array = self.simulated.torque(Motion.of(segment)).numpy()
            return segment.tau - simulated
        calibrated: Array = c0 + Y @ self.prior.mean
        return segment.tau - calibrated

    def with_fixed(self, direction: Array) -> "Baseline":
        """Return the baseline whose parameters z (r,) move only across `direction` (r,); what it does not touch keeps its bounds."""
        F, touching = self.prior.F, np.flatnonzero(direction)
        if not len(touching):
            return self
        others = np.flatnonzero(direction == 0)
        rest = np.linalg.svd(direction[touching][None, :])[2][1:].T
        free = np.full(rest.shape[1], np.inf)
        return replace(self, prior=Prior(self.prior.mean, np.concatenate([F[:, touching] @ rest, F[:, others]], axis=1),
                                         np.concatenate([-free, self.prior.lowest[others]]),
                                         np.concatenate([free, self.prior.highest[others]])))

    def with_more(self, count: int) -> "Baseline":
        """Return the baseline with `count` further values z that change none of its parameters."""
        known, free = self.prior, np.full(count, np.inf)
        F = np.concatenate([known.F, np.zeros((len(known.F), count))], axis=1)
        return replace(self, prior=Prior(known.mean, F, np.concatenate([known.lowest, -free]), np.concatenate([known.highest, free])))

    def within(self, z: Array) -> Array:
        """Return the parameters z (r,) cut at their physical bounds."""
        made: Array = np.clip(z, self.prior.lowest, self.prior.highest)
        return made

    def at(self, z: Array) -> StripTheory:
        """Return the physics with the parameters of `z` (r,)."""
        return replace(self.physics, loads=self.physics.loads.with_linear(self.prior.mean + self.prior.F @ z))

    def recalibration(self, z: Array) -> dict[str, list[float]]:
        """Return the water's coefficients at `z` (r,), one value per link; of a simulation, whose values are unknown, their change."""
        made, start = self.at(z).loads.terms, self.at(np.zeros(len(z))).loads.terms
        pairs = (("cd", "normal_drag", "C_D"), ("cm", "added_mass", "C_M"))
        return {key: [value - (0.0 if self.is_physics else before) for value, before in
                      zip(getattr(made[term], symbol), getattr(start[term], symbol), strict=True)]
                for key, term, symbol in pairs if term in made}

    def against_stated(self, z: Array) -> dict[str, list[str]]:
        """Return what the parameters at `z` (r,) say against arm.yaml, under the key of the result file; nothing beside a simulation."""
        if not self.is_physics:
            return {}
        model = self.at(z)
        angle = getattr(model.loads.terms.get(STATED_COULOMB), "bending_rad", 0.0)
        bent = [f"The dry friction that arm.yaml states builds up over {angle:.2g} rad after a reversal (presliding)"] if angle else []
        return {"against_stated": against_stated(model.loads, self.prior, self.prior.mean + self.prior.F @ z, model.arm) + bent}

    def as_model(self, z: Array) -> TorqueModel:
        """Return the calibrated baseline as a model to be saved."""
        record = {"kind": "calibrated baseline of a diagnosis", "versions": versions()}
        if self.simulated is not None:
            return self.simulated
        if self.column:
            return CorrectedSimulation(self.physics.arm, self.physics.preparation, record, None, self.physics, self.physics)
        return replace(self.at(z), fit=record)


def baseline_of(named: str | None, arm: Arm, units: tuple[Unit, ...], how: Preparation) -> Baseline:
    """Return what `named` asks for: a baseline by name, a model folder, or "column"; by default constant, rigid where the arm is dry.

    Raises ConfigError for a name that is none of these, ModelError for a folder that cannot be read or was made for another arm.
    """
    usual = "rigid" if arm.dry else "constant"
    if named is None or named in BASELINES:
        return _physics(baseline_called(named or usual), arm, units, how)
    default = _physics(baseline_called(usual), arm, units, how)
    if named == COLUMN:
        return replace(default, name=COLUMN, column=True)
    if not (Path(named) / MODEL).is_file():
        raise ConfigError(f"--baseline {named}: neither a baseline ({', '.join(BASELINES)}), nor {COLUMN}, nor a model folder "
                          f"(no {MODEL}): nnhydro identify and train write one")
    model = load_model(Path(named))
    if model.arm.n_links != arm.n_links:
        raise ConfigError(f"--baseline {named}: is a model of {count_text(model.arm.n_links, 'joint')}, the campaign's arm has "
                          f"{arm.n_links}")
    if isinstance(model, StripTheory) and not model.instruments and model.loads.linear():
        from_file = _physics(NamedBaseline(model.name, "a model file", lambda _: model.loads, calibrated=True), arm, units, how)
        return replace(from_file, physics=replace(from_file.physics, fit={SEEN: model.fit.get(SEEN)}))
    return replace(default, name=named, simulated=model)


def _physics(chosen: NamedBaseline, arm: Arm, units: tuple[Unit, ...], how: Preparation) -> Baseline:
    loads = start_terms(chosen, units, arm)
    return Baseline(chosen.name, StripTheory(arm, how, {SEEN: []}, chosen.name, loads), _widen(prior(loads, arm), loads))


def _widen(known: Prior, loads: Loads) -> Prior:
    """Return `known` with the coefficients of added mass `WIDER` times as free: a hull's is no cylinder's."""
    free = [isinstance(term, AddedMass) for term in loads.linear().values() for _ in term.linear_values()]
    wide = np.array([bool(np.any(column[np.array(free, dtype=bool)])) for column in known.F.T], dtype=bool)
    factor = np.where(wide, WIDER, 1.0)
    return Prior(known.mean, known.F * factor, known.lowest / factor, known.highest / factor)
