"""Choices are taken within their ranges."""

from dataclasses import replace

import pytest

from nnhydro.errors import ConfigError
from nnhydro.physics.vortex_wake.choices import WakeChoices

CHOICES = WakeChoices()


@pytest.mark.parametrize(("changes", "fine"), [
    ({"step": 0.1}, True), ({"step": 0.1001}, False), ({"step": 0.0}, False), ({"core": 0.0}, False), ({"core": 1e-3}, True),
    ({"survival": 1.0}, True), ({"survival": 1.001}, False), ({"survival": 0.0}, True), ({"offset": 0.001}, False),
    ({"offset": 0.0011}, True), ({"separation_onset": 0.0}, False), ({"merge_distance": 0.0}, True), ({"merge_distance": -1e-9}, False),
])
def test_choices_are_taken_within_their_ranges_and_refused_beyond(changes, fine):
    if fine:
        assert vars(replace(CHOICES, **changes)).items() >= changes.items()
    else:
        with pytest.raises(ConfigError):
            replace(CHOICES, **changes)
