"""Races over random columns whose rows are kept, and the same numbers by plain least squares on these rows."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np

from nnhydro.diagnosis.bank import Bank, Candidate, build
from nnhydro.diagnosis.blocks import Blocks, block_grams, parts_of
from nnhydro.diagnosis.race import Race
from nnhydro.diagnosis.score import Bench
from nnhydro.diagnosis.table import Piece, Table

P, K, JOINTS = 3, 6, 2
TRUTH = np.array([1.0, -2.0, 0.5])
NOISE = np.array([0.5, 2.0])


def candidate(name, columns, own=(), joint=0, grid=1, **keys):
    """A candidate whose instance knows only what the selection asks of it."""
    keys = {"spans": {}, "spell": None, "plausible": lambda values: True, "width": len(columns) + len(own), **keys}
    return Candidate(SimpleNamespace(key=(name, joint), grid=grid, **keys), tuple(columns), tuple(own))


SINGLE = tuple(candidate(f"effect_{k}", (k,)) for k in range(K))


def tables(seed, planted=(), units=7, joints=JOINTS, noise=NOISE, columns=K, rows=(70, 140)):
    """Tables [Y X y] (rows, joints, P + K + 1) of unlike lengths; `planted` {column: value}, noise (joints,)."""
    rng, made = np.random.default_rng(seed), []
    for _ in range(units):
        YX = rng.standard_normal((int(rng.integers(*rows)), joints, P + columns))
        y = YX[..., :P] @ TRUTH + noise[:joints] * rng.standard_normal(YX.shape[:2])
        for column, value in dict(planted).items():
            y = y + value * YX[..., P + column]
        made.append(np.concatenate([YX, y[..., None]], axis=2))
    return made


def blocks_of(made, parts=4):
    """The blocks of the tables."""
    grams, rows, unit = [], [], []
    for number, table in enumerate(made):
        G, n = block_grams(table, parts)
        grams.append(G)
        rows.append(n)
        unit.append(np.full(len(n), number))
    return Blocks(np.concatenate(grams), np.concatenate(rows), np.concatenate(unit), P)


def met_of(made, columns):
    """The products of the last `columns` columns with the torque, (joints, columns)."""
    return np.sum([np.einsum("njk,nj->jk", table[..., -1 - columns:-1], table[..., -1]) for table in made], axis=0)


def race(made, bank=SINGLE, prior=0.0, low=-np.inf, high=np.inf, noise=NOISE, chosen=()):
    """The race over `bank` on the tables, with those numbers of the bank chosen."""
    noise, columns = noise[: made[0].shape[1]], made[0].shape[2] - P - 1
    torque = np.sum([(table[..., -1] ** 2).sum(axis=0) for table in made], axis=0)
    found = Race(Bank(tuple(bank), np.full(columns, low), np.full(columns, high), torque, met_of(made, columns)),
                 Bench.of(blocks_of(made), noise, np.broadcast_to(np.asarray(prior, float), (P,)).copy()), noise)
    found.chosen = [bank[k] for k in chosen]
    return found


@dataclass(frozen=True)
class Rows:
    """All rows of all joints in units of the noise, one after the other: Z (n, P + K), y (n,), unit, block and joint (n,)."""

    Z: np.ndarray
    y: np.ndarray
    unit: np.ndarray
    block: np.ndarray
    joint: np.ndarray


def rows(made, noise=NOISE):
    """The tables as plain rows."""
    Z, y, unit, block, joint, count = [], [], [], [], [], 0
    for number, table in enumerate(made):
        for part in parts_of(len(table), 4):
            for j in range(table.shape[1]):
                piece = table[part][:, j] / noise[j]
                Z.append(piece[:, :-1])
                y.append(piece[:, -1])
                for where, value in ((unit, number), (block, count), (joint, j)):
                    where.append(np.full(len(piece), value))
            count += 1
    return Rows(np.concatenate(Z), *(np.concatenate(x) for x in (y, unit, block, joint)))


def fit(Z, y, prior=0.0, own=None, weight=0.0):
    """Least squares with a Gaussian prior of precision `prior` on the first P; `own` (n, o) has values held by the precision `weight`."""
    q = Z.shape[1]
    precision = np.zeros(q + (0 if own is None else own.shape[1]))
    precision[:P] = prior
    if own is not None:
        precision[q:] = weight
        Z = np.column_stack([Z, own])
    stacked = np.vstack([Z, np.diag(np.sqrt(precision))])
    return np.linalg.lstsq(stacked, np.concatenate([y, np.zeros(len(precision))]), rcond=None)[0][:q]


class Plain:
    """A table of `tables` rows: the instance made by `instance(columns)` stands for these columns; `places` of recordings by number."""

    def __init__(self, made, steady=(), places=None):
        joints = made[0].shape[1]
        rng = np.random.default_rng(0)
        self.made = made
        self.pieces = tuple(
            Piece(k, 0, table[..., :P], table[..., -1], 2 * table[..., -1],
                  {f"dq{j + 1}_rad_s": rng.standard_normal(len(table)) for j in range(joints)}, 0.0 if k in steady else 0.05,
                  f"run{k}", 0.05 * np.arange(len(table)),
                  None if places is None or k in steady else places[k] + np.linspace(0.0, 0.5, len(table)))
            for k, table in enumerate(made))
        units = tuple(SimpleNamespace(name=f"run{k}", steady=k in steady) for k in range(len(made)))
        model = SimpleNamespace(arm=SimpleNamespace(n_links=joints), preparation=SimpleNamespace(low_pass=None))
        self.case = SimpleNamespace(all_units=units, model=model)
        self.computed = []

    def columns(self, piece, instances, believed):
        """The columns of the instances on one piece."""
        parts = [self.made[piece.number][..., [P + k for k in one.of]] for one in instances]
        parts = [X if one.spell is None else X * one.spell.mask(piece.recording, piece.place, piece.state)[:, None, None]
                 for one, X in zip(instances, parts, strict=True)]
        return np.concatenate(parts, axis=2) if parts else np.zeros((*piece.y.shape, 0))

    def compute(self, piece, instances, believed):
        """Nothing is to be computed."""
        self.computed.append((piece.number, len(instances)))

    rows = Table.rows


@dataclass(eq=False)
class Known:
    """An instance for `Plain`: the columns `of` the tables; `own` are those places among them with a value of each recording's own."""

    key: tuple[str, int]
    of: tuple[int, ...]
    own: tuple[int, ...] = ()
    grid: int = 1
    limits: tuple[tuple[float, float], ...] | None = None
    spans: dict = field(default_factory=dict)
    effect: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(spread={}, own_in_every_recording=False, reads_torque=False))
    spell: object = None
    start: bool = False

    @property
    def width(self):
        return len(self.of)

    def bounds(self):
        return self.limits or ((-np.inf, np.inf),) * len(self.of)

    def plausible(self, values):
        return True


def instance(name, of, own=(), **keys):
    """The instance of the effect `name` that the columns `of` stand for."""
    return Known((name, 0), tuple(of), tuple(own), **keys)


def raced(table, instances, noise=NOISE, prior=0.0, chosen=()):
    """The race over `instances` on a plain table."""
    bank, blocks = build(table, instances, None)
    noise = noise[: len(bank.torque)]
    found = Race(bank, Bench.of(blocks, noise, np.broadcast_to(np.asarray(prior, float), (P,)).copy()), noise)
    found.chosen = [bank.candidates[k] for k in chosen]
    return found
