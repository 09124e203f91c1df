"""What is computed once and kept: by key, the latest up to a size; contents told apart by their numbers."""

import torch

from nnhydro.physics.memo import RecentMemo, content_of


def test_what_was_asked_for_last_is_kept_up_to_the_size_and_the_rest_computed_anew():
    asked, memo = [], RecentMemo(most=20)

    def of(key):
        return memo.of(key, lambda: asked.append(key) or key.upper(), lambda value: 8)

    assert [of(key) for key in "abab"] == ["A", "B", "A", "B"]
    assert asked == ["a", "b"]
    of("a")
    of("c")  # 24 bytes: b was asked for longest ago
    assert [of("a"), of("c")] == ["A", "C"]
    assert asked == ["a", "b", "c"]
    of("b")
    assert asked[-1] == "b"


def test_what_is_larger_than_the_store_is_given_but_not_kept():
    asked, memo = [], RecentMemo(most=20)
    for _ in range(2):
        assert memo.of("x", lambda: asked.append(1) or "X", lambda value: 21) == "X"
    assert asked == [1, 1]


def test_contents_differ_with_any_number_with_the_shape_and_with_what_is_missing():
    x, y = torch.arange(6.0), torch.arange(6.0)
    y[3] += 1e-6
    told = [content_of(tensors) for tensors in ([x], [y], [x.reshape(2, 3)], [x.double()], [x, None], [None, x], [x[:3], x[3:]])]
    assert len(set(told)) == len(told)
    assert content_of([x.reshape(2, 3).T.contiguous().T]) == content_of([x.reshape(2, 3)])
