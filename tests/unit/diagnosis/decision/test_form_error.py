"""What an error in the form of one law may gain for another: how much another law must gain beside it."""

import numpy as np
import pytest
from problems import design, law, search, unknown

from nnhydro.diagnosis.constants import FORM
from nnhydro.diagnosis.decision.form_error import form_bars

LAWS = tuple(law(f"law_{k}") for k in range(8))


def columns(of):
    """Columns (n, joints, 8) whose rms is the scale of joint 1."""
    return np.random.default_rng(50).standard_normal((*of.y.shape, 8))


def with_planted(values, laws=LAWS):
    """A search on a design in which the first laws act with `values`."""
    of = design(0, groups=8, rows=30)
    X = columns(of)
    of.y = of.y + X[..., : len(values)] @ np.asarray(values, float)
    return search(of, laws, X)


def test_what_a_law_may_be_taken_for_must_gain_a_tenth_of_it_unless_every_joint_has_it():
    def bars(standard):
        laws = (law("law_0"), law("law_1", standard=standard), *LAWS[2:])
        laws[0].effect.signature.mistaken_for = ("law_1",)
        one = with_planted([1.0, 0.3], laws=laws)
        both = one.score((0, 1))
        gain = one.gain(one.score((1,)), both)
        return form_bars(one, both, [one.score((1,)), one.score((0,))])[1] / gain

    assert bars(standard=False) == pytest.approx(FORM)
    assert bars(standard=True) == pytest.approx(FORM**2)


@pytest.mark.parametrize(("predictable", "share"), [(1.0, FORM**2), (0.8, 0.2**2), (0.5, 0.5**2)])
def test_beside_a_law_of_which_a_part_alone_can_be_predicted_a_claim_must_gain_more_than_the_rest_could(predictable, share):
    one = with_planted([1.0, 0.3], laws=(law("law_0", predictable_share=predictable), *LAWS[1:]))
    both = one.score((0, 1))
    rests = [one.score((1,)), one.score((0,))]
    large, small = form_bars(one, both, rests)
    assert small == pytest.approx(share * one.gain(rests[0], both))
    assert large <= (1 + 1e-9) * FORM**2 * one.gain(rests[0], both), "its own form is no bar to it"


@pytest.mark.parametrize(("size", "added", "kept"), [(0.8, 0.0, False), (0.8, 0.6, True), (0.2, 0.0, True)])
def test_a_law_that_takes_more_than_another_s_form_and_leaves_next_to_nothing_is_not_that_form(size, added, kept):
    of = design(4, groups=8, rows=60, noise=0.02)
    smooth = unknown(of).Phi
    X = columns(of)
    X[..., 1] = smooth[:, :1]
    of.y = of.y + X[..., 0] + size * X[..., 1] + added * smooth[:, 1:2]
    one = search(of, (law("law_0", predictable_share=0.5), *LAWS[1:]), X, level=0.02**2)
    both = one.score((0, 1))
    assert (form_bars(one, both, [one.score((1,)), one.score((0,))])[1] > 0) == kept
