"""The golden vectors, made once by an independent program, are met to the tolerance that each file states."""

import pytest
from golden_deviations import deviations, tolerance
from golden_pins import FILES


@pytest.mark.parametrize("file", FILES)
def test_the_golden_file_is_met_to_its_own_tolerance(file):
    worst = deviations(file)
    relative, absolute = tolerance(file)
    assert worst.compared >= 30
    assert worst.share <= 1, (f"{file}.json: {worst.what} is off by {worst.share:.3g} of the tolerance (relative {relative:g}, absolute "
                              f"{absolute:g}); largest deviation in the file {worst.absolute:.3g}")
