"""The model of a run in air as what is known beforehand of the same arm in water.

    tau = (what the dry fit found) + drag + added mass          theta_dry ~ N(value, sd of the dry fit),  C_D, C_M as `constant` has them

Masses, frictions and rotor inertias that a campaign without water has settled keep their values within the uncertainty of that fit, so
that the water is blamed for nothing that was there without it. Faults of instruments are not carried over: sensors are zeroed, geared and
delayed anew in every set-up.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import Z95
from nnhydro.errors import ModelError, require
from nnhydro.fitting.identify import fit_with_record, origin, start_terms
from nnhydro.fitting.linear.prior import WIDE, Prior, prior
from nnhydro.models.baselines import baseline
from nnhydro.models.seen import SEEN, seen_record
from nnhydro.models.storage import load_model
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.threads import one_thread
from nnhydro.recordings.arm import Arm
from nnhydro.recordings.campaign import Campaign
from nnhydro.recordings.splitting import Unit, units

Array = NDArray[np.float64]
LEAST = 1e-3  # relative: no dry run knows a friction or a mass in water better


@final
@dataclass(frozen=True, eq=False)
class KnownTerms:
    """A sum of terms before its fit and what is known of it."""

    loads: Loads
    before: Prior


def dry_model(folder: Path) -> StripTheory:
    """Return the physics model of a run in air in `folder`; raises ModelError where it is none."""
    model = load_model(folder)
    require(isinstance(model, StripTheory), f"{folder}: is a {model.kind}, no sum of load terms: give a model that nnhydro identify or "
            "diagnose wrote from a campaign in air", ModelError)
    assert isinstance(model, StripTheory)
    return model


def _spread(dry: StripTheory, term: str, names: Sequence[str], values: Array) -> Array:
    """Standard deviation (p,) of each parameter of a dry term: from its interval, else a relative `LEAST`."""
    found = dry.fit.get("parameters", {})
    known = [found.get(f"{term}.{name}", {}).get("ci95") for name in names]
    sd = np.array([np.nan if ci is None else (ci[1] - ci[0]) / (2 * Z95) for ci in known])
    least: Array = np.maximum(LEAST * np.abs(values), np.where(np.isfinite(sd), sd, 0.1 * np.abs(values)))
    return least


def in_water(dry: StripTheory, arm: Arm, chosen: Sequence[Unit], name: str = "constant") -> KnownTerms:
    """Return the baseline `name` for `arm` with every term of the model `dry` in it, and the prior that its fit leaves behind.

    Raises ModelError where `dry` was made in water, is of another number of joints, or `arm` is dry itself.
    """
    require(dry.arm.dry, "the model was made in water: give one of a campaign with density_kg_m3: 0", ModelError)
    require(not arm.dry, "the campaign itself is without water: use its own model", ModelError)
    require(dry.arm.n_links == arm.n_links, f"the model is of {dry.arm.n_links} joint(s), the campaign's arm has {arm.n_links}", ModelError)
    from scipy.linalg import block_diag

    fresh = start_terms(baseline(name), chosen, arm)
    water = {key: term for key, term in fresh.terms.items() if key not in dry.loads.terms and not key.startswith("stated_")}
    loads = Loads({**dry.loads.terms, **water})
    means, parts, low, high = [], [], [], []
    wide = prior(Loads(water), arm)
    for key, term in Loads(dict(dry.loads.terms)).linear().items():
        values = term.linear_values().numpy()
        if key == "rigid_body":  # its parameters hang together: the directions of arm.yaml, none known worse than that
            rigid = prior(Loads({key: term}), arm)
            part, bounds = rigid.F, (rigid.lowest, rigid.highest)
        else:
            sd = _spread(dry, key, term.linear_names(), values)
            edges = (np.array(term.linear_bounds()) - values[:, None]) / np.where(sd > 0, sd, WIDE)[:, None]
            part, bounds = np.diag(sd)[:, sd > 0], (edges[sd > 0, 0], edges[sd > 0, 1])
        means.append(values)
        parts.append(part)
        low.append(bounds[0])
        high.append(bounds[1])
    return KnownTerms(loads, Prior(np.concatenate([*means, wide.mean]), block_diag(*parts, wide.F), np.concatenate([*low, wide.lowest]),
                              np.concatenate([*high, wide.highest])))


@one_thread()
def identify_in_water(campaign: Campaign, dry: StripTheory, model: str = "constant", cutoff_hz: float | None = None,
                      seed: int = 0) -> StripTheory:
    """Return the baseline `model` of a wet campaign on the model `dry` of the same arm in air, with estimates and intervals."""
    how = campaign.plan(cutoff_hz)
    chosen = units(campaign, how, seed)
    known = in_water(dry, campaign.arm, chosen, model)
    loads, fitted = fit_with_record(known.loads, chosen, campaign.arm, seed, known.before)
    name = f"{model} on {dry.name}"
    return StripTheory(campaign.arm, how, origin(name, campaign, seed) | {SEEN: seen_record(chosen, dry)} | fitted, name, loads)
