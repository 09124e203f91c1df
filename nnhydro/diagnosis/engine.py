"""`diagnose`: is there a mismatch, where, what physics was left out, the model with it, the proof."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nnhydro.diagnosis.bank import Bank, Case, build, clock_places, hypotheses, torque_peaks
from nnhydro.diagnosis.blocks import Blocks
from nnhydro.diagnosis.locate import locate
from nnhydro.diagnosis.noise import noise_of
from nnhydro.diagnosis.proof import Proof, prove
from nnhydro.diagnosis.result import Diagnosis
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.tournament import P_BLOCK, Candidate, Race, family_wise_p, run
from nnhydro.diagnosis.verdict import Finding, findings, fitted
from nnhydro.effects.effect import InstrumentEffect, LoadEffect
from nnhydro.identification.identify import calibrated, started, versions, with_parameters
from nnhydro.identification.prior import Prior, prior
from nnhydro.models.baselines import baseline as baseline_called
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.repeats import group_names, noise_floor
from nnhydro.recordings.splitting import units

COMPANION = 0.06  # of the improvement: what a further effect must add; less is mostly what an effect of slightly other form leaves
CONFIDENT = 0.5  # nothing is said with less


def _race(bank: Bank, before: Prior, repeats: tuple[float, ...] | None) -> Race:
    ones = np.ones(before.F.shape[1])
    noise = noise_of(bank.blocks, ones, repeats)
    weighted = Blocks(bank.blocks.G / noise[None, :, None, None] ** 2, bank.blocks.n, bank.blocks.unit, bank.blocks.p)
    low, high = (np.array([bound[i] for effect in bank.effects
                           for bound in effect.linear_bounds()]) for i in (0, 1))
    return Race(Bench.of(bank.blocks, noise, ones), weighted, noise, low, high, float((bank.torque / noise**2).sum()))


def corrected(model: StripTheory, race: Race, before: Prior, found: Sequence[Finding]) -> StripTheory:
    """Return the baseline, refitted beside the findings, with every finding as one more term or as a fault of the instruments."""
    loads = with_parameters(model.loads, baseline_values(race, before)) if found else model.loads
    for finding in found:
        if isinstance(finding.effect, LoadEffect):
            name = f"{finding.effect.id}_{finding.effect.joint}" if finding.effect.joint else finding.effect.id
            loads = loads.plus(name, finding.effect)
    instruments = tuple(f.effect for f in found if isinstance(f.effect, InstrumentEffect))
    record = {"kind": "corrected model of a diagnosis", "findings": [f.statement for f in found], "versions": versions()}
    return StripTheory(model.arm, model.preparation, record, f"{model.name} corrected", loads, instruments)


def _recalibrated(loads: Loads) -> dict[str, list[float]]:
    pairs = (("cd", "normal_drag", "C_D"), ("cm", "added_mass", "C_M"))
    return {key: list(getattr(loads.terms[term], symbol)) for key, term, symbol in pairs if term in loads.terms}


@one_thread()
def diagnose(campaign: Campaign, baseline: str | None = None, seed: int = 0, cutoff_hz: float | None = None,
             without: Sequence[str] = ()) -> Diagnosis:
    """Return what the baseline leaves out of the recordings of `campaign`; `without` takes effects out of the catalogue.

    Raises ConfigError for an unknown baseline, CampaignError or RecordingError where the data cannot be used.
    """
    start = time.perf_counter()
    arm = campaign.arm
    chosen = baseline_called(baseline or ("rigid" if arm.dry else "constant"))
    how = campaign.plan(cutoff_hz)
    all_units = units(campaign, how, seed, group_names(campaign))
    model = calibrated(chosen, all_units, arm, how)
    before = prior(started(chosen, all_units, arm), arm)
    floor = noise_floor(campaign, how)
    known = hypotheses(campaign, torque_peaks(all_units), without)
    case = Case(all_units, model, before, known, clock_places(campaign, all_units))
    race, bank, believed, p_value = _settled(case, None if floor is None else floor.std, seed)
    race.chosen = [f.candidate for f in findings(race, bank) if f.confidence >= CONFIDENT]
    proof = prove(race, bank, case, believed)
    while len(race.chosen) > 1 and (least := _least(race, proof)) is not None:
        race.chosen.remove(least)
        proof = prove(race, bank, case, believed)
    found = findings(race, bank)
    left = family_wise_p(race, seed + 1)[0]
    noise_error = floor.error if floor is not None else float(race.noise.mean() * 0.8 / max(proof.torque, 1e-300))
    unexplained = {"detected": left <= P_BLOCK and proof.after > 1.5 * noise_error, "share": proof.after, "depends_on": []}
    plain = replace(model, fit={"kind": "calibrated baseline of a diagnosis", "versions": versions()})
    return Diagnosis(plain, corrected(model, race, before, found), chosen.name,
                     time.perf_counter() - start, p_value, noise_error, proof, locate(proof.residuals, race.noise), found, unexplained,
                     _recalibrated(model.loads), versions() | {"campaign_sha256": campaign.sha256()}, race.log)


def _least(race: Race, proof: Proof) -> Candidate | None:
    """The finding that adds least, where it adds less than its share to the improvement on left-out recordings: shape left by another."""
    gain = {c: proof.without[c.key] - proof.after for c in race.chosen}
    least = min(gain, key=lambda c: gain[c])
    return least if gain[least] < COMPANION * (proof.before - proof.after) else None


def _settled(case: Case, repeats: tuple[float, ...] | None, seed: int) -> tuple[Race, Bank, StripTheory, float]:
    """Select twice: the second time instruments read the model with the loads that were found the first time."""
    believed = case.model
    kept: dict[tuple[int, int], np.ndarray] = {}
    for again in (False, True):
        bank = build(case, believed, kept)
        race = _race(bank, case.before, repeats)
        p_value = family_wise_p(race, seed)[0]
        race = run(race, bank.candidates, seed)
        if again or not race.chosen:
            break
        loads = [f.effect for f in findings(race, bank) if isinstance(f.effect, LoadEffect)]
        base = with_parameters(case.model.loads, baseline_values(race, case.before))
        believed = replace(case.model, loads=Loads({**base.terms, **{f"found_{i}": load for i, load in enumerate(loads)}}))
    return race, bank, believed, p_value


def baseline_values(race: Race, before: Prior) -> np.ndarray:
    """Return the baseline's parameters (p,) refitted beside the findings."""
    return before.mean + before.F @ fitted(race)[0][: race.bench.p]
