"""Vectors: what one vector holds is read from there, what several hold is joined once, and what nobody asks for soon stays behind."""

import numpy as np

from nnhydro.deployment.onnx.vectors import SOON, Vectors, single


def operations(made):
    """The kinds of the nodes in their order."""
    return [node.op_type for node in made.nodes]


def two(n=3):
    """Two vectors of `n` values each."""
    made = Vectors(np.float64)
    made.chunk("a", [single(k) for k in range(n)])
    made.chunk("b", [single(n + k) for k in range(n)])
    return made


def test_a_vector_that_is_there_is_given_as_it_is():
    made = two()
    assert made.gather([single(k) for k in (3, 4, 5)], (3,)) == "b"
    assert made.gather([single(k) for k in (0, 1, 2)], (3, 1)) == "v0"
    assert operations(made) == ["Reshape"]


def test_what_lies_in_several_vectors_is_joined_once_and_stays_readable_where_it_was():
    made = two()
    made.gather([single(0), single(4)], (2,))
    made.gather([single(1), single(3)], (2,))
    assert operations(made) == ["Concat", "GatherElements", "GatherElements"]
    made.gather([single(2), single(1)], (2,))
    assert made.nodes[-1].input[0] == "a"
    assert made.place(single(4)) == (2, 4)


def test_vectors_that_each_lie_in_one_place_need_no_joint():
    made = two()
    made.join_scattered([[single(0), single(1)], [single(5)]])
    assert operations(made) == []
    made.join_scattered([[single(0), single(5)], [single(1)]])
    assert operations(made) == ["Concat"]


def test_what_is_asked_for_late_stays_behind_unless_it_is_wanted_now():
    made = two(5000)
    late = [single(4000)]
    made.plan([[single(0)], *[[] for _ in range(SOON)], [single(k) for k in range(5000)]])
    made.join([single(0), single(5000), *late])
    assert len(made.chunks[-1][1]) == 3
    assert made.due(single(0)) == 0
    assert made.due(single(1)) == SOON + 1
    assert made.due(single(7000)) == np.inf
