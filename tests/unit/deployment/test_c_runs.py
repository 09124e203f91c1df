"""Values of one operation are ordered so that their operands lie side by side; a place is used again when nobody asks for it any more."""

import numpy as np

from nnhydro.deployment.c_places import Places, last_uses
from nnhydro.deployment.c_runs import fewest_runs, runs, stretches
from nnhydro.deployment.onnx.expressions import Program, combine, row_of
from nnhydro.deployment.onnx.schedule import rounds


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


def test_a_place_is_used_again_only_after_the_round_that_reads_it_last():
    p = Program(2)
    x = [p.unary("tanh", combine([(1.0, p.input(0)), (0.1 * k, p.input(1))])) for k in range(6)]
    late, y = x[0], combine([(1.0, value) for value in x])
    for kind in ("exp", "sin", "cos"):
        y = p.unary(kind, y)
    outputs = [p.apply("mul", y, late)]
    planned = rounds(p, outputs)
    memory = Places(last_uses(p, planned, outputs))
    kept, other = row_of(late), row_of(x[1])
    first, second = memory.take([kept]), memory.take([other])
    gone = next(n for n in range(len(planned) + 1) if (memory.end_round() or other not in memory.at))
    assert gone == memory.last[other] < memory.last[kept]
    assert memory.at[kept] == first
    assert memory.block(1, memory.now) == second


def test_free_neighbours_are_one_place():
    memory = Places({})
    blocks = [memory.block(n, 0) for n in (3, 4, 5)]
    assert blocks == [0, 3, 7]
    memory.end_round()
    assert memory.block(11, 1) == 1, "all but the first place, where the vector itself begins"
    assert memory.size == 12
