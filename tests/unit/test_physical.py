"""Which sets of effects may be: values within their bounds, plausible as a whole, and none that lives by cancelling another."""

import numpy as np
import pytest
from races import NOISE, SINGLE, P, candidate, race, tables

from nnhydro.diagnosis.race import UNPHYSICAL, gains

OWN = candidate("own", (), (2, 3))


@pytest.mark.parametrize(("low", "high", "fits"), [(0.0, 1.0, True), (0.6, 1.0, False), (0.0, 0.3, False), (-1.0, 0.0, False)])
def test_a_value_outside_of_its_bounds_is_unphysical_for_one_and_for_a_batch(low, high, fits):
    found = race(tables(10, {0: 0.5}), low=low, high=high)
    ((gain, _),) = gains(found, [SINGLE[0]])
    assert (found.total([SINGLE[0]]) < UNPHYSICAL) == fits
    assert (gain > 0) == fits
    assert abs(gain) < UNPHYSICAL or not fits


def test_bounds_are_those_of_the_column_whatever_the_order_in_which_candidates_stand():
    found = race(tables(11, {0: 0.5, 3: -0.5}))
    found.bank.low[0], found.bank.high[3] = 0.0, 0.0
    assert found.physical([SINGLE[3], SINGLE[0]], np.array([0, 3]), np.array([0.5, -0.5]))
    assert not found.physical([SINGLE[3], SINGLE[0]], np.array([0, 3]), np.array([-0.5, 0.5]))
    for chosen, tried in ((0, 3), (3, 0)):
        found.chosen = [SINGLE[chosen]]
        ((gain, _),) = gains(found, [SINGLE[tried]])
        assert 0 < gain < UNPHYSICAL


def test_what_an_effect_itself_finds_implausible_is_unphysical():
    fussy = candidate("fussy", (1, 4), plausible=lambda values: bool(values[0] > values[1]))
    for planted, fine in (({1: 0.5, 4: 0.2}, True), ({1: 0.2, 4: 0.5}, False)):
        found = race(tables(12, {0: 0.4, **planted}), (SINGLE[0], fussy), chosen=(0,))
        assert (found.total([fussy]) < UNPHYSICAL) == fine


@pytest.mark.parametrize(("share", "fine"), [(0.45, True), (0.55, False)])
def test_an_effect_may_hold_half_of_the_measured_energy_and_no_more(share, fine):
    found = race(tables(13, {0: 0.5}))
    energy = float(sum((table[..., P] ** 2 / NOISE**2).sum() for table in tables(13, {0: 0.5})))
    measured = float(sum((table[..., -1] ** 2 / NOISE**2).sum() for table in tables(13, {0: 0.5})))
    assert found.torque == pytest.approx(measured)
    value = np.sqrt(share * measured / energy)
    assert found.physical([SINGLE[0]], np.array([0]), np.array([value])) == fine
    assert found.physical([OWN], np.array([], dtype=np.int64), np.array([]))


@pytest.mark.parametrize(("taken_back", "fine"), [(0.08, True), (0.12, False)])
def test_the_rest_of_the_model_may_take_back_a_tenth_of_a_large_torque(taken_back, fine):
    """The effect is nearly all that is measured; with values too large by x the rest takes back x/(1 + x) of its energy."""
    made = tables(14, {0: 30.0})
    found = race(made)
    X, y = (np.concatenate([table[..., k] / NOISE for table in made]) for k in (P, -1))
    whole = (X * y).sum() / (X**2).sum()  # the value with which it shares its whole energy with what is measured
    assert found.physical([SINGLE[0]], np.array([0]), np.array([whole / (1 - taken_back)])) == fine


def test_how_much_of_a_torque_is_in_what_is_measured_counts_joints_by_their_noise():
    """Nearly nothing of the effect is measured where the sensor is quiet, all of it where it is loud: it lives by cancelling."""
    made = tables(15)
    for table in made:
        table[:, 1, -1] += 40 * table[:, 1, P]
    quiet, loud = race(made, noise=np.array([0.5, 20.0])), race(made, noise=np.array([20.0, 0.5]))
    assert quiet.physical([SINGLE[0]], np.array([0]), np.array([1.0])), "a small torque cancels nothing worth mention"
    for found, fine in ((quiet, False), (loud, True)):
        assert found.physical([SINGLE[0]], np.array([0]), np.array([40.0])) == fine


def test_values_of_a_recordings_own_are_not_asked_whether_they_make_sense_together():
    own = candidate("own", (), (2, 3), plausible=lambda values: False)
    assert race(tables(13), (own,)).physical([own], np.array([], dtype=np.int64), np.array([]))


def test_what_a_choice_loses_without_one_is_left_out_score_without_its_price():
    """A law with many values tried is as much missed by the recordings as one with a single value."""
    many = candidate("effect_0", (0,), grid=500)
    found = race(tables(16, {0: 0.3}), (many, SINGLE[1]), chosen=(0, 1))
    assert found.loss(many) == pytest.approx(found.scored(without=[many]).total - found.scored().total)
    bounded = race(tables(16, {0: 0.3, 1: -0.3}), (many, SINGLE[1]), chosen=(0, 1))
    bounded.bank.low[1] = 0.0
    assert found.total(without=[many]) - found.total() == pytest.approx(found.loss(many) - 1 - 0.5 * np.log(500))
    assert 0 < bounded.loss(many) < 1000, "whatever value the other one takes"
