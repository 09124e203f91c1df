"""All hypotheses by name, where each can act on an arm, and how one is read back from its document."""

import pytest
from hypotheses import made
from rigs import arm

from nnhydro.effects.catalogue import USUAL_RATE, candidates, card, catalogue, effect_of_id, instrument_of
from nnhydro.effects.in_sector import ReadInSector
from nnhydro.errors import ConfigError, ModelError


def test_an_unknown_effect_is_refused_with_what_was_meant():
    with pytest.raises(ConfigError, match=r"unknown effect 'coulomb_frction'.*coulomb_friction"):
        effect_of_id("coulomb_frction")
    assert effect_of_id("backlash") is catalogue()["backlash"]


def test_candidates_are_every_joint_at_every_grid_point():
    effect = effect_of_id("stribeck_friction")
    points = 1
    for grid in effect.grids().values():
        points *= len(grid)
    found = candidates(effect, arm(2))
    assert len(found) == len(set(found)) == 2 * points
    assert {law.joint for law in found} == {1, 2}


def test_in_air_nothing_of_the_water_is_tried():
    assert candidates(effect_of_id("tip_drag"), arm(2, density=0.0)) == ()
    assert candidates(effect_of_id("torque_crosstalk"), arm(1)) == ()


def test_levels_in_shares_of_the_torque_follow_the_torque_of_the_joint():
    effect = effect_of_id("torque_saturation")
    assert candidates(effect, arm(2)) == ()
    small, large = (candidates(effect, arm(2), (peak, 0.0)) for peak in (1.0, 3.0))
    assert {law.joint for law in small} == {1}, "a joint that reads nothing has no level"
    (name,) = effect.torque_scaled
    assert [getattr(law, name)[0] * 3 for law in small] == pytest.approx([getattr(law, name)[0] for law in large])


def test_what_happens_at_low_rates_is_tried_lower_where_a_joint_is_slow():
    effect = effect_of_id("stribeck_friction")
    (name,) = effect.rate_scaled
    usual, slow = (candidates(effect, arm(1), None, (rate,)) for rate in (USUAL_RATE, USUAL_RATE / 10))
    assert [getattr(law, name)[0] / 10 for law in usual] == pytest.approx([getattr(law, name)[0] for law in slow])


def test_an_instrument_is_read_back_from_its_document():
    gain = made("torque_gain", arm(2), 1, error=(0.2,))
    assert instrument_of(gain.document()) == gain
    there = ReadInSector(0.0, None, gain, joint=1)
    assert instrument_of(there.document()) == there
    with pytest.raises(ModelError, match="unknown instrument effect 'effect:coulomb_friction'"):
        instrument_of({"kind": "effect:coulomb_friction"})
    with pytest.raises(ModelError, match="is an object with a kind"):
        instrument_of([])


def test_a_card_says_what_the_effect_is():
    assert card(effect_of_id("torque_gain"))["kind"] == "instrument"
    assert card(effect_of_id("tip_drag"))["kind"] == "load"
