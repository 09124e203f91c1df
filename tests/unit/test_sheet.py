"""Numbers in words: errors keep two digits that count, chances that draws cannot tell from 0 are bounded."""

import pytest

from nnhydro.sheet import p_text, percent


@pytest.mark.parametrize(("share", "text"), [(0.435, "43.5 %"), (0.0349, "3.5 %"), (0.0057, "0.57 %"), (0.0055, "0.55 %"),
                                             (0.006, "0.60 %"), (0.0004, "0.040 %"), (3e-7, "0.0 %"), (0.0, "0.0 %")])
def test_an_error_that_falls_is_not_said_to_stay(share, text):
    assert percent(share) == text


@pytest.mark.parametrize(("p", "draws", "text"), [(0.0342, None, "p = 0.034"), (0.0, None, "p < 0.001"), (0.0, 199, "p < 0.005")])
def test_a_chance_is_never_said_to_be_nothing(p, draws, text):
    assert p_text(p, draws) == text
