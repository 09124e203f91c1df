"""A load term is found by its kind."""

import pytest
from rigs import arm, assert_close, run

from nnhydro.errors import ModelError
from nnhydro.physics.flow import Flow
from nnhydro.physics.load_term import term_kinds, term_of
from nnhydro.physics.loads.rotor_inertia import RotorTerm


def test_an_unknown_kind_is_refused_with_the_known_ones():
    with pytest.raises(ModelError, match="unknown load term 'no_such_term'"):
        term_of({"kind": "no_such_term"})


def test_a_kind_of_an_earlier_version_is_read_by_its_name_of_today():
    document = RotorTerm.at_start(arm(2)).document()
    assert term_of({**document, "kind": "drive_inertia"}) == term_of(document)
    assert "drive_inertia" not in term_kinds()


def test_an_option_that_a_term_does_not_have_is_refused_with_its_kind():
    document = RotorTerm.at_start(arm(2)).document()
    with pytest.raises(ModelError, match=r"term 'rotor_inertia': .*colour"):
        term_of({**document, "options": {"colour": "red"}})


def test_a_linear_term_is_its_columns_times_its_values():
    term, flow = RotorTerm((0.2, 0.5)), Flow(arm(2), run(2))
    assert_close(term.torque(flow), term.columns(flow)[..., 0] * 0.2 + term.columns(flow)[..., 1] * 0.5)
