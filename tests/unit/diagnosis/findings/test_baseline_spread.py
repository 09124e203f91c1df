"""What is a load does not hang on the baseline."""

import pytest
from diagnosed import searched

from nnhydro.diagnosis.findings.baseline_spread import spread_by_baseline


@pytest.mark.slow
def test_a_load_does_not_hang_on_the_baseline():
    found = searched("rubbing")
    (k,) = found.decided.claimed.chosen
    assert not spread_by_baseline(found.search, found.decided.claimed, k).any()
