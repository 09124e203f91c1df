"""Whether a cause has one size: in all recordings, and for all parts of the torque that a sensor changes in the same way.

    s^2 = (nats that a size for each part gains, twice, less their number - 1) / |u|^2

is the share of the energy of a member's whitened torque u = sum_g u_g that one size misses, beyond noise. A wrong law often needs another
size in each recording, or another one for drag than for inertia.
"""

import numpy as np
import torch
from numpy.typing import NDArray

from nnhydro.diagnosis.problem.problem import Stretch
from nnhydro.diagnosis.search.best_fit import BestFit, best_fit
from nnhydro.diagnosis.search.linearisation import calibrated_with
from nnhydro.diagnosis.search.scored_set import ScoredSet
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.values import excess_scatter, units_of
from nnhydro.effects.effect import InstrumentEffect
from nnhydro.effects.sensor_view import SensorView
from nnhydro.fitting.linear.least_squares import ridge
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_sum import Loads
from nnhydro.physics.motion import Motion

Array = NDArray[np.float64]
FAINT = 1e-3  # share of the energy of all parts; a fainter part tells no size


def _torque(search: Search, found: ScoredSet, k: int) -> tuple[BestFit, NDArray[np.int64], Array]:
    """Return the best fit of a set, the places of member `k` among its coefficients, and the member's whitened torque (n, joints)."""
    fit, place = best_fit(search, found), found.places(search.view)[k]
    at = np.searchsorted(fit.coefficients, np.arange(place.start, place.stop))
    return fit, at, fit.rows[..., at] @ fit.posterior.mean[place]


def scatter_between_recordings(search: Search, found: ScoredSet, k: int) -> float:
    """Return s of the member's size between recordings, blocks where they are few.

        s^2 = (sum_g e_g (x_g - mean x)^2 - (G - 1)) / sum_g e_g,     x_g = u_g'r_g / e_g,  e_g = u_g'u_g

    r is what the best fit leaves, g = 1 ... G the recordings. It is 0 for values per recording.
    """
    if search.view.library.hypotheses[k].per_recording:
        return 0.0
    fit, _, torque = _torque(search, found, k)
    unit = units_of(search)
    energy, product = (np.bincount(unit, (torque * other).sum(axis=1)).astype(float) for other in (torque, fit.residual))
    energy, product = energy[energy > 0], product[energy > 0]
    return float(np.sqrt(max(excess_scatter(product / energy, energy), 0.0) / energy.sum()))


def scatter_between_parts(search: Search, found: ScoredSet, k: int) -> float:
    """Return s of the member's size between inertia, drag, added mass and so on; 0 for an effect that changes these differently.

    Each part has its own size beside the baseline and the other members; u is what these cannot imitate. The last part also takes what
    the faint parts left out, and the effect's curvature, leave of u: the parts sum to u.
    """
    h = search.view.library.hypotheses[k]
    if not (isinstance(h.effect, InstrumentEffect) and h.effect.additive) or h.per_recording or h.activity is not None:
        return 0.0
    fit, at, torque = _torque(search, found, k)
    parts = _parts(search, found, k, fit.posterior.mean[found.places(search.view)[k]]) * fit.whitened.sw[..., None]
    energy = (parts**2).sum(axis=(0, 1))
    parts = parts[..., energy > FAINT * energy.sum()].reshape(torque.size, -1)
    if parts.shape[1] < 2:
        return 0.0
    parts[:, -1] += torque.ravel() - parts.sum(axis=1)
    others = np.delete(fit.rows.reshape(torque.size, -1), at, axis=1)
    left = parts - others @ ridge(others, parts)
    gram, whole = left.T @ left, left.sum(axis=1)
    y = fit.residual.ravel() + whole
    apart = float(np.linalg.lstsq(gram, left.T @ y, rcond=None)[0] @ (left.T @ y))
    excess = apart - float(whole @ y) ** 2 / max(float(whole @ whole), 1e-300) - (parts.shape[1] - 1)
    return float(np.sqrt(max(excess, 0.0) / max(float(whole @ whole), 1e-300)))


def _parts(search: Search, found: ScoredSet, k: int, scaled: Array) -> Array:
    """Return the rows (n, joints, terms) N m of what member `k` makes of each term of the model, by its fitted values `scaled`."""
    library = search.view.library
    h, design = library.hypotheses[k], library.design
    effect = h.with_values(torch.from_numpy(scaled * library.scale[library.at(k)]))
    assert isinstance(effect, InstrumentEffect)
    model = calibrated_with(search, found, design.baseline.at(np.zeros(design.Y.shape[2])))

    def on_stretch(stretch: Stretch) -> Array:
        """Return the change of each term (n, joints, terms)."""
        flow = Flow(model.arm, Motion.of(stretch.segment))
        views = [SensorView.of(Loads({name: term}), flow) for name, term in model.loads.terms.items()]
        made: Array = np.nan_to_num(torch.stack([effect.apply(view) - view.tau for view in views], dim=-1).numpy())
        return made

    return design.rows(on_stretch)
