"""What a campaign can reveal, effect by effect: visible energies, sizes from strengths, typical shapes and nearest rivals."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from races import NOISE, K, P, candidate, fit, race, rows, tables

from nnhydro.diagnosis.power import (
    Reveal,
    _directions,
    _of_laws,
    _reveals,
    _typical,
    _with_rivals,
    _within_bounds,
    correlation,
    visible_energies,
)
from nnhydro.diagnosis.strength import Price, Where, smallest_own_strength, smallest_strength
from nnhydro.recordings.low_pass import LowPass

PRIOR = np.array([4.0, 0.0, 50.0])


def effect(names, bounds=None, **shape):
    """What the power study asks of an effect with these linear parameters."""
    def with_linear(x):
        amplitude = SimpleNamespace(value=float((x**2).sum() ** 0.5), unit="N m")
        return SimpleNamespace(quantities=lambda: {"amplitude": amplitude})

    return SimpleNamespace(
        linear_names=lambda: tuple(names), linear_units=lambda: tuple(f"unit of {name}" for name in names),
        linear_bounds=lambda: tuple(bounds or [(-np.inf, np.inf)] * len(names)), id="e", family="f", joint=0,
        with_linear=with_linear, **{name: (value,) for name, value in shape.items()})


def one(name, columns=(), own=(), shape=None, bounds=None, grid=1):
    names = [f"{name}{k}" for k in range(len(columns) + len(own))]
    shape = shape or {}
    return candidate(name, columns, own, grid=grid, spans=dict.fromkeys(shape, (0.0, 1.0)), effect=effect(names, bounds, **shape))


BANK = (one("a", (0,), shape={"v": 2.0}, grid=5), one("b", (1, 2)), one("c", (), (3, 4)), one("d", (5,)))


def left_of(made, column, prior=PRIOR):
    """What the baseline's refit leaves of a column, row by row."""
    r = rows(made)
    Z = r.Z[:, :P]
    return r, r.Z[:, P + column] - Z @ fit(Z, r.Z[:, P + column], prior)


def test_visible_energies_are_those_of_the_rows_that_the_refit_leaves():
    made = tables(1)
    energies, whole = visible_energies(race(made, prior=PRIOR))
    for k in range(K):
        r, left = left_of(made, k)
        for b in range(energies.shape[0]):
            for j in range(2):
                assert energies[b, j, k] == pytest.approx((left[(r.block == b) & (r.joint == j)] ** 2).sum(), rel=1e-6)
        assert whole[k] == pytest.approx((r.Z[:, P + k] ** 2).sum())


def test_parameters_are_taken_one_by_one_and_a_phase_of_its_own_as_an_amplitude():
    told = [(name, unit, columns, direction.tolist()) for name, unit, columns, direction in _directions(BANK[1])]
    assert told == [("b0", "unit of b0", [1], [1.0, 0.0]), ("b1", "unit of b1", [2], [0.0, 1.0])]
    ((name, unit, columns, direction),) = _directions(BANK[2])
    assert (name, unit, columns) == ("amplitude", "N m", [3, 4])
    np.testing.assert_allclose(direction, [1 / np.sqrt(2)] * 2)
    assert [columns for _, _, columns, _ in _directions(one("e", (2,), (3,)))] == [[2], [3]]


@pytest.mark.parametrize(("bounds", "size", "fits"), [
    ([(0.0, 1.0)], 1.0, True), ([(0.0, 1.0)], 1.1, False), ([(-1.0, 0.5)], 0.9, True), ([(-1.0, 0.5)], 1.1, False),
])
def test_a_size_is_possible_where_either_sign_of_it_is(bounds, size, fits):
    assert _within_bounds(one("e", (0,), bounds=bounds), np.array([1.0]), size) == fits


def test_all_of_a_direction_must_lie_within_its_bounds_at_once():
    both = one("e", (0, 1), bounds=[(0.0, 1.0), (-1.0, 0.0)])
    assert _within_bounds(both, np.array([1.0, -1.0]), 1.0)
    assert not _within_bounds(both, np.array([1.0, 1.0]), 1.0)


