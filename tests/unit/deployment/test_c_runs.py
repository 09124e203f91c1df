"""Values of one operation are ordered so that their operands lie side by side; a place is used again when nobody asks for it any more."""

import numpy as np

from nnhydro.deployment.c_runs import fewest_runs, runs, statements, stretches


def test_what_lies_number_beside_number_is_read_strip_beside_strip():
    strips, numbers = 8, 5
    at = [[strips * k + s for s in range(strips) for k in range(numbers)], [100 + s for s in range(strips) for _ in range(numbers)]]
    order, (first, second) = fewest_runs([(list(range(strips * numbers)), at)])
    assert stretches([first, second]) == [(0, 40, 8, (1, 1))]
    assert sorted(order) == list(range(40))
    assert [at[0][i] for i in order] == first


def test_what_one_number_a_strip_makes_lies_strip_beside_strip_too():
    strips = numbers = 8
    _, (found,) = fewest_runs([(list(range(strips * numbers)), [[s for s in range(strips) for _ in range(numbers)]])])
    assert found == numbers * list(range(strips)), "not all numbers of a strip side by side: their readers go strip by strip"


def test_all_values_are_in_the_order_once_whatever_their_places():
    rng = np.random.default_rng(0)
    for _ in range(20):
        at = [rng.integers(0, 12, 60).tolist() for _ in range(2)]
        order, found = fewest_runs([(list(range(60)), at)])
        assert sorted(order) == list(range(60))
        assert found == [[places[i] for i in order] for places in at]
        assert sum(width for width, _ in runs(found)) == 60


def test_a_run_costs_as_many_vectors_as_it_fills_so_that_strips_lie_side_by_side_among_many_numbers():
    strips, numbers = 8, 24
    _, (found,) = fewest_runs([(list(range(strips * numbers)), [[s for s in range(strips) for _ in range(numbers)]])])
    assert found == numbers * list(range(strips))


def test_few_values_are_written_out():
    places, weights = [[3, 7], [5, 5]], [["2.0", "-1.0"], ["0.5", "0.5"]]
    assert list(statements(places, weights, 10, range(2), "{0} + {1}")) == ["v[10] = 2.0*v[3] + 0.5*v[5];", "v[11] = -1.0*v[7] + 0.5*v[5];"]
    assert list(statements(places, (), 10, range(1, 2), "f_tanh({0})")) == ["v[11] = f_tanh(v[7]);"]
