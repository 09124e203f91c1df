"""Fit a physics model's coefficients to the recordings of a campaign: the work behind `nnhydro identify`."""

import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
import torch
from numpy.typing import NDArray

import nnhydro
from nnhydro.conventions import Z95
from nnhydro.errors import CampaignError, require
from nnhydro.fitting.linear.least_squares import Solution, bootstrap, correlation_time, fit
from nnhydro.fitting.linear.prior import BEYOND, Prior, against_stated, prior
from nnhydro.fitting.linear.statistics import Statistics, columns_and_offset, of_columns, total
from nnhydro.fitting.travel.travel_scale import with_best_travel_scale
from nnhydro.models.baselines import NamedBaseline, baseline
from nnhydro.models.domain import DOMAIN, domain_of
from nnhydro.models.seen import SEEN, seen_record
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.loads.water_pressure import WaterPressure
from nnhydro.physics.memo import RecentMemo
from nnhydro.physics.threads import one_thread
from nnhydro.physics.travel.state_model import has_travel_scale
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.preprocessing import Preparation
from nnhydro.recordings.segment import Segment
from nnhydro.recordings.splitting import Unit, units

Array = NDArray[np.float64]
COLUMNS = 50_000_000  # bytes of columns that are kept between the two passes of a fit
DRAWS = 500  # bootstrap draws: the 2.5 % quantile is then known to about 0.7 %


@final
@dataclass(frozen=True)
class Estimate:
    """One fitted parameter with its unit and 95 % interval; `note` says what a reader must know about it."""

    name: str
    value: float
    unit: str
    ci95: tuple[float, float]
    note: str = ""

    def document(self) -> dict[str, Any]:
        """Return the estimate for result files."""
        return {"value": self.value, "unit": self.unit, "ci95": list(self.ci95)} | ({"note": self.note} if self.note else {})


def versions() -> dict[str, str]:
    """Return the versions that every result file carries."""
    return {"nnhydro": nnhydro.__version__, "python": platform.python_version(), "numpy": np.__version__, "torch": torch.__version__}


def correlation_times(columns: Callable[[Segment], tuple[Array, Array]], theta: Array, chosen: Sequence[Unit], arm: Arm) -> Array:
    """Return the residual's correlation time (joints,) in samples: the median over recordings; steady runs count as independent."""
    found = []
    for unit in chosen:
        for segment in () if unit.steady else unit.segments():
            X, c0 = columns(segment)
            assert segment.tau is not None
            residual = (segment.tau - c0 - X @ theta)[segment.keep]
            found.append([correlation_time(residual[:, j]) for j in range(residual.shape[1])])
    return np.median(found, axis=0) if found else np.ones(arm.n_links)


def fit_units(loads: Loads, chosen: Sequence[Unit], arm: Arm, before: Prior | None = None) -> tuple[Solution, list[Statistics], Prior]:
    """Fit the linear parameters of `loads` to the units `chosen`; returns solution, statistics a unit, prior.

    `before` is what is known of the parameters; by default what arm.yaml says. Raises CampaignError where no row can be fitted, or every
    torque is 0.
    """
    known = RecentMemo(COLUMNS)

    def columns(segment: Segment) -> tuple[Array, Array]:
        """Return what `columns_and_offset` gives, which is needed twice."""
        return known.of(segment, lambda: columns_and_offset(loads, segment, arm), lambda both: both[0].nbytes + both[1].nbytes)

    blocks = [total([of_columns(*columns(segment), segment) for segment in unit.segments()]) for unit in chosen if unit.segments()]
    if not blocks:
        raise CampaignError("no recording holds a stretch of finite rows long enough to fit: see nnhydro check")
    before = prior(loads, arm) if before is None else before
    summed = total(blocks)
    if not summed.s.any():
        raise CampaignError("all torques are exactly 0: what nothing drives tells its parameters only up to a common factor, and there is "
                            "no torque to learn: nnhydro diagnose holds the masses that arm.yaml states and fits the rest")
    first = fit(summed, before, np.ones(arm.n_links))
    correlation = correlation_times(columns, first.theta, chosen, arm)
    return fit(summed, before, correlation), blocks, before