def test_the_size_is_the_strength_over_the_visible_amplitude():
    made = tables(2, rows=(90, 120), units=8)
    found = race(made, BANK, prior=PRIOR)
    told = {row.parameter: row for row in _reveals(found, 4.5, 1.3)}
    assert list(told) == ["a0", "b0", "b1", "amplitude", "d0"]
    r, left = left_of(made, 0)
    blocks = np.array([(left[r.block == b] ** 2).sum() for b in range(int(r.block.max()) + 1)])
    joints = np.array([(left[r.joint == j] ** 2).sum() for j in range(2)])
    where = Where(blocks / blocks.sum(), found.bench.blocks.unit, joints.max() / joints.sum(), sum(map(len, made)), 1.3)
    needed = smallest_strength(where, Price(4.5, 1, 1 + 0.5 * np.log(5)))
    assert told["a0"].strength == pytest.approx(needed, rel=0.03)
    assert told["a0"].size == pytest.approx(told["a0"].strength / np.sqrt((left**2).sum()))
    assert told["a0"].visible == pytest.approx(np.sqrt((left**2).sum() / (r.Z[:, P] ** 2).sum()))
    assert (told["a0"].shape, told["a0"].found_of, told["a0"].unit) == ({"v": 2.0}, (1, 1), "unit of a0")
    own = told["amplitude"]
    lefts = [left_of(made, k)[1] for k in (3, 4)]
    assert own.size == pytest.approx(own.strength / np.sqrt(sum((left**2).sum() / 2 for left in lefts)))
    blocks = np.array([sum((left[r.block == b] ** 2).sum() for left in lefts) for b in range(len(blocks))])
    assert own.strength == pytest.approx(smallest_own_strength(replace(where, e=blocks / blocks.sum()), 2), rel=1e-6)


def test_what_the_baseline_fits_or_bounds_forbid_has_no_size():
    made = tables(3, units=8)
    for table in made:
        table[..., P + 5] = 2 * table[..., 0]
    bank = (one("a", (0,), bounds=[(-1e-4, 1e-4)]), *BANK[1:])
    told = {row.parameter: row for row in _reveals(race(made, bank), 4.5, 1.0)}
    for name, visible in (("d0", 0.0), ("a0", pytest.approx(1.0, abs=0.05))):
        assert (told[name].size, told[name].strength, told[name].found_of) == (None, None, (0, 1))
        assert told[name].visible == visible
    assert told["b0"].size > 0


def reveal(size, shape=0.0, width=1):
    return Reveal(SimpleNamespace(width=width), "p", "1", size, 0.5, size, {"v": shape}, np.ones(1), (int(size is not None), 1))


@pytest.mark.parametrize(("sizes", "middle"), [([3.0], 3.0), ([3.0, 1.0, 2.0], 2.0), ([4.0, 1.0, 3.0, 2.0], 3.0), ([None, 1.0, None], 1.0),
                                               ([None, 2.0, 1.0, None, 3.0], 2.0), ([None, None], None)])
def test_the_typical_shape_is_that_of_the_middle_size_among_those_that_are_found(sizes, middle):
    told = _typical([reveal(size, shape=k) for k, size in enumerate(sizes)])
    assert told.size == middle
    assert told.found_of == (sum(size is not None for size in sizes), len(sizes))


def test_of_an_effect_with_several_laws_the_size_is_that_of_the_law_found_earliest():
    """Each law's size is that of its middle shape; all shapes of all laws together have another one."""
    sizes = [(3.0, 2), (4.0, 2), (9.0, 2), (6.0, 4), (7.0, 4), (8.0, 4)]
    rows = [reveal(size, shape=k, width=width) for k, (size, width) in enumerate(sizes)]
    told = _of_laws(rows)
    assert (told.size, told.found_of, told.instance.width) == (4.0, (3, 3), 2)
    assert _of_laws([reveal(None, width=2), reveal(5.0, width=4)]).size == 5.0
    assert _of_laws([reveal(None, width=2), reveal(None, width=4)]).size is None


