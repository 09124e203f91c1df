"""The bank: hypotheses with their places among the columns, and the Gram matrices of these columns, a block and joint."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.diagnosis.blocks import PARTS, Blocks, block_grams, parts_of
from nnhydro.diagnosis.instances import Instance, Key
from nnhydro.diagnosis.table import Beside, Table
from nnhydro.errors import CampaignError
from nnhydro.models.strip_theory import StripTheory

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Candidate:
    """An instance and its columns in the bank: those with one value for all recordings, and those with one in each recording.

    `held` are places among the former whose value a fit would take below its least one, 0: it is held there.
    """

    instance: Instance
    columns: tuple[int, ...]
    own: tuple[int, ...] = ()
    held: frozenset[int] = frozenset()

    @property
    def free(self) -> tuple[int, ...]:
        """The columns with one value for all recordings that is fitted."""
        return tuple(k for place, k in enumerate(self.columns) if place not in self.held) if self.held else self.columns

    def holding(self, held: Iterable[int]) -> "Candidate":
        """Return the candidate with the values at the places `held` at 0, and no others."""
        wanted = frozenset(held)
        return self if wanted == self.held else replace(self, held=wanted)

    @property
    def key(self) -> Key:
        """What is claimed: effect and joint."""
        return self.instance.key

    @property
    def grid(self) -> int:
        """How many values of the nonlinear parameters were tried."""
        return self.instance.grid


@final
@dataclass(frozen=True, eq=False)
class Bank:
    """Candidates, the bounds of their columns' values, the energy of the measured torque and the columns' products with it."""

    candidates: tuple[Candidate, ...]
    low: Array  # (K,)
    high: Array  # (K,)
    torque: Array  # (joints,) (N m)^2
    met: Array  # (joints, K) N m times the column's unit: sum of column times measured torque


def listed(instances: Sequence[Instance]) -> tuple[Candidate, ...]:
    """Return the candidates of `instances`, whose columns lie side by side in their order."""
    made, start = [], 0
    for one in instances:
        own = tuple(start + k for k in one.own)
        made.append(Candidate(one, tuple(k for k in range(start, start + one.width) if k not in own), own))
        start += one.width
    return tuple(made)


def build(table: Table, instances: Sequence[Instance], believed: StripTheory, beside: Beside | None = None) -> tuple[Bank, Blocks]:
    """Return the bank of `instances` and the Gram matrices of their columns.

    Instruments that are not settled are taken at the reading of the model `believed`.
    `beside` gives further columns (n, joints, m) of each piece that stand with the baseline's.
    """
    if not table.pieces:
        low_pass = table.case.model.preparation.low_pass
        raise CampaignError("no recording holds enough independent rows to diagnose" + ("" if low_pass is None else
                            f" behind the low-pass at {low_pass.cutoff_hz:g} Hz: record longer runs, or give a higher --cutoff"))
    K, joints = sum(one.width for one in instances), table.case.model.arm.n_links
    rows, numbers, torque, met = [], [], np.zeros(joints), np.zeros((joints, K))
    grams, place = np.zeros((0, 0, 0, 0)), 0
    blocks_of = [len(parts_of(len(piece.y), PARTS if piece.dt else 1)) for piece in table.pieces]
    for (piece, full), count in zip(table.rows(instances, believed, beside), blocks_of, strict=True):
        G, n = block_grams(full, count)
        grams = grams if grams.size else np.zeros((sum(blocks_of), *G.shape[1:]))  # filled in place: a list and its sum are twice as much
        grams[place:place + count] = G
        place += count
        torque += (piece.tau**2).sum(axis=0)
        met += np.einsum("njk,nj->jk", full[..., full.shape[2] - 1 - K:-1], piece.tau)
        rows.append(n)
        numbers.append(np.full(count, piece.number))
    unit_number = np.unique(np.concatenate(numbers), return_inverse=True)[1]
    bounds = [bound for one in instances for bound in one.bounds()]
    low, high = (np.array([bound[i] for bound in bounds], dtype=float) for i in (0, 1))
    blocks = Blocks(grams, np.concatenate(rows), unit_number, grams.shape[2] - K - 1)
    return Bank(listed(instances), low, high, torque, met), blocks
