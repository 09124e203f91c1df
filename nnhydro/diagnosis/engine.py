"""`diagnose`: is there a mismatch, where, what physics was left out, the model with it, the proof."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from nnhydro.diagnosis.case import AT_ONCE, MOST_STUDIED, Case, Opened, opened
from nnhydro.diagnosis.experiment import next_experiment
from nnhydro.diagnosis.instances import Hypothesis
from nnhydro.diagnosis.locate import locate
from nnhydro.diagnosis.naming import explained, named
from nnhydro.diagnosis.placebo import placebo, whiteness
from nnhydro.diagnosis.proof import Proof, foretold, prove_fresh
from nnhydro.diagnosis.race import Race
from nnhydro.diagnosis.reference import Reference
from nnhydro.diagnosis.rehearsal import confident, rehearse
from nnhydro.diagnosis.remainder import mismatch_p, remainder
from nnhydro.diagnosis.result import Diagnosis
from nnhydro.diagnosis.rig import Limits
from nnhydro.diagnosis.search import Found
from nnhydro.diagnosis.spell import Spell
from nnhydro.diagnosis.spells import Order
from nnhydro.diagnosis.uncertainty import own_values
from nnhydro.diagnosis.verdict import Finding
from nnhydro.effects.effect import InstrumentEffect, LoadEffect
from nnhydro.effects.in_sector import InSector, ReadInSector
from nnhydro.identification.identify import versions, with_parameters
from nnhydro.models.strip_theory import StripTheory
from nnhydro.models.torque_model import TorqueModel
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.load_term import LoadTerm
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.campaign import Campaign


def _lasting(finding: Finding, found: Found) -> Hypothesis:
    """What predictions hold of a finding: of one with an offset in every recording, the last one."""
    effect, order = finding.effect, Order.of(found.table).numbers
    if isinstance(effect, LoadEffect):
        return effect
    if not effect.offset_of_its_own:
        return effect.lasting(0.0)
    return effect if not order else effect.lasting(float(own_values(found.race, finding.candidate, order[-1])[-1]))


def _term(effect: LoadEffect, spell: Spell | None) -> LoadTerm:
    """The effect as a term, which acts in a sector only where that was found."""
    sector = None if spell is None else spell.sector
    return effect if sector is None else InSector(sector.joint, sector.low, sector.high, effect)


def _instrument(effect: InstrumentEffect, spell: Spell | None) -> InstrumentEffect:
    """The effect as a fault of sensors or drives, in a sector only where that was found."""
    sector = None if spell is None else spell.sector
    return effect if sector is None else ReadInSector(sector.low, sector.high, effect, joint=sector.joint)


def _term_name(effect: LoadEffect, loads: Loads) -> str:
    """The finding's id and joint; told apart from a term of the baseline that is called so, too."""
    name = f"{effect.id}_{effect.joint}" if effect.joint else effect.id
    while name in loads.terms:
        name = f"found_{name}"
    return name


def corrected(reference: Reference, search: Found, found: Sequence[Finding]) -> TorqueModel:
    """Return the baseline, refitted beside the findings, with every finding as one more term or as a fault of the instruments.

    What has a phase of its own in every recording is no part of it: nobody knows the phase of the next one. Nor is what has ended.
    """
    model, before, race = reference.physics, reference.before, search.race
    loads = model.loads
    if found or not reference.ours:
        loads = with_parameters(loads, before.mean + before.F @ race.values(race.chosen)[0])
    kept = [f for f in found if not f.effect.own_in_every_recording and f.lasts]
    lasting = [(_lasting(f, search), f.candidate.instance.spell) for f in kept]
    for effect, spell in lasting:
        if isinstance(effect, LoadEffect):
            loads = loads.plus(_term_name(effect, loads), _term(effect, spell))
    instruments = tuple(_instrument(effect, spell) for effect, spell in lasting if isinstance(effect, InstrumentEffect))
    record = {"kind": "corrected model of a diagnosis", "findings": [f.statement for f in found], "versions": versions()}
    after = StripTheory(model.arm, model.preparation, record, f"{reference.name} corrected", loads, instruments)
    return reference.amended(replace(model, loads=with_parameters(model.loads, before.mean)), after)


def _recalibrated(loads: Loads) -> dict[str, list[float]]:
    pairs = (("cd", "normal_drag", "C_D"), ("cm", "added_mass", "C_M"))
    return {key: list(getattr(loads.terms[term], symbol)) for key, term, symbol in pairs if term in loads.terms}


@one_thread()
def diagnose(campaign: Campaign, baseline: str | None = None, seed: int = 0, cutoff_hz: float | None = None,
             without: Sequence[str] = (), progress: Callable[[str], None] = lambda line: None, most: int = MOST_STUDIED,
             rehearsals: int = 0, limits: Limits | None = None) -> Diagnosis:
    """Return what the baseline leaves out of the recordings of `campaign`; `without` takes effects out of the catalogue.

    Of more than `most` recordings the others take no part in the search and are the proof. `rehearsals` is how often findings and their
    rivals are planted again to say how sure a name is; 0: confidence is the weight among the rivals. `limits` are those of the rig, for the
    motion to record next: by default what it has shown.

    Raises ConfigError for an unknown baseline, CampaignError or RecordingError where the data cannot be used.
    """
    start = time.perf_counter()
    if limits is not None:
        limits.check(campaign.arm.n_links)
    ready = opened(campaign, baseline, seed, cutoff_hz, most)
    case, floor, against = ready.case, ready.floor, ready.case.reference
    told = named(case, ready.repeats, seed, without, progress)
    found, said, race = told.found, told.findings, told.found.race
    proof = prove_fresh(race, found.believed, _told(ready, progress), foretold(race, case, found.believed, told.proof))
    noise_error = floor.error if floor is not None else float(race.noise.mean() * 0.8 / max(proof.torque, 1e-300))
    rest = remainder(told, proof, noise_error, seed)
    rehearsal = rehearse(case, race, rehearsals, seed, without, progress) if rehearsals and said else None
    said = said if rehearsal is None else [confident(f, rehearsal) for f in said]
    following = next_experiment(race, case, found.believed, seed, limits)
    seconds = time.perf_counter() - start
    return Diagnosis(against.plain(), corrected(against, found, said), against.name, seconds,
                     mismatch_p(found.p_value, rest), noise_error, proof, locate(proof.residuals, race.noise), said, rest,
                     _checks(race, found, proof), following, _recalibrated(against.physics.loads),
                     versions() | {"campaign_sha256": campaign.sha256()}, race.log, rehearsal)


def _told(ready: Opened, progress: Callable[[str], None]) -> Iterator[Case]:
    """The recordings that took no part, with progress."""
    for number, case in enumerate(ready.fresh()):
        progress(f"proof: {number * AT_ONCE} of {len(ready.later)} recordings that took no part")
        yield case


def _checks(race: Race, found: Found, proof: Proof) -> dict[str, Any]:
    """What speaks against chance: the same terms on the wrong recordings, and how white the remaining residual is."""
    placebos = []
    for chosen in race.chosen:
        gain, largest = placebo(race, found.table, found.believed, chosen)
        placebos.append({"effect": chosen.key[0], "joint": chosen.key[1] or None, "gain": gain, "largest_placebo": largest})
    lags = [whiteness(proof.remains, joint) for joint in range(len(race.noise))]
    return {"error_before": proof.before, "error_after": proof.after, "recordings": proof.recordings,
            "explained": explained(race) if race.chosen else 0.0,
            "placebo": placebos, "correlated_lags": lags}
