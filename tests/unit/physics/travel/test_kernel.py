"""The kernel for strips with a memory gives what the physics in torch gives, whatever the arm, the curves, the rule and the motion."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import arm
from travelling import assert_equal, kernel_loads, motion, travelling

from nnhydro.physics.flow import Flow

pytest.importorskip("numba")
KINDS = st.sampled_from(["from rest", "under way", "pauses", "still", "steady"])


@pytest.mark.slow  # the same claim as below, for many arms, curves and motions
@settings(max_examples=50)
@given(seed=st.integers(0, 10**6), rows=st.integers(1, 300), kind=KINDS, rule=st.sampled_from(["reset", "keep"]),
       per_link=st.integers(1, 12))
def test_the_kernel_equals_the_strips_in_torch(seed, rows, kind, rule, per_link):
    rng = np.random.default_rng(seed)
    a = arm(2)
    a = a.model_copy(update={"links": tuple(link.model_copy(update={"length_m": rng.uniform(0.1, 1), "diameter_m": rng.uniform(0.02, 0.2)})
                                            for link in a.links)})
    assert_equal(travelling(a, seed, {"at_reversal": rule, "per_link": per_link}), Flow(a, motion(seed, 2, rows, kind)))


@pytest.mark.slow  # each case compiles a kernel of its own
@pytest.mark.parametrize(("links", "bsplines", "options"), [
    (1, False, {"dwell_s": 0.3}), (3, False, {"at_reversal": "decay", "memory": 3.0}),
    (2, True, {"at_reversal": "decay", "memory": 1.0, "dwell_s": 0.2})])  # two links without either: above
def test_the_kernel_equals_torch_for_every_rule_and_number_of_links(links, bsplines, options):
    a = arm(links)
    for seed, kind in enumerate(("from rest", "under way", "pauses", "still", "steady")):
        assert_equal(travelling(a, seed, options, bsplines), Flow(a, motion(seed, links, 2500, kind)))


@pytest.mark.slow  # tests/unit/deployment/compiled/test_travel_loads.py says the same of the loops before they are compiled
def test_a_recording_longer_than_the_kernels_pieces_is_not_torn():
    a = arm(2)
    assert_equal(travelling(a, 1, {}), Flow(a, motion(1, 2, 2500, "from rest")))


@pytest.mark.slow  # compiles a kernel
def test_rows_that_are_not_finite_do_not_come_out_as_torques():
    a, flow = arm(2), motion(1, 2, 50, "from rest")
    flow.qd[20] = torch.nan
    force, _ = kernel_loads(travelling(a, 1, {}), Flow(a, flow))
    assert np.isfinite(force[:20]).all()
    assert np.isnan(force[20]).all()
