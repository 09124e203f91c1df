"""Small diagnoses made of random columns: a design, an unknown, a library and a search, in which every figure can be computed densely."""

from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np

from nnhydro.diagnosis.constants import RHO
from nnhydro.diagnosis.experiment.rig_limits import Rig
from nnhydro.diagnosis.model.evidence import WhiteRows
from nnhydro.diagnosis.model.sizes import Sizes, none
from nnhydro.diagnosis.model.unknown import Unknown
from nnhydro.diagnosis.search.library import Library
from nnhydro.diagnosis.search.stepwise import Search
from nnhydro.diagnosis.search.weighted_library import WeightedLibrary

FREE = (-np.inf, np.inf)


@dataclass(frozen=True, eq=False)
class Law:
    """A hypothesis that knows only what the algebra asks of it."""

    effect: SimpleNamespace
    width: int = 1
    per_recording: bool = False
    limits: tuple[tuple[float, float], ...] = ()
    spans: dict = field(default_factory=dict)
    activity: object = None
    working_model: None = None
    rough: bool = False
    values_by_recording: dict = field(default_factory=dict)
    lines: dict = field(default_factory=dict)
    log_tried: float = 0.0
    sense: Callable[[np.ndarray], bool] = lambda values: True

    @property
    def key(self):
        return self.effect.id, self.effect.joint

    @property
    def differs_between_recordings(self):
        return self.per_recording or self.activity is not None

    @property
    def bounds(self):
        return self.limits or (FREE,) * self.width

    def plausible(self, values):
        return self.sense(values)


def law(name, width=1, joint=0, family=None, cause="", standard=False, predictable_share=1.0,
        depends_on=("qd",), varies=False, everywhere=False, **keys):
    """The law `name`, of a family of its own."""
    signature = SimpleNamespace(mistaken_for=(), depends_on=depends_on)
    card = SimpleNamespace(id=name, joint=joint, family=family or name, cause=cause, standard=standard, varies=varies, general=False,
                           everywhere=everywhere, signature=signature, predictable_share=predictable_share)
    return Law(card, width, **keys)


