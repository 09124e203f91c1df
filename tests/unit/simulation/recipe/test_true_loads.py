"""The terms of a recipe's truth."""

import numpy as np
import pytest
from tank_recipes import BASE, recipe

from nnhydro.physics.load_term import term_kinds
from nnhydro.simulation.campaign_writer import runs


@pytest.mark.parametrize("kind", sorted(term_kinds()))
def test_every_load_term_can_be_part_of_the_truth(kind: str) -> None:
    (run,) = runs(recipe(motions=BASE["motions"][:1], unseen=[], terms={kind: "start"}))
    assert np.isfinite(run.tau).all()


def test_a_term_may_stand_there_twice_under_names_of_its_own() -> None:
    plain = recipe(terms={"normal_drag": {"C_D": 1.0}})
    two = recipe(terms={"near": {"kind": "normal_drag", "C_D": 0.4}, "far": {"kind": "normal_drag", "C_D": [0.6, 0.6]}})
    np.testing.assert_allclose(next(runs(two)).tau, next(runs(plain)).tau, atol=1e-12)
