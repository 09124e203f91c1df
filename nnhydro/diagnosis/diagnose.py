"""`diagnose`: whether baseline and campaign disagree, where, what physics is missing, and the corrected model with its errors.

prepare (problem, baseline, design) -> noise and unknown -> search -> refine -> decide -> findings, corrected model, errors, remainder.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from nnhydro.diagnosis.calibration.rehearsal import limit_confidence, rehearse
from nnhydro.diagnosis.constants import DETECTED, FORM, LEAST_GAIN, MATERIAL, NULL_QUANTILE
from nnhydro.diagnosis.corrected_model import corrected_model, trained_on, with_record
from nnhydro.diagnosis.decision.alternative_laws import replace_special_laws
from nnhydro.diagnosis.decision.decide import Claims, decide
from nnhydro.diagnosis.decision.heldout_errors import HeldoutErrors, noise_error
from nnhydro.diagnosis.decision.other_bands import FACTORS, OtherBand, claims_at
from nnhydro.diagnosis.decision.withdrawal import withdraw_useless
from nnhydro.diagnosis.experiment.proposal import Proposal, next_experiment
from nnhydro.diagnosis.experiment.rig_limits import Limits
from nnhydro.diagnosis.findings.equivalence import replace_by_simpler
from nnhydro.diagnosis.findings.finding import findings_of
from nnhydro.diagnosis.model.evidence import WhiteRows
from nnhydro.diagnosis.model.sizes import fit_sizes
from nnhydro.diagnosis.model.unknown import unknown_of
from nnhydro.diagnosis.noise.spectrum import NOISE_ROUNDS, Noise, calibrated_noise, reestimate
from nnhydro.diagnosis.problem.design import Design, hypotheses_for
from nnhydro.diagnosis.problem.impossible_coefficients import impossible_coefficients
from nnhydro.diagnosis.problem.problem import MOST_STUDIED, draw_names, problem_of
from nnhydro.diagnosis.problem.stated_friction import design_on
from nnhydro.diagnosis.result import DiagnosisResult
from nnhydro.diagnosis.search.activity_windows import in_parts
from nnhydro.diagnosis.search.best_fit import best_fit, reestimate_noise
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.linearisation import extra_starts, is_stale
from nnhydro.diagnosis.search.refinement import refine, with_finer_singles
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.wave_frequencies import across_fixed_links, at_lines, at_lines_per_recording, line_frequencies
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary
from nnhydro.diagnosis.unexplained.recordings_apart import apart_sentence, leaves_less, recordings_apart
from nnhydro.diagnosis.unexplained.residual_location import locate
from nnhydro.diagnosis.unexplained.unexplained import Remainder, p_of, unexplained_of, unknown_parts
from nnhydro.errors import NnhydroError
from nnhydro.fitting.identify import versions
from nnhydro.fitting.physical_survey import denied_channels
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.filtering.band import share_above
from nnhydro.recordings.repeats import copied_recordings

NEVER_FATAL = (NnhydroError, np.linalg.LinAlgError, ArithmeticError, ValueError)  # of a control: it never costs the verdict


@final
@dataclass(frozen=True, eq=False)
class SearchedCampaign:
    """A searched campaign: what was decided, in which search, beside which noise and model."""

    design: Design
    noise: Noise
    search: Search
    decided: Claims
    model: StripTheory
    null: ScoredSet


def _explore(design: Design, without: Sequence[str],
             progress: Callable[[str], None] = lambda line: None) -> tuple[Noise, Search, ScoredSet, StripTheory]:
    """Return noise, search, its best set and the calibrated baseline on the rows of `design`; nothing is decided yet."""
    unknown = unknown_of(design, design.baseline.at(np.zeros(design.Y.shape[2])))
    progress("estimating noise")
    noise, whitened, sizes, model = calibrated_noise(design, unknown)
    hypotheses = hypotheses_for(design, without)
    across = across_fixed_links(design)
    lines = at_lines(hypotheses, line_frequencies(design), across) + at_lines_per_recording(hypotheses, design, across)
    hypotheses += extra_starts(hypotheses, design.problem, model) + lines
    progress(f"computing {len(hypotheses)} hypotheses")
    library = Library.of(design, hypotheses, model)
    search = with_finer_singles(Search(WeightedLibrary(whitened, library), sizes, progress), model)
    parts = in_parts(search, search.run(), model)
    search, best, library = parts.search, parts.best, parts.search.view.library
    del parts  # with the columns of the search before
    for _ in range(NOISE_ROUNDS - 1):
        noise = reestimate(design, noise, search.whitened, search.view.join(best.chosen), best.sizes.vector(search.whitened))
        whitened = WhiteRows(design, unknown.smooth, noise.v)
        _, sizes = fit_sizes(whitened, None, sizes)
        del search
        search = Search(WeightedLibrary(whitened, library), sizes, progress)
        best = search.score(best.chosen)
    best = search.climb(best)
    progress("refining nonlinear parameters")
    finer = refine(search, best, model)
    search = finer.search
    parts = in_parts(search, search.climb(finer.best), model)
    search = parts.search
    plain = replace_special_laws(search, parts.best)
    best = replace_by_simpler(search, plain)
    if best.chosen != parts.best.chosen or _has_stale(search, best):  # what took another's place, or came in last, has no finer values yet
        as_good = best.chosen == plain.chosen or _has_stale(search, plain)
        finer = refine(search, best, model)
        search, first = finer.search, finer.search.score(plain.chosen)
        if as_good or finer.best.score > first.score - LEAST_GAIN:
            best = replace_by_simpler(search, replace_special_laws(search, search.climb(finer.best)))
        else:  # about its own value the simpler law is another one: a current as fast as the tow is no linear drag
            best = first
    return reestimate_noise(search, best, noise), search, best, model


def _has_stale(search: Search, found: ScoredSet) -> bool:
    """Return whether a member is an instrument whose columns are about other values than its own."""
    return any(is_stale(search.view, found, k) for k in found.chosen)


def _refine_claims(search: Search, best: ScoredSet, decided: Claims, model: StripTheory, seed: int) -> tuple[Search, Claims]:
    """Return what is claimed; if members of `best` fail, the others are refined without them, and judged again."""
    if decided.claimed.chosen in ((), best.chosen):
        return search, decided
    finer = refine(search, decided.claimed, model)
    again = decide(finer.search, finer.best, seed)
    judged = {(decision.effect, decision.joint) for decision in again.decisions}
    failed = tuple(decision for decision in decided.decisions if (decision.effect, decision.joint) not in judged)
    return finer.search, replace(again, decisions=(*failed, *again.decisions))


@one_thread()
def search_design(design: Design, seed: int, without: Sequence[str] = ()) -> SearchedCampaign:
    """Return what the baseline of `design` omits on its rows."""
    noise, search, best, model = _explore(design, without)
    search, decided = _refine_claims(search, best, decide(search, best, seed), model, seed)
    return SearchedCampaign(design, noise, search, decided, model, search.score(()))


@final
@dataclass(frozen=True, eq=False)
class DecidedCampaign:
    """What was decided on some recordings, the held-out errors, the error of noise alone, and what remains."""

    found: SearchedCampaign
    heldout: HeldoutErrors
    floor: float
    rest: Remainder


def _decide_on(campaign: Campaign, names: tuple[str, ...], options: "DiagnosisOptions", progress: Callable[[str], None]) -> DecidedCampaign:
    """Return what is decided on the recordings `names` of the campaign."""
    design = design_on(problem_of(campaign, names, options.cutoff_hz), options.baseline)
    noise, search, best, model = _explore(design, options.without, progress)
    progress("held-out errors")
    search, decided = _refine_claims(search, best, decide(search, best, options.seed), model, options.seed)
    decided, heldout = withdraw_useless(search, decided, model, options.seed)
    rest, floor = _remainder_of(search, decided, heldout, noise)
    return DecidedCampaign(SearchedCampaign(design, noise, search, decided, model, search.score(())), heldout, floor, rest)


def _remainder_of(search: Search, decided: Claims, heldout: HeldoutErrors, noise: Noise) -> tuple[Remainder, float]:
    """Return what the claims leave, and the error of noise alone.

    On the few rows of tables, the unknown takes noise for a law. There, what the claims leave is noise unless the remainder is detected,
    or impossible coefficients explain it.
    """
    design, claimed = search.whitened.design, decided.claimed
    steady, of_noise = (design.problem.frequency < 0)[:, None], noise.noise_variance + design.input_variance
    floor = noise_error(search, heldout, np.where(steady, best_fit(search, claimed).whitened.v, of_noise))
    rest = unexplained_of(search, claimed, heldout, decided.decisions, floor, noise)
    return rest, noise_error(search, heldout, of_noise) if rest.detected or impossible_coefficients(design) else floor


def _complete(campaign: Campaign, decided: DecidedCampaign, options: "DiagnosisOptions",
              progress: Callable[[str], None]) -> DiagnosisResult:
    """Return the whole diagnosis: findings, models, other bands, the next experiment."""
    found, heldout, base = decided.found, decided.heldout, decided.found.design.baseline
    problem = found.design.problem
    search, claimed = found.search, found.decided.claimed
    findings = [replace(finding, error_with=heldout.after,
                        error_without=heldout.without.get((finding.effect, finding.law.joint), heldout.before))
                for finding in sorted(findings_of(search, claimed), key=lambda finding: -found.decided.shares.get(finding.number, 0.0))]
    rehearsal = rehearse(search, claimed, options.rehearsals, options.seed, progress) if options.rehearsals and findings else None
    findings = findings if rehearsal is None else [limit_confidence(finding, rehearsal) for finding in findings]
    progress("repetition in other frequency bands")
    bands, unjudged = _other_bands(campaign, options.baseline, found) if findings else ((), {})
    progress("next experiment")
    following, why = _plan_next(found, campaign, options.seed, options.limits)
    z_before, z_after = (base.within(best_fit(search, model_set).z) for model_set in (search.score(()), claimed))
    noise_rms = np.sqrt(found.noise.noise_variance.sum(axis=0) / found.design.duration)
    before, corrected = base.as_model(z_before), corrected_model(base, z_before, z_after, findings)
    record = trained_on(campaign, problem, base.simulated or base.physics)
    before, corrected = with_record(before, record if base.is_physics else {}), with_record(corrected, record)
    above = {} if found.design.undriven else {"torque_above_band": share_above(map(campaign.load, problem.names), problem.edge)}
    checks = _checks(found, heldout.before, heldout.after, heldout.recordings) | base.against_stated(z_after) | unjudged | why | above
    checks["impossible_coefficients"] = impossible_coefficients(found.design)
    return DiagnosisResult(before, corrected, base.name, 0.0, _p_value(found, decided.rest), decided.floor, heldout,
                           locate(heldout.residuals, noise_rms), findings, decided.rest, found.decided.decisions, checks, bands, following,
                           base.recalibration(z_before), versions() | {"campaign_sha256": campaign.sha256()}, rehearsal)


@final
@dataclass(frozen=True)
class DiagnosisOptions:
    """The choices of a diagnosis with their defaults: one object for Python, the command line and batches."""

    baseline: str | None = None  # a physics model by name, a model folder, or "column"; constant, or rigid where dry
    seed: int = 0  # of subsets of recordings and of null draws
    cutoff_hz: float | None = None  # from the data
    without: Sequence[str] = ()  # effects that are taken out of the catalogue
    rehearsals: int = 0  # draws of each finding and of each rival that calibrate the confidence
    limits: Limits | None = None  # what the rig can do; the ranges of the recordings
    most: int = MOST_STUDIED  # recordings; of more, the others take no part

    @one_thread()
    def diagnose(self, campaign: Campaign, progress: Callable[[str], None] = lambda line: None) -> DiagnosisResult:
        """Return the diagnosis of `campaign` with these choices; raises as `diagnose`."""
        start = time.perf_counter()
        if self.limits is not None:
            self.limits.check(campaign.arm.n_links)
        copies = {name for group in copied_recordings(campaign) for name in group[1:]}  # a copy is no second recording
        names = draw_names([name for name in campaign.names if name not in copies], self.most, self.seed)
        decided, checks = self._without_few(campaign, names, _decide_on(campaign, names, self, progress), progress)
        result = _complete(campaign, decided, self, progress)
        try:
            explained = result.heldout.before < FORM and not result.checks.get("impossible_coefficients")
            checks["denied_channels"] = denied_channels(replace(campaign, names=names), self.cutoff_hz, explained)
        except NEVER_FATAL as error:
            checks["channels"] = f"units and signs not judged: {error}"
        left_out = f"{result.checks['left_out']} {checks.pop('left_out', '')}".strip()
        return replace(result, checks=result.checks | checks | {"left_out": left_out}, seconds=time.perf_counter() - start)

    def _without_few(self, campaign: Campaign, names: tuple[str, ...], decided: DecidedCampaign,
                     progress: Callable[[str], None]) -> tuple[DecidedCampaign, dict[str, Any]]:
        """Return what is decided without the few recordings that hold most of what remains, if that is better, and what to say of it."""
        apart = recordings_apart(decided.rest, decided.heldout, names)
        if not apart:
            return decided, {}
        progress(f"without {', '.join(sorted(apart))}")
        try:
            others = _decide_on(campaign, tuple(name for name in names if name not in apart), self, progress)
        except NEVER_FATAL as error:
            return decided, {"without_recordings": f"not judged without {', '.join(sorted(apart))}: {error}"}
        better = others.found.decided.claimed.chosen and leaves_less(decided.heldout, others.heldout, apart)
        return (others, {"left_out": apart_sentence(apart)}) if better else (decided, {})


def diagnose(campaign: Campaign, baseline: str | None = None, seed: int = 0, cutoff_hz: float | None = None,
             without: Sequence[str] = (), progress: Callable[[str], None] = lambda line: None, most: int = MOST_STUDIED,
             rehearsals: int = 0, limits: Limits | None = None) -> DiagnosisResult:
    """Return what the baseline omits, by the recordings of `campaign`; `without` takes effects out of the catalogue.

    Of more than `most` recordings the others take no part. `cutoff_hz` is the upper edge of the band, by default from the data.
    Raises ConfigError for an unknown baseline, CampaignError or RecordingError where the data cannot be used.
    """
    return DiagnosisOptions(baseline, seed, cutoff_hz, without, rehearsals, limits, most).diagnose(campaign, progress)


def _other_bands(campaign: Campaign, baseline: str | None, found: SearchedCampaign) -> tuple[tuple[OtherBand, ...], dict[str, str]]:
    """The claims at other edges of the band, and why one could not be judged: it never costs the verdict."""
    claimed = [found.search.view.library.hypotheses[k] for k in found.decided.claimed.chosen]
    made, failed = [], []
    for factor in FACTORS:
        band = found.design.problem.band.times(factor)
        try:
            made.append(claims_at(campaign, found.design.problem, band, baseline, claimed))
        except NEVER_FATAL as error:
            failed.append(f"not judged below {band.torque:.3g} Hz: {error}")
    return tuple(made), {"other_bands": "; ".join(failed)} if failed else {}


def _plan_next(found: SearchedCampaign, campaign: Campaign, seed: int, limits: Limits | None) -> tuple[Proposal | None, dict[str, str]]:
    """The next experiment, and why there is none where planning it failed: it never costs the verdict. No motion moves a free machine."""
    if found.design.undriven:
        return None, {}
    try:
        names = found.design.problem.names
        rate = 1 / float(np.median(np.diff(campaign.load(names[0]).t))) if names else 1.0
        return next_experiment(found.search, found.noise, found.decided.claimed, found.model, rate, seed, limits), {}
    except NEVER_FATAL as error:
        return None, {"next_experiment": f"not planned: {error}"}


def _p_value(found: SearchedCampaign, rest: Remainder) -> float:
    """p of "nothing is missing": by the claims, by the unknown beside the baseline alone, by what remains.

    Chance gains as much as a claim in one campaign of a hundred at the most: so many were drawn (`null_draws`).
    """
    gains = [decision.statistic for decision in found.decided.decisions if decision.claimed]
    claimed = [float(np.clip(len(found.search.view.library.key_counts) * np.exp(-g), 1e-12, 1 - NULL_QUANTILE)) for g in gains]
    parts = unknown_parts(found.search, found.null)
    real = found.null.unknown_nats >= DETECTED and any(part.share >= MATERIAL for part in parts)
    return max(1e-12, min([1.0, rest.p_value, p_of(found.search, found.null) if real else 1.0, *claimed]))


def _checks(found: SearchedCampaign, before: float, after: float, recordings: int) -> dict[str, Any]:
    """What the errors are of, and how much of what the unknown gained the claims explain."""
    null, claimed = found.null.unknown_nats, found.decided.claimed.unknown_nats
    return {"error_before": before, "error_after": after, "recordings": recordings,
            "explained": float(np.clip(1 - claimed / null, 0.0, 1.0)) if null > 1 else 0.0,
            "unknown_nats": {"before": float(null), "after": float(claimed)}, "band_hz": float(found.design.problem.edge),
            "left_out": found.design.problem.left_out.sentence()}
