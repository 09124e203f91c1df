"""Where values lie in one vector: places are used again once nobody reads them."""

from nnhydro.deployment.c_places import Places, last_uses
from nnhydro.deployment.onnx.expressions import Program, combine, row_of
from nnhydro.deployment.onnx.schedule import rounds


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
