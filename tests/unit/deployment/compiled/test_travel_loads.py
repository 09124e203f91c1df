"""The kernel's loops, run as plain Python, give what the strips in torch give: every rule, number of links, curve and motion."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rigs import arm
from travelling import assert_equal, motion, travelling

from nnhydro.deployment.compiled.travel_loads import TravelLoads
from nnhydro.physics.flow import Flow
from nnhydro.physics.motion import Motion, tensor

numba = pytest.importorskip("numba")
KINDS = ("from rest", "under way", "pauses", "still", "steady")


@pytest.fixture
def loops(monkeypatch):
    """physics/travel_kernel.py without its compiler, in the place of the compiled one."""
    import nnhydro.physics.travel.kernel as compiled

    monkeypatch.setattr(numba, "njit", lambda **options: lambda function: function)
    spec = importlib.util.spec_from_file_location("travel_loops", Path(compiled.__file__))
    plain = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(plain)
    for name in ("strip_loads", "fastest"):
        monkeypatch.setattr(compiled, name, getattr(plain, name))
    return plain


def few(travel):
    """The same terms on two strips per link: enough, and quick."""
    return TravelLoads(travel.arm, [replace(term, per_link=3) for term in travel.terms])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("links", "bsplines", "options"), [
    (1, False, {}), (2, True, {}), (2, False, {"at_reversal": "keep"}), (2, False, {"dwell_s": 0.3}),
    (2, False, {"at_reversal": "decay", "memory": 3.0}), (2, False, {"at_reversal": "decay", "memory": 0.5, "dwell_s": 0.2}),
    (2, False, {"at_reversal": "keep", "dwell_s": 0.1}),
])
def test_the_loops_give_the_torques_of_the_terms(loops, kind, links, bsplines, options):
    a = arm(links)
    for seed in range(2):
        assert_equal(few(travelling(a, seed, options, bsplines)), Flow(a, motion(seed, links, 150, kind)))


def reversing(rows=160, links=1):
    """A fast sine that comes back by more than is ringing, many times, with rests of no motion at all between."""
    t = 0.02 * np.arange(rows)
    v = 3.0 * np.sin(6 * t) * (np.floor(t / 0.5) % 3 != 2)
    q = np.cumsum(v) * 0.02
    q, v, acc = (np.repeat(x[:, None], links, axis=1) for x in (q, v, np.gradient(v, 0.02)))
    return Motion(tensor(t), tensor(q), tensor(v), tensor(acc), tensor(np.zeros(rows)), tensor(np.zeros(rows)))


@pytest.mark.parametrize("options", [{}, {"at_reversal": "keep"}, {"at_reversal": "decay", "memory": 2.0}, {"dwell_s": 0.15},
                                     {"at_reversal": "decay", "memory": 2.0, "dwell_s": 0.15}])
def test_the_loops_reverse_and_rest_as_the_terms_do(loops, options):
    for links in (1, 2):
        a = arm(links)
        assert_equal(few(travelling(a, 3, options)), Flow(a, reversing(links=links)))


def test_a_recording_in_pieces_is_not_torn(loops, monkeypatch):
    monkeypatch.setattr(loops, "PIECE", 40)
    a = arm(2)
    for kind in ("from rest", "under way"):
        assert_equal(few(travelling(a, 1, {"at_reversal": "decay", "memory": 2.0, "dwell_s": 0.2})), Flow(a, motion(1, 2, 170, kind)))


def test_the_fastest_speed_of_every_strip_is_kept_from_block_to_block(loops):
    rng = np.random.default_rng(1)
    motion_, x, peak = rng.standard_normal((2, 5, 30)), rng.uniform(0, 1, (2, 4)), np.full((2, 4), 0.1)
    peak[1, 2] = 99.0
    w = np.abs(motion_[:, 0, None, 1:] * x[..., None] + motion_[:, 1, None, 1:]).max(axis=2)
    loops.fastest(motion_, x, peak)
    want = np.maximum(w, 0.1)
    want[1, 2] = 99.0
    np.testing.assert_allclose(peak, want)
