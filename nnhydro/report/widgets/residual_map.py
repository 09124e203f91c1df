"""Where in the space of states a model's residual lies: a grid of cells, each with the recordings that fill it.

    cell        rms residual [N m] of one joint over the compared rows whose two state variables fall into it
    share_r     the part of the cell's squared residual that recording r brings
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np
from numpy.typing import NDArray

from nnhydro.conventions import joint_text
from nnhydro.report.widgets.trace import Trace, bin_edges

Array = NDArray[np.float64]
BINS = 10
FEWEST = 5  # rows in a cell that is shown
NAMED_RECORDINGS = 6  # recordings named in a cell
WHITE_IN_LIGHT, BLACK_IN_DARK = 0.565, 0.476  # there the scale's luminance is 0.18: black and white stand out alike, 4.6 to 1
STATES = {"q": "angle of joint {} [rad]", "qd": "rate of joint {} [rad/s]", "qdd": "acceleration of joint {} [rad/s²]"}
State = tuple[str, int]  # one of STATES, and a joint from 0
ORDER = "when"  # the name of the map over recordings and time


@final
@dataclass(frozen=True, eq=False)
class Cell:
    """One cell: rms and mean residual N m, rows, and the recordings that fill it with their share of the squared residual."""

    rms: float
    mean: float
    rows: int
    recordings: tuple[tuple[str, float], ...]

    @property
    def text(self) -> str:
        """The rms with the sign of the mean where that dominates."""
        sign = "" if abs(self.mean) < 0.5 * self.rms else "+" if self.mean > 0 else "\N{MINUS SIGN}"
        return f"{sign}{self.rms:.2g}"


@final
@dataclass(frozen=True, eq=False)
class ResidualMap:
    """A grid of one joint and one model: `cells[row][column]`, None where too few rows fall."""

    joint: int  # from 1
    model: str
    over: str
    across: str  # what the columns are
    down: str  # what the rows are
    columns: list[str]
    rows: list[str]
    cells: list[list[Cell | None]]
    across_edges: Array  # of the columns
    down_edges: Array  # of the rows, which begin at the largest; empty where a row is a recording

    @property
    def key(self) -> str:
        """What the page's selectors choose a map by."""
        return f"{self.joint}|{self.over}|{self.model}"

    @property
    def largest(self) -> float:
        """The largest rms."""
        return max((cell.rms for row in self.cells for cell in row if cell is not None), default=0.0)


def shade(v: float) -> str:
    """Return the class of a cell at v (0 to 1) of the colour scale: where black or white text is read best, in light and in dark."""
    return "hi" if v > WHITE_IN_LIGHT else "mid" if v > BLACK_IN_DARK else ""


def largest(maps: Sequence[ResidualMap]) -> dict[int, float]:
    """Return the largest rms of each joint: where its colours end."""
    return {joint: max(grid.largest for grid in maps if grid.joint == joint) for joint in {grid.joint for grid in maps}}


def _ranges(edges: Array) -> list[str]:
    return [f"{a:.2g} to {b:.2g}" for a, b in pairwise(edges)]


def _place(values: Array, edges: Array) -> NDArray[np.int64]:
    return np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)


def state_pairs(joint: int, links: int) -> dict[str, tuple[State, State]]:
    """Return the maps of one joint (from 0) by name: the state variables across and down, each with its joint."""
    pairs = {"angle and rate": (("q", joint), ("qd", joint)), "rate and acceleration": (("qd", joint), ("qdd", joint))}
    if links > 1:
        pairs["rates of joints 1 and 2"] = (("qd", 0), ("qd", 1))
    return pairs


def _cell(r: Array, of: NDArray[np.int64], names: Sequence[str]) -> Cell | None:
    """The rms and mean of the residual in a cell and the recordings that fill it; None for too few rows."""
    if len(r) < FEWEST:
        return None
    energy = np.bincount(of, r**2, minlength=len(names))
    order = np.argsort(-energy, kind="stable")[:NAMED_RECORDINGS]
    total = float(energy.sum()) or 1.0
    return Cell(float(np.sqrt((r**2).mean())), float(r.mean()), len(r),
                tuple((names[i], float(energy[i] / total)) for i in order if energy[i] > 0.005 * total))


def _grid(r: Array, of: NDArray[np.int64], names: Sequence[str], column: NDArray[np.int64], row: NDArray[np.int64], shape: tuple[int, int]
          ) -> list[list[Cell | None]]:
    """Cells by row and column of the map."""
    place = row * shape[1] + column
    order = np.argsort(place, kind="stable")
    bounds = np.searchsorted(place[order], np.arange(shape[0] * shape[1] + 1))
    cells = [_cell(r[order[a:b]], of[order[a:b]], names) for a, b in pairwise(bounds)]
    return [cells[k * shape[1]:(k + 1) * shape[1]] for k in range(shape[0])]


def residual_maps(traces: Sequence[Trace], models: Sequence[str]) -> list[ResidualMap]:
    """Return every map of the runs in `traces` (steady tables have none): joints x pairs of states x `models`."""
    moving = [trace for trace in traces if not trace.segment.steady]
    if not moving:
        return []
    names = list(dict.fromkeys(trace.recording for trace in moving))
    of = np.concatenate([np.full(int(trace.segment.keep.sum()), names.index(trace.recording)) for trace in moving])
    def values(state: State) -> Array:
        """Return a state variable over all compared rows."""
        return np.concatenate([getattr(trace.segment, state[0])[trace.segment.keep, state[1]] for trace in moving])

    def label(state: State) -> str:
        """Return a state variable in words with its unit."""
        return joint_text(STATES[state[0]].format(state[1] + 1), moving[0].segment.sliding)

    progress = np.concatenate([np.linspace(0, 1, int(trace.segment.keep.sum()), endpoint=False) for trace in moving])
    links, maps = moving[0].segment.n_links, list[ResidualMap]()
    for joint in range(links):
        left = {model: np.concatenate([trace.residual(model)[trace.segment.keep, joint] for trace in moving]) for model in models}
        for over, (x, y) in state_pairs(joint, links).items():
            across, down = bin_edges(values(x), BINS, 0.005), bin_edges(values(y), BINS, 0.005)
            column, row = _place(values(x), across), BINS - 1 - _place(values(y), down)
            maps += [ResidualMap(joint + 1, model, over, label(x), label(y), _ranges(across), _ranges(down)[::-1],
                                 _grid(r, of, names, column, row, (BINS, BINS)), across, down) for model, r in left.items()]
        column = (progress * BINS).astype(np.int64)
        maps += [ResidualMap(joint + 1, model, ORDER, "tenth of the recording", "recording", [str(k + 1) for k in range(BINS)], names,
                             _grid(r, of, names, column, of, (len(names), BINS)), np.linspace(0, 1, BINS + 1), np.empty(0))
                 for model, r in left.items()]
    return maps
