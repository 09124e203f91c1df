"""Which sums go together: as matrices, as mirror images, or filled up to one length."""

import numpy as np
import pytest

from nnhydro.deployment.onnx.row_blocks import alike_in_length, mirror_pairs, row_blocks


def test_long_rows_over_the_same_atoms_are_a_matrix_and_the_others_stay_alone():
    long = [tuple((k, float(c + k)) for k in range(4)) for c in range(3)]
    other, short = tuple((k, 1.0) for k in range(1, 5)), ((0, 1.0), (1, 2.0))
    blocks, alone = row_blocks([*long, other, short], 2)
    assert blocks == {(4, 3): {(0, 1, 2, 3): long}}
    assert alone == [other, short]


def test_a_network_and_its_mirror_image_pair_up_by_one_pattern_of_signs():
    rng = np.random.default_rng(1)
    W, s = rng.standard_normal((4, 6)), np.array([1.0, -1, -1, 1, 1, -1])
    pairs, found = mirror_pairs(np.concatenate([W, (W * s)[::-1]]))
    np.testing.assert_array_equal(found, s)
    assert pairs == [(0, 7), (1, 6), (2, 5), (3, 4)]


def test_rows_that_differ_by_unlike_patterns_or_have_no_twin_do_not_pair_up():
    W = np.random.default_rng(1).standard_normal((2, 4))
    unlike = np.concatenate([W, W * np.array([[1.0, -1, 1, 1], [1, 1, -1, 1]])])
    assert mirror_pairs(unlike) is None
    assert mirror_pairs(W) is None
    assert mirror_pairs(np.concatenate([W, W])) is None, "the same rows once more are no mirror image"


def rows_of(lengths):
    """Rows of these numbers of terms, no two alike."""
    return [tuple((100 * number + k, 1.0) for k in range(length)) for number, length in enumerate(lengths)]


@pytest.mark.parametrize(("lengths", "groups"), [
    ([3] * 50 + [2] * 50, [[2] * 50 + [3] * 50]),  # 50 terms more, but one group less
    ([40] + [2] * 50, [[2] * 50, [40]]),  # else filled up with 1,900 terms
    ([2] * 50 + [3] * 50 + [90] * 2, [[2] * 50 + [3] * 50, [90] * 2]),
    ([], [])])
def test_sums_go_together_where_filling_up_the_shorter_ones_takes_less_time_than_another_group(lengths, groups):
    found = alike_in_length(rows_of(lengths), group_time=100.0, term_time=1.0)
    assert [[len(row) for row in group] for group in found] == groups
