"""One thread inside the block, as many as before behind it, whatever happens inside."""

import pytest
import torch
from threadpoolctl import threadpool_info

from nnhydro.physics.threads import one_thread


@pytest.fixture
def two_threads():
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    yield
    torch.set_num_threads(before)


def counts():
    return torch.get_num_threads(), max(library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas")


@pytest.mark.usefixtures("two_threads")
def test_inside_there_is_one_thread_and_behind_it_as_many_as_before():
    with one_thread():
        assert counts() == (1, 1)
    assert torch.get_num_threads() == 2
    with pytest.raises(ValueError, match="inside"), one_thread():
        raise ValueError("inside")
    assert torch.get_num_threads() == 2


@pytest.mark.usefixtures("two_threads")
def test_a_function_is_decorated_alike():
    assert one_thread()(counts)() == (1, 1)
    assert torch.get_num_threads() == 2
