"""What a diagnosis says: everything diagnosis.json holds, and the two models."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from nnhydro.diagnosis.constants import NULL_QUANTILE, RELEVANT
from nnhydro.diagnosis.decision.decide import Decision
from nnhydro.diagnosis.decision.heldout_errors import HeldoutErrors
from nnhydro.diagnosis.decision.other_bands import OtherBand
from nnhydro.diagnosis.experiment.proposal import Proposal
from nnhydro.diagnosis.findings.finding import Finding
from nnhydro.diagnosis.problem.impossible_coefficients import MOST_LEFT
from nnhydro.diagnosis.unexplained.residual_location import SHOWN, Location, few_names
from nnhydro.diagnosis.unexplained.unexplained import Remainder
from nnhydro.effects.catalogue import catalogue
from nnhydro.models.stated_terms import STATED_COULOMB, stated_values
from nnhydro.models.torque_model import TorqueModel
from nnhydro.sheet import percent

SCHEMA = "nnhydro/diagnosis/1"
NEXT = "next_experiment.csv"
RECALIBRATED = 1.1  # error as given over that of the recalibrated baseline; from here on the verdict reports the recalibration


@final
@dataclass(frozen=True, eq=False)
class DiagnosisResult:
    """The mismatch between a baseline and a campaign: is there one, where, what is omitted, and the errors on held-out recordings."""

    baseline: TorqueModel
    corrected: TorqueModel
    baseline_name: str
    seconds: float
    p_value: float
    noise_floor: float
    heldout: HeldoutErrors
    location: list[Location]
    findings: list[Finding]
    remainder: Remainder
    decisions: tuple[Decision, ...]
    checks: dict[str, Any]
    other_bands: tuple[OtherBand, ...]
    following: Proposal | None
    recalibrated: dict[str, list[float]]
    versions: dict[str, str]
    rehearsal: dict[str, Any] | None = None

    @property
    def detected(self) -> bool:
        """Whether there is a mismatch beyond noise and recalibration, or one that only impossible coefficients explain."""
        by_chance = 1 - NULL_QUANTILE  # as often as a claim
        return self.p_value <= by_chance or bool(self.checks.get("impossible_coefficients"))

    def document(self) -> dict[str, Any]:
        """Return what diagnosis.json holds."""
        given = {} if self.heldout.as_given is None else {"error_as_given": self.heldout.as_given}
        rehearsal = {} if self.rehearsal is None else {"rehearsal": self.rehearsal}
        return {"schema": SCHEMA, "baseline": self.baseline_name, "seconds": round(self.seconds, 2),
                "mismatch": {"detected": self.detected, "p_value": self.p_value, "error": self.heldout.before,
                             "noise_floor": self.noise_floor, "scale": self.heldout.scale, **given},
                "decisions": [decision.document() for decision in self.decisions],
                "other_bands": [band.document() for band in self.other_bands],
                "location": [place.document() | {"where": self.baseline.arm.text(place.where)} for place in self.location if self.detected],
                "findings": [finding.document() for finding in self.findings],
                "indistinguishable": [list(finding.equivalence_set) for finding in self.findings if len(finding.equivalence_set) > 1],
                "unexplained": self.remainder.document(self.baseline.arm.text), "proof": self.checks, "recalibrated": self.recalibrated,
                "next_experiment": None if self.following is None else self.following.document(NEXT), "versions": self.versions} | rehearsal

    def _remains(self) -> str:
        """What no finding explains, as a sentence; empty where nothing is left but noise."""
        if not self.remainder.detected:
            return ""
        floor = f"Noise alone would leave {percent(self.noise_floor)}: a" if self.noise_floor < self.heldout.after else "A"
        return f" {floor} systematic residual remains that no known effect explains.{self._depends('It')}"

    def _depends(self, subject: str) -> str:
        """On what the unknown depends, or in which recordings it lies, and whether one cause loads several joints; empty where unknown."""
        common = self.remainder.common
        return self._state_or_place(subject) + (f" {subject} {common.sentence}." if common is not None else "")

    def _state_or_place(self, subject: str) -> str:
        """On what the unknown depends, or in which recordings it lies."""
        on = [f"{', '.join(part.depends_on)} at joint {part.joint}" for part in self.remainder.learned if part.real]
        if on:
            return f" {subject} depends on {' and on '.join(on)}."
        if self.remainder.lines:
            return ""
        few, differ, place = self.remainder.recordings, self.remainder.parameters_differ, self.remainder.place
        there = few_names(few)
        lies = f"lies in {there}" if few and not differ else "" if place is None else place.sentence
        why = f" Mass, drag or added mass in {there} differ from those of the other recordings." if differ else ""
        return f"{f' {subject} {lies}.' if lies else ''}{why}"

    def verdict(self) -> str:
        """Return the finding of the diagnosis in plain words."""
        said = (self._findings_text() if self.findings else self._no_finding_text()) + self._simulation()
        lines = [*self.checks.get("impossible_coefficients", []), *self.checks.get("against_stated", [])]
        stated = " ".join(f"{line}." for line in lines[:SHOWN])
        denied = "; ".join(self.checks.get("denied_channels", []))
        first = f"Nothing below can be relied on before this is corrected (`nnhydro check` says how): {denied}." if denied else ""
        return " ".join(self.baseline.arm.text(f"{first} {said} {stated} {self.checks.get('left_out', '')} {self._above_band()}").split())

    def _above_band(self) -> str:
        """How much of the torque lies above the band, as a sentence; empty where it is less than MOST_LEFT."""
        share = self.checks.get("torque_above_band", 0.0)
        if share <= MOST_LEFT:
            return ""
        return (f"{100 * share:.0f} % of the torque's rms lies above {self.checks['band_hz']:.2g} Hz and was not compared with the model. "
                "If it is not noise, state a higher cut-off (`--cutoff`).")

    def _simulation(self) -> str:
        """What recalibration beside the user's own simulation does, as a sentence; empty for physics of ours, or where it does nothing."""
        given = self.heldout.as_given
        if given is None or given < RECALIBRATED * self.heldout.before:
            return ""
        changes = [f"{symbol} changes by {', '.join(f'{x:+.2f}' for x in self.recalibrated[key])}"
                   for key, symbol in (("cd", "C_D"), ("cm", "C_M")) if key in self.recalibrated]
        return (f" The simulation itself has an error of {percent(given)}. With masses and coefficients refitted, "
                f"{percent(self.heldout.before)} remains{': ' if changes else ''}{', '.join(changes)}.")

    def _findings_text(self) -> str:
        following = "" if self.following is None else f" {self.following.statement()}"
        bands = "".join(f" {band.sentence()}" for band in self.other_bands if band.lost)
        with_them = "With this effect in the model" if len(self.findings) == 1 else "With these effects in the model"
        noisy = (f" Noise alone is {100 * self.noise_floor:.0f} % of the torque: these recordings cannot show what else is missing."
                 if self.noise_floor > MOST_LEFT and not self.remainder.detected else "")
        gained = f"{self._error_text(with_them)}{bands}{self._remains()}{noisy}{following}"
        statements = [f"{finding.statement}{finding.equivalents()}{self._stated_friction(finding)}{self._unequal_friction(finding)}"
                      for finding in self.findings]
        return " ".join([*statements, gained])

    def _error_text(self, with_them: str) -> str:
        """What the findings do to the error on what was held out, or why they do nothing to it."""
        before, after = percent(self.heldout.before), percent(self.heldout.after)
        if self.heldout.after < (1 - RELEVANT) * self.heldout.before:
            return f"{with_them}, the error on {self.heldout.unit} held out of the fit falls from {before} to {after}."
        if not all(finding.predicted for finding in self.findings):
            why = ("Its phase wanders, and cannot be predicted" if any(finding.law.per_recording for finding in self.findings) else
                   "When it acts cannot be predicted, and its values are less certain than the intervals say")
            return f"{why}: the error on {self.heldout.unit} held out of the fit remains {before}."
        return f"A fit without it has the same error, {before}, but moves masses or coefficients beyond their uncertainty."

    def _stated_friction(self, finding: Finding) -> str:
        """How much of the dry friction in arm.yaml a fit leaves beside a dry friction that was found; empty where none is stated."""
        stated, known = stated_values(self.baseline.arm).get(STATED_COULOMB, (np.zeros(0), np.zeros(0)))
        fitted = getattr(getattr(self.corrected, "loads", None), "terms", {}).get(STATED_COULOMB)
        if finding.family != "dry_friction" or fitted is None or not finding.joint or not any(stated[finding.joint - 1:finding.joint]):
            return ""
        left, said, sd = fitted.level[finding.joint - 1], stated[finding.joint - 1], known[finding.joint - 1]
        level = next(iter(finding.parameters.values())).value
        same = ": the total is as large as stated, but it builds up over another angle or speed" if abs(left + level - said) <= sd else ""
        return f" The fit keeps {left:.2g} N m of the {said:.2g} N m that arm.yaml states, in addition{same}."

    def _unequal_friction(self, finding: Finding) -> str:
        """That an offset of the torque at a joint with dry friction may be part of this friction; empty for other findings."""
        rubs = any(other.family == "dry_friction" and other.joint == finding.joint for other in self.findings)
        if finding.effect != "torque_bias" or not rubs:
            return ""
        return " Dry friction that differs between the directions has the same torque while the joint turns."

    def _no_finding_text(self) -> str:
        if self.detected:
            hum = "".join(f" There is {line.sentence()}." for line in self.remainder.lines)
            return ("Recordings and model differ beyond noise and recalibration, but no known effect explains the difference well enough "
                    "to be named."
                    f"{hum}{self._depends('The difference')}")
        if self.noise_floor > MOST_LEFT:
            return (f"These recordings are too noisy for a diagnosis: noise alone is {100 * self.noise_floor:.0f} % of the torque, and no "
                    "effect exceeds it. Record longer or stronger motions, or repeat these. If the motion has frequencies above the "
                    "cut-off that `nnhydro check` prints, state a higher one (`--cutoff`).")
        small = [decision for decision in self.decisions if decision.small]
        if small:
            return "No missing physics of consequence was detected." + "".join(map(_small_text, small))
        return "No missing physics was detected. The remaining differences are consistent with noise or with recalibrated coefficients."


def _small_text(decision: Decision) -> str:
    """Return that an effect is likely, but too small to be named, as a sentence."""
    name = catalogue()[decision.effect].name
    where = f" at joint {decision.joint}" if decision.joint else ""
    return f" {name[:1].upper()}{name[1:]}{where} is likely, but too small to be named: {decision.reason}."
