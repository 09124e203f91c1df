"""Models to be compiled, and how closely the compiled one must agree."""

import torch

from nnhydro.models.baselines import baseline
from nnhydro.models.strip_theory import StripTheory
from nnhydro.physics.load_term import term_kinds
from nnhydro.physics.loads.history_force import HistoryForce
from nnhydro.physics.travel.term import TravelTerm
from nnhydro.recordings.filtering.preprocessing import Preparation

EQUAL = 1e-12  # of the largest torque: a few hundred roundings in another order
WITHOUT_MEMORY = [kind for kind, cls in term_kinds().items() if not issubclass(cls, (TravelTerm, HistoryForce))]


def model_of(a, name="constant", loads=None):
    """The baseline called `name`, or a model of other loads."""
    return StripTheory(a, Preparation(None), {}, name, loads or baseline(name).start(a))


def assert_equal(made, motion):
    """Assert that the compiled model gives the torques of its model."""
    got, want = made.torque(motion), made.model.torque(motion)
    assert float((got - want).abs().max()) <= EQUAL * float(want.abs().max())


def one_by_one(made, motion):
    """The torques of `step`, state by state."""
    columns = torch.cat([motion.q, motion.qd, motion.qdd, motion.u0[:, None], motion.du0[:, None]], dim=1)
    return torch.tensor([made.step(*row) for row in columns.tolist()], dtype=torch.float64)
