"""What nnhydro raises: every exception says what is wrong, where, the likely cause and the call that mends it."""

from typing import NoReturn

LONGEST = 1000  # characters of a message: a line that has to be scrolled is not read, and files may hold names of any length


class NnhydroError(Exception):
    """A user's error that one clear line explains; the command line prints that line and exits with 2.

    Of a message longer than LONGEST the beginning (what is wrong, where) and the end (what to do) are kept.
    """

    def __init__(self, message: str) -> None:
        half = LONGEST // 2
        super().__init__(message if len(message) <= LONGEST else f"{message[:half]} ... {message[-half:]}")


class ArmError(NnhydroError):
    """arm.yaml cannot be used."""


class RecordingError(NnhydroError):
    """A recording or a steady table cannot be used."""


class CampaignError(NnhydroError):
    """A campaign folder cannot be used."""


class ConfigError(NnhydroError):
    """A configuration, recipe or option cannot be used."""


class ModelError(NnhydroError):
    """A model folder cannot be used."""


class ModelWarning(UserWarning):
    """An answer of a model that may mislead: Python's `warnings` show it once, or raise it where asked to."""


class MissingExtraError(NnhydroError):
    """An optional library is not installed."""


def count_text(number: int, noun: str) -> str:
    """Return "1 row", "2 rows", "2 entries": `number` and `noun`, in the plural where there are several."""
    many = f"{noun[:-1]}ies" if noun.endswith("y") else f"{noun}s"
    return f"{number} {noun if number == 1 else many}"


def require(condition: bool, message: str, error: type[NnhydroError] = ConfigError) -> None:
    """Raise `error` with `message` unless `condition` holds."""
    if not condition:
        raise error(message)


def missing_extra(library: str, extra: str, purpose: str) -> NoReturn:
    """Raise `MissingExtraError` naming the pip command that installs `library`."""
    raise MissingExtraError(f"{purpose} needs the library {library!r}, which is not installed: pip install 'nnhydro[{extra}]'")