def with_measured_water(loads: Loads, chosen: Sequence[Unit], arm: Arm) -> Loads:
    """Return `loads` and, where the motion of the water was recorded in one of the units, the pressure of its own acceleration."""
    if arm.dry or "water_pressure" in loads.terms:
        return loads
    moving = any(segment.current is not None for unit in chosen for segment in unit.segments())
    return loads.plus("water_pressure", WaterPressure()) if moving else loads


def start_terms(chosen_baseline: NamedBaseline, chosen: Sequence[Unit], arm: Arm) -> Loads:
    """Return the baseline's terms before the linear fit; a travel scale, where it has one, is chosen for the units `chosen`."""
    loads = with_measured_water(chosen_baseline.start(arm), chosen, arm)
    return with_best_travel_scale(loads, chosen, arm).loads if has_travel_scale(loads) else loads


def calibrate(chosen_baseline: NamedBaseline, chosen: Sequence[Unit], arm: Arm, how: Preparation) -> StripTheory:
    """Return the baseline as a model, fitted to the units `chosen` where its definition says so (no intervals)."""
    loads = start_terms(chosen_baseline, chosen, arm)
    if chosen_baseline.calibrated:
        loads = loads.with_linear(fit_units(loads, chosen, arm)[0].theta)
    return StripTheory(arm, how, {SEEN: seen_record(chosen if chosen_baseline.calibrated else ())}, chosen_baseline.name, loads)


def _notes(loads: Loads, solution: Solution, before: Prior) -> list[str]:
    """A sentence for each parameter that the reader must not take at face value."""
    prior_sd = np.maximum(before.sd, 1e-150)
    posterior_sd = np.sqrt(np.maximum(np.diag(solution.covariance), 0.0))
    notes = []
    bounds = [bound for term in loads.linear().values() for bound in term.linear_bounds()]
    for theta, sd, known, assumed, (low, high) in zip(solution.theta, posterior_sd, prior_sd, before.mean.tolist(), bounds, strict=True):
        span = 1e-9 * max(1.0, abs(float(theta)))
        if known <= 1e-150:
            notes.append("known exactly beforehand")
        elif theta <= low + span or theta >= high - span:
            notes.append("ended on its bound: another cause may be hiding here")
        elif sd > 0.7 * known:
            moved = abs(float(theta) - assumed) / known
            how = "within its uncertainty" if moved <= BEYOND else f"{moved:.0f} times its uncertainty"
            notes.append(f"these recordings determine it only in combination with others: it moved {how}" if moved > 0.5 else
                         "these recordings do not excite it: the value is what was assumed")
        else:
            notes.append("")
    return notes


def estimates(loads: Loads, solution: Solution, blocks: Sequence[Statistics], before: Prior, seed: int) -> tuple[Estimate, ...]:
    """Return every linear parameter of the fitted sum with its bootstrap interval over recordings."""
    if len(blocks) > 2:
        draws = bootstrap(blocks, before, solution.weight, DRAWS, seed)
        low, high = np.quantile(draws, [0.025, 0.975], axis=0)
    else:  # too few recordings to resample: the Gaussian posterior, correlation time included
        sd = np.sqrt(np.maximum(np.diag(solution.covariance), 0.0))
        low, high = solution.theta - Z95 * sd, solution.theta + Z95 * sd
    names = [f"{name}.{p}" for name, term in loads.linear().items() for p in term.linear_names()]
    unit = [u for term in loads.linear().values() for u in term.linear_units()]
    return tuple(Estimate(n, float(v), u, (float(a), float(b)), note) for n, v, u, a, b, note in
                 zip(names, solution.theta, unit, low, high, _notes(loads, solution, before), strict=True))


