"""A Python file of the user adds effects, or is refused with one line."""

import pytest
from hypotheses import PLUGIN
from rigs import arm

from nnhydro.effects.catalogue import candidates, catalogue
from nnhydro.effects.plugin import load_plugin
from nnhydro.errors import ConfigError
from nnhydro.physics.load_term import term_of


@pytest.mark.usefixtures("catalogue_as_it_was")
def test_a_file_adds_a_hypothesis(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(PLUGIN)
    assert load_plugin(path) == ("squeak",)
    assert load_plugin(path) == ("squeak",)
    hypothesis = candidates(catalogue()["squeak"], arm(2))[1]
    assert term_of(hypothesis.document()) == hypothesis
    assert "0.1 N m s^3/rad^3" in hypothesis.statement()


@pytest.mark.usefixtures("catalogue_as_it_was")
@pytest.mark.parametrize(("text", "message"), [
    ("", "declares no effect"), ("1 +", "SyntaxError"), ("import no_such_library", "ModuleNotFoundError"),
    (PLUGIN.replace('source = "heard"', ""), "source is missing"), (PLUGIN.replace('"odd"', '"strange"'), "parity 'strange'"),
    (PLUGIN.replace('"squeak"', '"coulomb_friction"'), "is taken"), (PLUGIN.replace('"dry_friction"', '"noise"'), "family 'noise'"),
    (PLUGIN.replace("0.1, (0.0, 9.0)", "-1.0, (0.0, 9.0)"), "outside the bounds"),
    (PLUGIN.replace("0.1, (0.0, 9.0)", "9.1, (0.0, 9.0)"), "outside the bounds"), (PLUGIN.replace('"strength"', '""'), "no meaning"),
])
def test_a_file_that_cannot_be_used_is_refused_with_one_line(tmp_path, text, message):
    path = tmp_path / "bad.py"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_plugin(path)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="is not a file"):
        load_plugin(tmp_path / "none.py")
