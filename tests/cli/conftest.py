"""What the tests of commands share."""

import pytest

from nnhydro.cli.main import run


@pytest.fixture
def said(capsys):
    """Run a command; returns exit code, standard output and standard error."""

    def call(*arguments):
        capsys.readouterr()
        code = run([str(a) for a in arguments])
        return code, *capsys.readouterr()

    return call
