"""The reproduction of McLain & Rock: the golden errors, the plateau at four segments, and the table."""

import pytest
from mclain import golden

from nnhydro.evaluation.mclain.arm import VALIDATION, pooled_error, slew
from nnhydro.evaluation.mclain.reproduce import NOT_IN_TEXT, effective_drag, reproduce, table
from nnhydro.physics.motion import tensor
from nnhydro.physics.travel.state_model import state_loads

ERRORS = golden("errors")
FLOWS = [slew(*motion) for motion in VALIDATION]


@pytest.fixture(scope="module")
def result():
    return reproduce(draws=20)


def test_the_error_of_few_segments_is_the_golden_one():
    document = golden("segments")
    exact = [-tensor(s["T_hyd_continuum"]) for s in golden("slews")["slews"]]
    for n, wanted in zip(document["n"], document["error_vs_continuum"], strict=True):
        ours = [state_loads(flow.arm, per_link=n).torque(flow)[:, 0] for flow in FLOWS]
        assert pooled_error(exact, ours) == pytest.approx(wanted, abs=1e-10), n


@pytest.mark.slow
def test_four_segments_are_enough_on_top_of_the_papers_own_residual(result):
    document = golden("segments")
    noisy = dict(zip(document["n"], document["error_vs_noisy_measurement"]["0.1055"], strict=True))
    for n, (_, error) in result.segments.items():
        assert error == pytest.approx(noisy[n], abs=0.006), n
    assert result.segments[4][1] - result.segments[20][1] < 0.006 < 0.05 < result.segments[2][1] - result.segments[4][1]


def test_with_the_implied_deviation_the_errors_are_the_golden_statistics(result):
    wanted = ERRORS["errors_vs_measurement_with_implied_deviation(statistical,40 draws,seed 55)"]
    ours = result.errors_measured
    assert ours["Levesque & Richard"] == pytest.approx(wanted["levesque_richard_Cd1.1_Cm0"], abs=0.03)
    assert ours["textbook"] == pytest.approx(wanted["standard_Cd1.2_Cm1"], abs=0.03)
    assert ours["fitted constants"] == pytest.approx(wanted["best_constants"], abs=0.015)
    assert ours["state-dependent"] == pytest.approx(wanted["state_dependent"], abs=0.01)


def test_effective_drag_of_a_steady_rotation_is_the_curves_steady_value_and_rises_with_slenderness():
    assert effective_drag(9.15) == pytest.approx(0.78, rel=1e-4)
    rising = [effective_drag(x, ("aspect_ratio",)) for x in (5.0, 9.15, 15.0, 40.0)]
    assert rising == sorted(rising)


def test_the_table_comes_out(result):
    text = " ".join(" ".join(row) for row in table(result))
    for number in ("43.4 %", "51.5 %", "12.6 %"):
        assert number in text
    assert len(NOT_IN_TEXT) >= 3
    assert result.document()["errors"]["textbook"] == pytest.approx(0.515, abs=1e-3)
