"""A zero with a value of its own in every recording that stays where it is is an offset, no drift."""

from types import SimpleNamespace

import numpy as np
import pytest
from races import P, candidate, race, tables

from nnhydro.diagnosis.still import stays, zeros
from nnhydro.diagnosis.verdict import rivals_of

LONG = (400, 500)
PLAIN = SimpleNamespace(general=False, family="torque_sensor")
DRIFT, BIAS, OTHER = (candidate("drift", (3,), (2,), effect=PLAIN), candidate("bias", (4,), effect=PLAIN),
                      candidate("other", (0,), effect=PLAIN))


def moving(values, curve=0.0, rows=LONG):
    """Tables whose column 2, a constant at both joints, has `values` in the recordings; column 4 is the same, column 3 a slow curve.

    Column 0, of which a half is planted, has a mean of 1: whoever forgets it takes it for a zero.
    """
    made = tables(3, {0: 0.5}, units=len(values), rows=rows)
    for u, (table, value) in enumerate(zip(made, values, strict=True)):
        table[..., P] += 1.0
        table[..., P + 2] = table[..., P + 4] = 1.0
        table[..., P + 3] = (u - (len(values) - 1) / 2) / len(values)
        table[..., -1] += 0.5 + value + curve * table[..., P + 3]
    return made


def test_the_zeros_are_those_planted_the_common_curve_with_them():
    values = np.array([0.4, 0.1, -0.3, 0.6, 0.2, 0.0])
    found = race(moving(values, curve=1.2), (OTHER, DRIFT))
    place = (np.arange(6) - 2.5) / 6
    np.testing.assert_allclose(zeros(found, [OTHER], DRIFT), values + 1.2 * place, atol=0.1)


@pytest.mark.parametrize(("values", "curve", "said"), [
    (6 * [1.0], 0.0, True), (6 * [-1.0], 0.0, True),
    (6 * [0.0], 0.0, False),  # nothing there
    ([0.4, 1.6] * 3, 0.0, False), (6 * [1.0], 2.0, False),  # it moves from recording to recording, or along the curve
    (3 * [1.0], 0.0, False),  # three recordings tell nothing
])
def test_what_is_the_same_in_every_recording_stays(values, curve, said):
    assert stays(race(moving(values, curve), (OTHER, DRIFT)), [OTHER], DRIFT) == said


@pytest.mark.parametrize(("share", "said"), [(0.96, True), (1.04, False)])
def test_the_spread_is_bounded_at_a_quarter_of_the_mean(share, said):
    from scipy.stats import chi2

    spread = np.array([-1.0, 1.0] * 4) * share * 0.25 * np.sqrt(float(chi2.ppf(0.05, 7)) / 8)
    assert stays(race(moving(1.0 + spread, rows=(9000, 9001)), (OTHER, DRIFT)), [OTHER], DRIFT) == said


def test_what_has_no_value_of_each_recordings_own_or_nothing_else_does_not_stay():
    found = race(moving(6 * [1.0]), (OTHER, DRIFT, BIAS))
    assert not stays(found, [OTHER], BIAS)
    assert not stays(found, [OTHER], candidate("wave", (), (2,)))


def test_a_drift_that_stays_is_no_rival_of_an_offset():
    kept = {}
    for name, values in (("still", 6 * [1.0]), ("moving", [0.1, 1.9, 0.6, 1.4, 0.2, 1.8])):
        found = race(moving(values), (OTHER, DRIFT, BIAS), chosen=(0, 2))
        kept[name] = [rival.candidate.key[0] for rival in rivals_of(found, BIAS)]
    assert kept == {"still": [], "moving": ["drift"]}
