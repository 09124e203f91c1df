"""What the tests of concealed campaigns share."""

import pytest

from nnhydro.blind_tests.conceal import conceal
from nnhydro.blind_tests.seal import write_key
from nnhydro.blind_tests.truth.campaign import Wish


@pytest.fixture(scope="session")
def suite(tmp_path_factory):
    """A folder with a key, and a suite of two small campaigns: friction, and nothing hidden."""
    folder = tmp_path_factory.mktemp("suite")
    write_key(folder / "key.txt", bytes(range(32)))
    wishes = [Wish("coulomb_friction", "strong", 1, 1, "small"), Wish("none", "strong", 2, 1, "small")]
    conceal(folder / "suite", wishes, 11, folder / "key.txt")
    return folder