def origin(model: str, campaign: Campaign, seed: int) -> dict[str, Any]:
    """Return what the record of every fit begins with: model, seed, campaign and versions."""
    return {"model": model, "seed": seed, "campaign_sha256": campaign.sha256(), "versions": versions()}


def fit_with_record(loads: Loads, chosen: Sequence[Unit], arm: Arm, seed: int, before: Prior | None = None) -> tuple[Loads, dict[str, Any]]:
    """Return `loads` fitted to the units `chosen`, and what a model file says of the fit; `before` and errors as in `fit_units`."""
    solution, blocks, before = fit_units(loads, chosen, arm, before)
    fitted, domain = loads.with_linear(solution.theta), domain_of(chosen, arm)
    found = estimates(fitted, solution, blocks, before, seed)
    return fitted, {
        "parameters": {estimate.name: replace(estimate, unit=arm.text(estimate.unit)).document() for estimate in found},
        "rms_residual_Nm": solution.rms.tolist(),
        "condition_number": solution.condition,
        "last_change": solution.last_change,  # of the residuals in the last round: a few per cent at the most
        "recordings": len(blocks),
        "warnings": absurdities(fitted, solution, blocks, arm) + against_stated(fitted, before, solution.theta, arm),
        DOMAIN: None if domain is None else domain.document(),
    }


@one_thread()
def identify(campaign: Campaign, model: str = "constant", cutoff_hz: float | None = None, seed: int = 0) -> StripTheory:
    """Return the baseline `model` fitted to all recordings and steady tables of `campaign`, its estimates in `fit["parameters"]`.

    Raises ConfigError for an unknown name, CampaignError or RecordingError where the data cannot be used.
    """
    require(seed >= 0, f"seed {seed}: give 0 or a positive number")
    chosen = baseline(model)
    how = campaign.plan(cutoff_hz)
    all_units = units(campaign, how, seed)
    loads = start_terms(chosen, all_units, campaign.arm)
    record = origin(model, campaign, seed) | {SEEN: seen_record(all_units if chosen.calibrated else ())}
    if chosen.calibrated:
        loads, fitted = fit_with_record(loads, all_units, campaign.arm, seed)
        record |= fitted
    return StripTheory(campaign.arm, how, record, model, loads)


USUAL = {"C_D": (0.3, 2.5, "cylinders have 0.3 to 2.5"), "C_M": (0.2, 2.0, "cylinders have 0.2 to 2")}  # general knowledge
LEFT = 0.5  # of the rms torque: a model that leaves more explains little


def unusual_coefficients(loads: Loads) -> list[tuple[str, float, str]]:
    """Return (name, value, what cylinders have) of each coefficient of drag and added mass outside what cylinders have."""
    found = []
    for name in {"normal_drag", "added_mass"} & loads.linear().keys():
        term = loads.linear()[name]
        for label, value in zip(term.linear_names(), term.linear_values().tolist(), strict=True):
            low, high, said = USUAL.get(label.partition("[")[0], (-np.inf, np.inf, ""))
            if not low <= value <= high:
                found.append((label, value, said))
    return sorted(found)


def absurdities(loads: Loads, solution: Solution, blocks: Sequence[Statistics], arm: Arm) -> list[str]:
    """Return a sentence for each coefficient outside what cylinders have, and for each joint of which most of the torque is left."""
    found = [f"{label} = {value:.3g}: {said}; check diameters, lengths, units and signs. An omitted effect may distort it: see nnhydro "
             "check, then nnhydro diagnose" for label, value, said in unusual_coefficients(loads)]
    summed = total(blocks)
    size = np.sqrt(summed.s / np.maximum(summed.n, 1))
    for joint, (left, whole) in enumerate(zip(solution.rms, size, strict=True), 1):
        if whole > 0 and left > LEFT * whole:
            found.append(arm.text(f"joint {joint}: {left / whole:.0%} of the torque is left ({left:.3g} of {whole:.3g} N m, rms). The "
                                  "model does not explain these recordings: see nnhydro check, then nnhydro diagnose"))
    return found
