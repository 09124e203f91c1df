"""What every test of printed text starts from."""

import pytest

from nnhydro.cli.terminal import output


@pytest.fixture(autouse=True)
def not_quiet(monkeypatch):
    """No command that ran before has asked for its verdict alone."""
    monkeypatch.setattr(output, "_quiet", False)
