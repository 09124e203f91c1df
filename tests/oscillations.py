"""An oscillation of unknown frequency and damping in a small diagnosis: a law with nonlinear values whose best fit scipy can find, too."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
from problems import design, law, whitened
from scipy.optimize import least_squares

from nnhydro.diagnosis.model.sizes import Sizes
from nnhydro.diagnosis.search.gauss_newton import at_best_values
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary
from nnhydro.effects.quantity import Quantity

BOUNDS = {"frequency": (0.1, 5.0), "damping": (0.0, 5.0)}


@dataclass(frozen=True)
class Shape:
    """The effect: what the algebra asks of it."""

    frequency: tuple[float, ...]
    damping: tuple[float, ...]
    id: str = "oscillation"
    joint: int = 0
    family: str = "oscillation"
    standard: bool = False
    everywhere: bool = False
    varies: bool = False
    general: bool = False
    signature: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(mistaken_for=(), depends_on=("t",)))
    linear: tuple[float, ...] = (0.0, 0.0)

    @staticmethod
    def linear_names():
        return "cosine", "sine"

    def with_linear(self, values):
        return replace(self, linear=tuple(map(float, values)))

    def quantities(self):
        a, b = (Quantity(value, "N m") for value in self.linear)
        return {"cosine": a, "sine": b, "damping": Quantity(self.damping[0], "1/s"), "octave": Quantity(1.0, "1")}

    @staticmethod
    def parameters():
        return [SimpleNamespace(name=name, metadata={"bounds": pair}) for name, pair in BOUNDS.items()]


def oscillation(frequency, damping, per_recording=False):
    """The law, its neighbours a tenth of a hertz and a half away."""
    base = law("oscillation", width=2, per_recording=per_recording)

    @dataclass(frozen=True, eq=False)
    class Oscillation(type(base)):
        def with_values(self, values):
            return self.effect.with_linear(values)

        def with_nonlinear(self, values, spans):
            return replace(self, effect=replace(self.effect, **values), spans={**self.spans, **spans})

    spans = {"frequency": (frequency - 0.1, frequency + 0.1), "damping": (damping - 0.5, damping + 0.5)}
    return Oscillation(Shape((frequency,), (damping,)), 2, per_recording, spans=spans)


def columns(of, frequency, damping):
    """exp(-c t) cos, exp(-c t) sin of 2 pi f t at joint 1 and half of them at joint 2, (n, 2, 2)."""
    t = of.problem.frequency * 4  # s
    psi = 2 * np.pi * frequency * t
    x = np.exp(-damping * t)[:, None] * np.stack([np.cos(psi), np.sin(psi)], axis=1)
    return np.stack([x, 0.5 * x], axis=1)


def with_oscillation(truth, start, beta=(0.8, 0.4), noise=0.3, seed=0, per_recording=False, rows=60):
    """A search over noise of `noise` in which an oscillation of `truth` (frequency, damping) is planted and `start` is
    tried first."""
    of = design(seed, groups=8, rows=rows, noise=noise)
    each = np.broadcast_to(np.asarray(beta, float), (8, 2))[of.problem.group_of]
    of.y = of.y + np.einsum("njk,nk->nj", columns(of, *truth), each)
    of.columns = lambda laws, model: np.concatenate([columns(of, o.effect.frequency[0], o.effect.damping[0]) for o in laws], axis=2)
    of.problem.stretches = ()
    of.baseline = SimpleNamespace(at=lambda z: None, within=lambda z: z)
    grid = [start, *((f, c) for f in (0.2, 4.0) for c in (0.0, 3.0))]  # what else is tried says how far a value may lie
    laws = tuple(oscillation(*shape, per_recording=per_recording) for shape in grid)
    white = whitened(of, even=True, level=noise**2)
    return Search(WeightedLibrary(white, Library.of(of, laws, None)), Sizes.even(white, 0.1))


def by_scipy(one, start):
    """Frequency, damping, and their deviations by a fit of all values to the same rows over known noise."""
    white = one.whitened

    def left(x):
        model = white.design.Y @ x[4:] + columns(white.design, *x[:2]) @ x[2:4]
        return ((white.design.y - model) / np.sqrt(white.v)).ravel()

    found = least_squares(left, np.concatenate([start, [0.8, 0.4], np.zeros(white.p)]), xtol=1e-12)
    return found.x[:2], np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))[:2]


def moved(one):
    """The grown search, its best set and the one member of it."""
    grown = at_best_values(one, one.score((0,)), None)
    (k,) = grown.best.chosen
    return grown.search, grown.best, k, grown.search.view.library.hypotheses[k].effect
