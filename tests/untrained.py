"""Learned models whose weights nobody trained: what holds of them holds whatever a training finds."""

import torch
from campaigns import GIVEN, planted
from rigs import states

from nnhydro.features.body_columns import body_columns
from nnhydro.features.feature_set import features
from nnhydro.features.strip_law.law import law_columns
from nnhydro.features.strip_law.neurons import directions
from nnhydro.features.strip_law.state import StripView, strip_states
from nnhydro.fitting.config import TrainingConfig
from nnhydro.models.learned.learned import LEFT_OUT, LearnedTorque, swiftness, view_of
from nnhydro.models.learned.linear_parts import StripLaw
from nnhydro.models.learned.network import Ensemble
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.flow import Flow

DEFAULTS = TrainingConfig()


def random_ensemble(sizes, members=3, seed=1, parallel=False):
    """Networks with random weights, one per member."""
    g = torch.Generator().manual_seed(seed)
    layout = Ensemble.fresh(sizes, members, seed, parallel)
    return layout.with_tensors([torch.randn(w.shape, generator=g, dtype=torch.float64) for w in layout.tensors()])


def random_law(a, shown, names=DEFAULTS.law, members=3, seed=1):
    """A law of the strips with random coefficients; the range of its variables is that of the motion `shown`."""
    g = torch.Generator().manual_seed(seed)
    z, of_three = strip_states(StripView(Flow(a, shown)), names)
    body = torch.randn(members, body_columns(Flow(a, shown)).shape[2], generator=g, dtype=torch.float64)
    count = law_columns(StripView(Flow(a, shown)), z, of_three).shape[2]
    coefficients = torch.randn(members, count, generator=g, dtype=torch.float64)
    return StripLaw(tuple(names), z.amin(dim=(0, 1, 3)), z.amax(dim=(0, 1, 3)), coefficients, body, directions())


def learned(a, hybrid, bound=2.0, seed=1, names=DEFAULTS.features, law=DEFAULTS.law, hidden=(8,), parallel=False):
    """A model with random weights; the range of its inputs is that of random states."""
    floor = torch.full((a.n_links,), 0.2, dtype=torch.float64)
    shown = states(a.n_links, 200, seed=9)
    x = features(view_of(a, shown, floor), names)
    parity, joined = x.parity(), x.matrix()
    centre = torch.where(parity < 0, 0.0, joined.mean(0))
    spread = (joined - centre).pow(2).mean(0).sqrt() + 1e-6
    reach = ((joined - centre) / spread).abs().amax(0)
    ensemble = random_ensemble((len(parity), *hidden, a.n_links), seed=seed, parallel=parallel)
    base = StripTheory(a, GIVEN, {}, "constant", planted(a)) if hybrid else None
    skip = torch.randn(3, len(parity), a.n_links, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    swiftest, fit = swiftness(Flow(a, shown)).amax(0), {LEFT_OUT: 1 / 3}
    return LearnedTorque(a, GIVEN, fit, names, bound, floor, centre, spread, parity, -reach, reach, swiftest,
                         skip * (parity < 0)[:, None], ensemble, base, random_law(a, shown, law))