def test_the_threshold_pays_for_every_column_of_every_race():
    from races import race as raced
    from races import tables

    from nnhydro.diagnosis.locks import statistics
    from nnhydro.diagnosis.power import _threshold

    races = [raced(tables(seed)) for seed in (1, 2, 3)]
    largest = np.stack([statistics(one, 5)[1] for one in races]).max(axis=(0, 2))
    assert (largest > _threshold(races, 5)).sum() == 4, "a third of a hundredth of 999 draws, rounded up"
    assert _threshold(races, 5) > _threshold(races[:1], 5)


def test_the_nearest_rival_is_the_other_effect_that_explains_most_of_what_the_baseline_leaves():
    made = tables(4, units=8)
    for table in made:
        table[..., P + 5] = table[..., P] + 0.5 * table[..., P + 5] + table[..., 1]
        table[..., P + 1] = 0.5 * table[..., P] + table[..., P + 1]
    found = race(made, BANK)
    told = {row.parameter: row for row in _with_rivals(found, list(_reveals(found, 4.5, 1.0)))}
    _, x = left_of(made, 0, 0.0)
    shares = {}
    for name, columns in (("b", (1, 2)), ("d", (5,))):
        Z = np.stack([left_of(made, k, 0.0)[1] for k in columns], axis=1)
        shares[name] = 1 - ((x - Z @ np.linalg.lstsq(Z, x, rcond=None)[0]) ** 2).sum() / (x @ x)
    assert shares["d"] > shares["b"]
    assert told["a0"].rival == "d"
    assert told["a0"].likeness == pytest.approx(np.sqrt(shares["d"]), rel=1e-5)
    assert told["d0"].rival == "a"
    assert told["b0"].rival == "a"
    assert told["b1"].likeness < 0.1
    assert (told["amplitude"].rival, told["amplitude"].likeness) == (None, 0.0)


def test_one_effect_at_another_joint_or_shape_is_no_rival_of_itself():
    made = tables(5, units=8)
    for table in made:
        table[..., P + 1] = table[..., P]
    found = race(made, (one("a", (0,)), one("a", (1,)), one("d", (5,))))
    told = {row.instance.key: row for row in _with_rivals(found, list(_reveals(found, 4.5, 1.0)))}
    assert told[("a", 0)].rival == "d"


def pieces(*parts):
    """A table with one piece a unit: (rows, cut-off, sampling s, rows' distance s)."""
    segments = [SimpleNamespace(low_pass=None if cutoff is None else LowPass(cutoff), dt=dt) for _, cutoff, dt, _ in parts]
    units = [SimpleNamespace(segments=lambda segment=segment: (segment,)) for segment in segments]
    made = [SimpleNamespace(number=k, k=0, y=np.zeros(n), dt=apart) for k, (n, _, _, apart) in enumerate(parts)]
    return SimpleNamespace(pieces=made, case=SimpleNamespace(all_units=units))


def test_rows_behind_a_low_pass_are_correlated_as_its_bandwidth_says():
    cutoff, apart = 4.0, 0.05
    bandwidth = cutoff * 7 / 8 * (np.pi / 8) / np.sin(np.pi / 8)
    assert correlation(pieces((100, cutoff, 0.01, apart))) == pytest.approx(1 / (2 * bandwidth * apart), rel=2e-3)
    assert correlation(pieces((100, None, 0.01, apart))) == 1.0
    assert correlation(pieces((100, 44.9, 0.01, 0.01))) > 1.1
    assert correlation(pieces((100, 45.0, 0.01, 0.01))) == 1.0, "a low-pass near the end of the spectrum passes everything"
    assert correlation(pieces((100, cutoff, 0.01, 1.0))) == 1.0, "rows so far apart are independent"
    mixed = correlation(pieces((300, cutoff, 0.01, apart), (100, None, 0.01, apart)))
    assert mixed == pytest.approx(0.75 / (2 * bandwidth * apart) + 0.25, rel=2e-3)


def test_noise_makes_every_size_larger_in_proportion():
    made = tables(6, units=8)
    quiet, loud = ({row.parameter: row for row in _reveals(race(made, BANK, noise=x), 4.5, 1.0)} for x in (NOISE, 3 * NOISE))
    for name in quiet:
        assert loud[name].size == pytest.approx(3 * quiet[name].size, rel=1e-6)
