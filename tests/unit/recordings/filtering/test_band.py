"""The comparison ends where the motion ends, but for lines that recordings share in the torque, and for arms that hardly move."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import planted, recording
from rigs import arm

from nnhydro.recordings.filtering.band import PAST, Band, band_of, highest_line, share_above
from nnhydro.recordings.filtering.trajectory import FEWEST_LINES, HIGHEST_EDGE, LOWEST_EDGE, known_edge

ARM = arm(1)


def runs(count=4, seconds=20.0, line=0.0, size=0.0, still=False, shown=None):
    """Recordings with a sine of `line` Hz and `size` times the torque's rms in those of `shown`, its phase another in each."""
    made = []
    for k in range(count):
        r = recording(ARM, planted(ARM), f"run{k}", seed=k + 1, seconds=seconds, rate=100.0)
        rng = np.random.default_rng(k)
        if still:
            q = 0.3 + 1e-4 * rng.standard_normal(r.q.shape)
            r = replace(r, q=q, qd=None, qdd=None, tau=0.05 * rng.standard_normal(r.tau.shape))
        acting = shown is None or k in shown
        wave = size * max(float(r.tau.std()), 0.1) * np.sin(2 * np.pi * line * r.t + rng.uniform(0, 6)) * acting
        made.append(replace(r, tau=r.tau + wave[:, None] + 0.01 * float(r.tau.std()) * rng.standard_normal(r.tau.shape)))
    return made


def test_without_a_line_both_bands_end_where_the_motion_ends():
    usual = runs()
    assert band_of(usual) == Band(*2 * known_edge(usual)[:1])


def test_a_machine_that_moves_slowly_has_a_band_below_that_of_others():
    usual = runs()
    slow = [replace(r, t=64 * r.t, qd=None, qdd=None) for r in usual]
    assert known_edge(usual)[0] / 64 < LOWEST_EDGE
    assert band_of(slow).motion == pytest.approx(known_edge([replace(r, qd=None, qdd=None) for r in usual])[0] / 64)


def test_a_machine_whose_recordings_last_a_tenth_of_a_second_has_a_band_that_holds_their_motion():
    quick = [replace(r, t=r.t / 200, qd=None, qdd=None) for r in runs()]
    lasts = float(quick[0].t[-1])
    assert known_edge(quick)[0] > 2 * HIGHEST_EDGE
    assert band_of(quick).motion == pytest.approx(min(known_edge(quick)[0], FEWEST_LINES / lasts))


def test_steady_tables_alone_have_the_usual_band():
    assert band_of([]) == Band(HIGHEST_EDGE, LOWEST_EDGE)


@pytest.mark.parametrize("shown", [None, (0, 2)])
def test_a_line_that_recordings_share_lies_well_inside_the_comparison_and_leaves_the_motion_as_it_is(shown):
    edge = known_edge(runs())[0]
    line = 1.6 * edge
    band = band_of(runs(line=line, size=0.5, shown=shown))
    assert band.motion == edge
    assert band.torque == pytest.approx(PAST * line, rel=0.1)


def test_a_line_of_one_recording_alone_is_no_wave():
    edge, rng = known_edge(runs())[0], np.random.default_rng(0)
    first, *others = runs(line=1.6 * edge, size=0.5)
    noise = [replace(r, tau=rng.standard_normal(r.tau.shape)) for r in others]
    assert highest_line([first, *noise], edge) == 0.0


def test_lines_that_rise_with_the_speed_are_one_cause_and_the_band_holds_that_of_two_recordings():
    edge = known_edge(runs())[0]
    shedding = [runs(line=f * edge, size=0.5)[k] for k, f in enumerate((1.5, 1.8, 2.2, 2.6))]
    assert highest_line(shedding, edge) == pytest.approx(2.2 * edge, rel=0.06)


def test_what_lies_above_an_edge_is_a_share_of_the_rms():
    edge = known_edge(runs())[0]
    alone = runs(line=3 * edge, size=0.5)
    rms = float(np.sqrt(np.mean([(r.tau**2).mean() for r in alone])))
    wave = float(np.sqrt(np.mean([(r.tau - clean.tau).var() for r, clean in zip(alone, runs(), strict=True)])))
    assert share_above(alone, 2 * edge) == pytest.approx(wave / rms, rel=0.25)
    assert share_above(runs(), 2 * edge) < 0.03
    assert share_above([], 1.0) == 0.0


def test_a_line_that_the_arm_moves_at_is_its_own():
    edge = known_edge(runs())[0]
    line = 1.6 * edge
    swung = [replace(r, q=r.q + 0.02 * np.sin(2 * np.pi * line * r.t)[:, None]) for r in runs(line=line, size=0.5)]
    assert highest_line(swung, edge) == 0.0


def test_an_arm_that_is_held_is_compared_over_all_of_its_torque_and_smoothed_most():
    assert band_of(runs(still=True)) == Band(HIGHEST_EDGE, LOWEST_EDGE)


def test_both_edges_scale_alike():
    assert Band(4.0, 2.0).times(0.5) == Band(2.0, 1.0)