def design(seed=0, groups=4, rows=15, joints=2, p=2, planted=None, noise=1.0):
    """A design of `groups` recordings of `rows` rows of unit scale; `planted` (n, joints) is added to baseline and noise."""
    rng = np.random.default_rng(seed)
    n = groups * rows
    Y = rng.standard_normal((n, joints, p))
    y = Y @ rng.standard_normal(p) + noise * rng.standard_normal((n, joints))
    y = y if planted is None else y + planted
    group = np.repeat(np.arange(groups), rows)
    problem = SimpleNamespace(group_of=group, block_of=2 * group + np.tile(np.arange(rows) >= rows // 2, groups), groups=groups,
                              further_columns=0, blocks=[SimpleNamespace(steady=False)], frequency=np.tile(np.arange(rows) / rows, groups))
    flat = Y.reshape(n * joints, p)
    excess = y - (flat @ np.linalg.lstsq(flat, y.ravel())[0]).reshape(y.shape)
    free = SimpleNamespace(lowest=np.full(p, -np.inf), highest=np.full(p, np.inf))
    return SimpleNamespace(Y=Y, y=y, tau=y, problem=problem, scale=np.array([1.0, 2.0])[:joints], duration=float(n), excess=excess,
                           input_variance=np.zeros_like(y), stated_friction=np.zeros_like(y),
                           baseline=SimpleNamespace(is_physics=True, prior=free), undriven=False, left=np.ones(joints))


def unknown(of, seed=1, m=3):
    """An unknown of two sizes: `m` columns each."""
    Phi = np.random.default_rng(seed).standard_normal((len(of.y), 2 * m))
    s = np.tile(1 / np.arange(1, m + 1), 2)
    return Unknown(Phi, s, np.repeat([0, 1], m), ("q1_rad", "pairs"))


def whitened(of, seed=2, even=False, rows=None, m=3, level=1.0):
    """The rows of a design over noise of unlike variances, or of the variance `level` everywhere."""
    v = np.full_like(of.y, level) if even else np.random.default_rng(seed).uniform(0.5, 2.0, of.y.shape)
    return WhiteRows(of, unknown(of, m=m), v, rows)


def library(of, laws, seed=3):
    """Random columns for `laws` beside the design."""
    width = sum(law.width for law in laws)
    X = np.random.default_rng(seed).standard_normal((*of.y.shape, width))
    return Library(of, tuple(laws), (X,), np.ones(width))


def search(of, laws, X=None, even=True, size=0.1, level=1.0):
    """The search among `laws`, their columns `X` (n, joints, k) random by default."""
    made = library(of, laws) if X is None else Library(of, tuple(laws), (X,), np.ones(X.shape[2]))
    white = whitened(of, even=even, level=level)
    return Search(WeightedLibrary(white, made), Sizes.even(white, size))


def dense(white, X, t, at=None):
    """log N(y; 0, V + A L A') of rows `at` (all) computed with the full covariance matrix; X (n, joints, k) or None, t (P,)."""
    at = np.arange(len(white.y)) if at is None else at
    joints, cov = white.joints, []
    A = []
    for j in range(joints):
        blocks = [white.design.Y[at, j]]
        blocks += [white.unknown.Phi[at] if i == j else np.zeros((len(at), white.m)) for i in range(joints)]
        A.append(np.concatenate([*blocks, *([] if X is None else [X[at, j]])], axis=1))
    A = np.concatenate(A)
    scale = np.concatenate([t, np.full(0 if X is None else X.shape[2], RHO)])
    cov = np.diag(white.v[at].T.ravel()) + (A * scale**2) @ A.T
    y = white.design.y[at].T.ravel()
    sign, logdet = np.linalg.slogdet(cov)
    assert sign > 0
    return -0.5 * (logdet + y @ np.linalg.solve(cov, y))


def unknown_part(of, size):
    """A torque (n, joints) at joint 1 out of the first group of the unknown's columns."""
    made = np.zeros_like(of.y)
    made[:, 0] = size * unknown(of).Phi[:, :3] @ np.ones(3)
    return made


def written_out(view, chosen):
    """The columns (n, joints, k) of the laws `chosen`: one set per recording where the values are each recording's own; None of none."""
    made, group = [], view.library.design.problem.group_of
    for k in chosen:
        X = view.library.columns(k)
        own = view.library.hypotheses[k].per_recording
        made += [X * (group == g)[:, None, None] for g in range(view.library.design.problem.groups)] if own else [X]
    return np.concatenate(made, axis=2) if made else None


def rig():
    """What a rig of two joints on a carriage can do."""
    return Rig(np.array([[-1.0, 1.0], [-0.5, 2.0]]), np.array([1.5, 2.0]), np.array([6.0, 8.0]), 0.5, np.array([9.0, 3.0]), 8.0)


LAWS = (*(law(f"law_{k}") for k in range(4)), law("phased", per_recording=True), law("half", limits=((0.0, np.inf),)))


def planted(values=(0.5,), smooth=0.3, seed=0):
    """A search in which the first laws act, beside `smooth` of the unknown's first column at joint 1."""
    of = design(seed, groups=8, rows=30)
    X = np.random.default_rng(seed + 50).standard_normal((*of.y.shape, len(LAWS)))
    of.y = of.y + X[..., : len(values)] @ np.asarray(values)
    one = search(of, LAWS, X)
    of.y[:, 0] += smooth * one.whitened.unknown.Phi[:, 0]
    return search(of, LAWS, X)


def evidences(one, chosen):
    """The dense evidence of a set with the unknown and without it, less constants."""
    group = one.whitened.design.problem.group_of
    parts = [one.view.library.columns(k) for k in chosen]
    laws = [one.view.library.hypotheses[k] for k in chosen]
    parts = [np.concatenate([X * (group == g)[:, None, None] for g in range(8)], axis=2) if law.per_recording else X
             for law, X in zip(laws, parts, strict=True)]
    X = np.concatenate(parts, axis=2) if parts else None
    sizes = one.score(chosen).sizes
    return [dense(one.whitened, X, s.vector(one.whitened)) for s in (sizes, none(one.whitened))]


def with_values(beta, seed=0, groups=8, rows=30, noise=1.0, laws=None, scale=1.0, joints=2):
    """A search on a design in which the first law acts with `beta`, a number or one per recording, in the units of its effect."""
    laws = laws or tuple(law(f"law_{k}") for k in range(3))
    of = design(seed, groups=groups, rows=rows, noise=noise, joints=joints)
    X = np.random.default_rng(seed + 50).standard_normal((*of.y.shape, sum(law.width for law in laws)))
    each = np.broadcast_to(np.asarray(beta, float), groups)[of.problem.group_of]
    of.y = of.y + each[:, None] / scale * X[..., 0]
    one = search(of, laws, X, level=noise**2)
    return Search(WeightedLibrary(one.whitened, Library(of, tuple(laws), (X,), np.full(X.shape[2], scale))), one.start)


def special_beside_plain(sense):
    """A search in which a special law of two values fits much better than the plain one of its family, and the set with it."""
    of = design(0, groups=8, rows=30)
    X = np.random.default_rng(50).standard_normal((*of.y.shape, 3))
    of.y = of.y + X @ [0.0, 1.0, 1.0]
    X[..., 0] = X[..., 1] + 0.3 * X[..., 2]
    one = search(of, (law("plain", family="friction"), law("special", 2, family="friction", sense=sense)), X)
    return one, one.score((1,))


EIGHT = tuple(law(f"law_{k}") for k in range(8))


def columns(of, k=8, seed=50):
    """Columns (n, joints, k) whose rms is the scale of joint 1."""
    return np.random.default_rng(seed).standard_normal((*of.y.shape, k))


def with_planted(values, seed=0, laws=EIGHT, **keys):
    """A search on a design in which the first laws act with `values`."""
    of = design(seed, groups=8, rows=30, **keys)
    X = columns(of, sum(law.width for law in laws))
    of.y = of.y + X[..., : len(values)] @ np.asarray(values, float)
    return search(of, laws, X)
