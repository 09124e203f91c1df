"""What an error says stays readable: one class to catch, a length that fits, counts in words."""

import pytest

from nnhydro import errors
from nnhydro.errors import LONGEST, ConfigError, MissingExtraError, NnhydroError, RecordingError, count_text, missing_extra, require


def test_every_error_is_caught_by_one_class():
    classes = [cls for cls in vars(errors).values() if isinstance(cls, type) and issubclass(cls, Exception)]
    raised = [cls for cls in classes if not issubclass(cls, Warning)]
    assert len(raised) >= 7
    assert all(issubclass(cls, NnhydroError) for cls in raised)


def test_a_message_too_long_to_read_keeps_its_beginning_and_its_end():
    said = str(NnhydroError("run1.csv: " + 5000 * "x" + ": rename the column"))
    assert said.startswith("run1.csv: ")
    assert said.endswith(": rename the column")
    assert len(said) == LONGEST + len(" ... ")
    assert str(NnhydroError(LONGEST * "x")) == LONGEST * "x"


@pytest.mark.parametrize(("number", "noun", "text"), [
    (1, "row", "1 row"), (2, "row", "2 rows"), (0, "entry", "0 entries"), (1, "entry", "1 entry")])
def test_counts_are_in_words(number, noun, text):
    assert count_text(number, noun) == text


def test_what_is_required_is_raised_as_the_error_asked_for():
    require(True, "nothing")
    with pytest.raises(ConfigError, match="no such option"):
        require(False, "no such option")
    with pytest.raises(RecordingError):
        require(False, "no such column", RecordingError)


def test_a_missing_library_is_named_with_the_command_that_installs_it():
    with pytest.raises(MissingExtraError, match=r"reading bags needs the library 'rosbags'.*pip install 'nnhydro\[ros\]'"):
        missing_extra("rosbags", "ros", "reading bags")
