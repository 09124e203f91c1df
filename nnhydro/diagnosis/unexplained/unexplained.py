"""What no finding explains: how much of it there is, on what it depends, a hum, and the candidates that came near."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.constants import DETECTED, FORM, MATERIAL, P_ALARM, UNLIKE_NOISE
from nnhydro.diagnosis.decision.decide import Decision
from nnhydro.diagnosis.decision.heldout_errors import HeldoutErrors, Residual, fitted_error
from nnhydro.diagnosis.decision.parameters_per_recording import recordings_with_changed_parameters
from nnhydro.diagnosis.model.evidence import WhiteRows
from nnhydro.diagnosis.noise.spectrum import Noise
from nnhydro.diagnosis.problem.design import Design
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.unexplained.common_cause import CommonCause, common_cause
from nnhydro.diagnosis.unexplained.residual_location import Location, locate
from nnhydro.diagnosis.unexplained.spectral_lines import TESTS, Line, strongest
from nnhydro.recordings.filtering.trajectory import step_level, white_level

Array = NDArray[np.float64]
LEAST_SHARE = 0.25  # least share of the unknown's energy at a joint for a variable to be reported
NEAREST = 4  # most rejected candidates that are reported
QUIET, FEWEST_ALIKE = 20, 4  # percentile of the remaining energy beside which a recording is loud, and fewest recordings with it


@final
@dataclass(frozen=True)
class Dependence:
    """What the unknown at one joint (from 1) depends on: its share of the torque, and variables by the energy that they hold."""

    joint: int
    share: float
    depends_on: tuple[str, ...]

    @property
    def real(self) -> bool:
        """Whether it is large enough to be reported."""
        return self.share >= MATERIAL and bool(self.depends_on)


@final
@dataclass(frozen=True)
class Remainder:
    """What the findings do not explain."""

    detected: bool
    share: float  # error that remains
    weight: float  # probability of a cause in no card: a half or more where one is detected, less elsewhere
    p_value: float
    learned: tuple[Dependence, ...] = ()
    lines: tuple[Line, ...] = ()
    nearest: tuple[Decision, ...] = ()
    recordings: tuple[str, ...] = ()  # whose remainder is no noise of theirs
    parameters_differ: bool = False  # whether other parameters of the baseline would explain these
    place: Location | None = None  # of the largest part
    common: CommonCause | None = None  # what moves joints together

    def document(self, text: Callable[[str], str] = str) -> dict[str, Any]:
        """Return what diagnosis.json holds as unexplained; `text` puts columns and units into those of the arm."""
        on = {text(x) for law in self.learned if law.real for x in law.depends_on} | {"frequency" for _ in self.lines}
        near = [{"effect": decision.effect, "joint": decision.joint or None, "gain": round(decision.statistic, 2),
                 "why": decision.reason} for decision in self.nearest]
        common = {} if self.common is None else {"common_cause": self.common.document()}
        return {"detected": self.detected, "share": self.share, "weight": self.weight, "depends_on": sorted(on) if self.detected else [],
                "lines": [text(line.sentence()) for line in self.lines], "share_by_joint": [round(law.share, 4) for law in self.learned],
                "nearest": near} | common


def _scale(design: Design) -> Array:
    """What a remainder is a share of, (joints,) N m: the torque; where nothing is driven, FORM of the weight or inertia at least."""
    made: Array = np.maximum(design.scale, FORM * design.part_scale if design.undriven else 1e-300)
    return made


def unknown_parts(search: Search, found: ScoredSet) -> tuple[Dependence, ...]:
    """Return on what the unknown of a set depends at every joint, what the baseline can take left out."""
    whitened, design = search.view.whitened, search.view.library.design
    made = []
    for j in range(whitened.joints):
        at = slice(whitened.p + j * whitened.m, whitened.p + (j + 1) * whitened.m)
        eta, names = found.fit.mean[at], whitened.unknown.names
        energy = np.zeros(len(names))
        for g in range(len(names)):
            energy[g] = _energy(whitened.unknown.Phi @ np.where(whitened.unknown.group == g, eta, 0.0), design.Y[:, j], design.duration)
        total = _energy(whitened.unknown.Phi @ eta, design.Y[:, j], design.duration)
        order = [g for g in np.argsort(-energy).tolist() if energy[g] > LEAST_SHARE * energy.sum()] if energy.sum() > 0 else []
        made.append(Dependence(j + 1, float(np.sqrt(total)) / float(_scale(design)[j]), tuple(names[g] for g in order[:3])))
    return tuple(made)


def _energy(u: Array, Y: Array, time: float) -> float:
    if Y.shape[1]:
        u = u - Y @ np.linalg.lstsq(Y, u, rcond=None)[0]
    return float((u**2).sum() / time)


def p_of(search: Search, found: ScoredSet) -> float:
    """Return a bound on the p of "no unknown beside this set": odds halved in nats for noise that is only nearly white, over all sizes."""
    sizes = found.sizes.tau.size
    return float(np.clip(sizes * np.exp(-found.unknown_nats / 2), 1e-12, 1.0))


def unlike_recordings(noise: Noise, design: Design) -> tuple[str, ...]:
    """Return the recordings in which more remains, beside the white noise of their torque, than in others by a factor of 1 / `FORM`.

    Recordings may be as noisy as they like; but what moves in one alone (a stop that is hit, a zero that was lost) shows in the band and
    not in what the sensor adds from sample to sample. Where the drive jumps, the torque does: a jump is known to a row, and what that
    leaves in the band says nothing.
    """
    problem = design.problem
    remaining = np.sqrt(noise.sigma2 * noise.S.mean(axis=1))
    white, stepped = np.full((2, problem.groups, design.y.shape[1]), np.nan)
    for stretch in problem.stretches:
        if not stretch.segment.steady and stretch.segment.tau is not None:
            level = white_level(stretch.segment.tau)
            assert level is not None
            white[stretch.group] = np.maximum(level, 1e-9 * design.scale)
            stepped[stretch.group] = np.maximum(step_level(stretch.segment.tau), white[stretch.group])
    counted = np.isfinite(white).all(axis=1)
    if counted.sum() < FEWEST_ALIKE:
        return ()
    usual = np.percentile((remaining / white)[counted], QUIET, axis=0)
    large = np.sqrt(noise.sigma2 * noise.S.sum(axis=1)) * np.sqrt(problem.edge / noise.S.shape[1]) > MATERIAL * design.scale
    groups = np.flatnonzero(((FORM * remaining > usual * stepped) & large).any(axis=1) & counted)
    return tuple(dict.fromkeys(stretch.name for g in groups.tolist() for stretch in problem.stretches if stretch.group == g))


def _whiten(remains: Sequence[Residual], whitened: WhiteRows) -> list[Residual]:
    """Return the residuals of every block with all frequencies divided by their noise."""
    problem, made = whitened.design.problem, []
    for i, (block, part) in enumerate(zip(problem.blocks, remains, strict=True)):
        c = problem.transform(replace(block, start=0, stop=len(part.r)), part.r)
        made.append(replace(part, r=part.r if block.steady else problem.inverse(block, c * whitened.sw[problem.block_of == i])))
    return made


def unlisted_weight(unknown_nats: float, material: bool, alarms: Sequence[float]) -> float:
    """Return the probability of a cause outside the catalogue, from the unknown where it is `material`, and from the p-values of `alarms`.

        1 / (1 + exp((DETECTED - nats) / 2))        the unknown; 0 where it is too small to be reported
        1 / (1 - e p ln p)                          an alarm: the largest weight that its p-value allows at even odds

    Source: Sellke, Bayarri and Berger (2001), Am. Stat. 55.
    """
    of_unknown = float(1.0 / (1.0 + np.exp(np.clip((DETECTED - unknown_nats) / 2, -50, 50)))) if material else 0.0
    return max([of_unknown, *(float(1.0 / (1.0 - np.e * p * np.log(p))) for p in np.clip(alarms, 1e-12, np.exp(-1.0)))])


def unexplained_of(search: Search, found: ScoredSet, heldout: HeldoutErrors, decisions: Sequence[Decision], floor: float,
                   noise: Noise) -> Remainder:
    """Return what the claimed set `found` leaves; `floor` is the error of `noise` alone."""
    parts = unknown_parts(search, found)
    design = search.view.library.design
    flat = _whiten(heldout.remains, search.view.whitened)
    found_lines = [strongest(heldout.remains, joint, design.problem.edge, flat) for joint in range(search.view.whitened.joints)]
    lines = tuple(line for line, scale in zip(found_lines, _scale(design).tolist(), strict=True)
                  if line is not None and line.material and line.amplitude >= np.sqrt(2) * MATERIAL * scale)
    material = any(part.share >= MATERIAL for part in parts)
    real = found.unknown_nats >= DETECTED and material
    differing = recordings_with_changed_parameters(search, found)
    recordings = differing or unlike_recordings(noise, design)
    least = min(heldout.after, fitted_error(search, found, heldout))
    unlike = bool(recordings) or (least > UNLIKE_NOISE * floor and least - floor > MATERIAL)
    common = common_cause(search, found)
    alarms = [*([P_ALARM] if unlike or common else []), *(TESTS * line.p_value for line in lines)]
    p = max(min([p_of(search, found) if real else 1.0, *alarms]), 1e-12)
    weight = unlisted_weight(found.unknown_nats, material, alarms)
    near = tuple(sorted((decision for decision in decisions if not decision.claimed), key=lambda d: -d.statistic))[:NEAREST]
    return Remainder(real or bool(alarms), heldout.after, weight, p, parts if real else (), lines,
                     near if real else (), recordings, bool(differing),
                     next(iter(locate(heldout.remains, np.sqrt(noise.noise_variance.sum(axis=0) / design.duration))), None), common)
